"""Films and replays of the report."""
