"""3D replays inside a page, and the windows that they show."""
