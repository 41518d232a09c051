"""The edge: what comes in from files, what goes out to them, and the names that data may give to files."""
