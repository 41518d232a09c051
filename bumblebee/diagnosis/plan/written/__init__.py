"""A plan as files and words: CSV and Parquet, `plan.json`, run sheets, the terminal."""
