"""How soon a lab's servers answer a hundred users, beside plain MLflow and Prefect on the same database and store."""
