"""Ground, slope and surfaces."""
