"""Services that every stage runs with: paths, outputs, lineage, and what MLflow is told."""
