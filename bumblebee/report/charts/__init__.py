"""Charts and figures of the report."""
