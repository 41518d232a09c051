"""Sections of the report: sentences and tables from the results."""
