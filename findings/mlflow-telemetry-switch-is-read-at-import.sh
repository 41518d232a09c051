#!/bin/bash
# mlflow 3.17.2. MLFLOW_DISABLE_TELEMETRY=true stops the usage reports only where it is set before `import mlflow`: the
# client is made by the import, and setting the variable afterwards leaves it running. MLflow's page on usage tracking
# names the variable and does not say so. Seen: set before, no client; set after, a TelemetryClient.
# Source: mlflow/__init__.py (set_telemetry_client()), mlflow/telemetry/utils.py (is_telemetry_disabled).
set -euo pipefail
unset MLFLOW_DISABLE_TELEMETRY DO_NOT_TRACK CI
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q mlflow-skinny==3.17.2
cd "$here"
cat >before.py <<'PY'
import os

os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
import mlflow
from mlflow.telemetry.client import get_telemetry_client

print("mlflow", mlflow.__version__, "set before the import:", type(get_telemetry_client()).__name__)
assert get_telemetry_client() is None
PY
cat >after.py <<'PY'
import os

import mlflow
from mlflow.telemetry.client import get_telemetry_client

os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
print("mlflow", mlflow.__version__, "set after the import:", type(get_telemetry_client()).__name__)
assert get_telemetry_client() is not None
PY
venv/bin/python before.py
venv/bin/python after.py
