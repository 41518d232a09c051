"""Random robots with random logs: whatever comes, a diagnosis ends with a valid document or with one line."""
