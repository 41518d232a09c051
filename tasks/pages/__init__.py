"""Pages for people: the intake's, and films and replays of the report."""
