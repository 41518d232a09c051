"""Robots in the browser: a policy live, motions, measured rollouts; on loopback, behind one port."""
