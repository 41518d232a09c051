"""Robots whose declared model comes from a drawing: right masses and lengths, no rotor inertia, no friction."""
