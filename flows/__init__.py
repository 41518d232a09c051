"""When: Prefect walks the stages of dvc.yaml, runs clusters side by side and holds the gates."""
