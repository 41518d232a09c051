"""First views of the servers' pages: MLflow opens its registered models, Prefect's login says where its password is.

MLflow's start page gets defaults of ours, without assistant and advertisement; Prefect's a line above its login.
"""

import json

from flows.people.guard import App, Message, Receive, Send
from flows.people.login import NAME, USER

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


LOGIN = (
    f"{USER}:password, which is the whole line of the file .servers/{NAME} in the workspace. "
    "From another machine: your own login of the lab."
)
# The field is known by the example that Prefect 3 shows in it.
STYLE = f"""<style>form:has(input[placeholder="admin:pass"])::before {{ content: "{LOGIN}"; }}</style>"""


class LoginHint:
    """Prefect's application; its pages say above the field of their login what to give, and where that is.

    Args:
        app: the application.
    """

    def __init__(self, app: App) -> None:
        self.app = app

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Hand the request on, and a page back with `STYLE` in it."""
        headers = scope.get("headers", [])
        if scope["type"] != "http" or not any(b"text/html" in value for name, value in headers if name == b"accept"):
            await self.app(scope, receive, send)
            return

        async def hinted(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": _without(b"content-length", message["headers"])}
            elif message["type"] == "http.response.body":
                page = message.get("body", b"").replace(b"</head>", f"{STYLE}</head>".encode(), 1)
                message = {**message, "body": page}
            await send(message)

        await self.app({**scope, "headers": _without(b"accept-encoding", headers)}, receive, hinted)


def _without(name: bytes, headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    return [pair for pair in headers if pair[0].lower() != name]
