"""Commands on their way to the servo."""
