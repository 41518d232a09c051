"""The sections of params.yaml and the files that they name."""
