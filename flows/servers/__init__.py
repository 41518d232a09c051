"""The servers beside a loop: Prefect, MLflow, the operator's page."""
