"""MLflow's start page with defaults of ours: it opens on the registered models, without assistant and advertisement."""

import json

MODELS = "#/models"  # page of the registered models
# Keys of the page's local storage, as MLflow 3 names them; a key that the reader's browser has already stays.
DEFAULTS = {
    "mlflow.workflowType_v1": '"machine_learning"',
    "mlflow.assistant.fab.autoOpenedOnFirstLoad_v1": "true",
    "mlflow.settings.telemetry.enabled_v1": "false",
    "mlflow.telemetry.info.alert.dismissed_v1": "true",
    "_mlflow_model_registry_promo_modal_dismissed_v1": "true",
}
SCRIPT = f"""<script>
for (const [key, value] of Object.entries({json.dumps(DEFAULTS)}))
  if (localStorage.getItem(key) === null) localStorage.setItem(key, value);
if (!location.hash) location.replace({json.dumps(MODELS)});
</script>"""


def first_look(index: str) -> str:
    """The page `index`, HTML, with a script that sets `DEFAULTS` and opens `MODELS` where the address names no page."""
    return index.replace("<head>", f"<head>{SCRIPT}", 1)
