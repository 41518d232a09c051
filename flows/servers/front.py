"""A server behind its guard: `python -m flows.servers.front prefect|mlflow --workspace FOLDER --socket N --keeper PID`.

The keeper has bound the socket, so that nobody can take the port between its choice and its use. The password is read
from its file; nothing secret stands on the command line or in the log. With `--door N`, another bound socket, people
from elsewhere get in there, as `lab.yaml` says (`flows/people/door.py`).
"""

import argparse
import os
import socket
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from flows.environment import SERVERS
from flows.people import login
from flows.people.guard import Guard
from flows.servers.first_look import LoginHint, first_look
from tasks import registry
from tasks.lab.servers import read_lab
from tasks.running.parent import end_with_parent

if TYPE_CHECKING:
    import uvicorn

GRACE = 2  # [s] that open connections get at the end


def main(argv: list[str] | None = None) -> int:
    """Serve until SIGTERM, or until the keeper is gone."""
    parser = argparse.ArgumentParser(prog="python -m flows.servers.front", description=__doc__)
    parser.add_argument("server", choices=["prefect", "mlflow"])
    parser.add_argument("--workspace", type=Path, required=True)
    parser.add_argument("--socket", type=int, required=True, help="number of the bound socket")
    parser.add_argument("--keeper", type=int, required=True, help="the process that ends this one")
    parser.add_argument("--door", type=int, help="number of the bound socket for people from elsewhere")
    options = parser.parse_args(argv)
    end_with_parent()
    if os.getppid() != options.keeper:
        return 1  # it ended before this one could watch it
    os.umask(0o077)
    folder = options.workspace / SERVERS
    password = login.read(folder)
    if password is None:
        print(f"{folder / login.NAME}: no password that only its owner can read", file=sys.stderr)
        return 1
    listener = socket.socket(fileno=options.socket)
    port = int(listener.getsockname()[1])
    if options.door is not None:
        os.environ["MLFLOW_SERVER_ALLOWED_HOSTS"] = "*"  # the guard and the door before it judge them
    try:
        prefect = options.server == "prefect"
        app = LoginHint(prefect_app(port, password)) if prefect else mlflow_app(options.workspace)
    except BadInput as error:
        print(error, file=sys.stderr)  # its last line is what the keeper tells
        return EXIT_BAD_INPUT
    door = None
    if options.door is not None:
        from flows.people.door_server import with_door

        door = with_door(options.server, app, options.workspace, password, socket.socket(fileno=options.door))
    # Prefect's page has a login of its own, which its interface and its WebSockets demand; MLflow has none.
    serve(Guard(app, password, ask=options.server == "mlflow"), listener, door)
    return 0


def prefect_app(port: int, password: str) -> Any:
    """Prefect's server with its pages, whatever the port; these ask the address that they came from."""
    os.environ["PREFECT_SERVER_API_HOST"] = "127.0.0.1"
    os.environ["PREFECT_SERVER_API_PORT"] = str(port)
    os.environ["PREFECT_SERVER_UI_API_URL"] = "/api"
    os.environ["PREFECT_SERVER_UI_SHOW_PROMOTIONAL_CONTENT"] = "false"
    os.environ["PREFECT_SERVER_API_CORS_ALLOWED_ORIGINS"] = f"http://127.0.0.1:{port}"
    os.environ["PREFECT_SERVER_API_AUTH_STRING"] = login.pair(password)
    os.environ["PREFECT_API_AUTH_STRING"] = login.pair(password)  # its services are clients of itself
    from prefect.server.api.server import create_app

    app = create_app(final=True)
    for part in (app, *(route.app for route in app.routes if hasattr(route, "app"))):  # itself, interface, pages
        drop_descriptions(part)
    return app


def drop_descriptions(app: Any) -> None:
    """Take out FastAPI's own pages about an application's interface, which would ask for no login."""
    names = ("openapi_url", "docs_url", "redoc_url", "swagger_ui_oauth2_redirect_url")
    pages = {getattr(app, name, None) for name in names} - {None}
    if pages:
        app.router.routes[:] = [route for route in app.router.routes if getattr(route, "path", "") not in pages]


# What `mlflow server` hands to its application; tests/flows/servers/test_servers.py compares the names with MLflow's.
MLFLOW = {
    "_MLFLOW_SERVER_FILE_STORE": "{database}",
    "_MLFLOW_SERVER_REGISTRY_STORE": "{database}",
    "_MLFLOW_SERVER_ARTIFACT_ROOT": "mlflow-artifacts:/",
    "_MLFLOW_SERVER_SERVE_ARTIFACTS": "true",
    "_MLFLOW_SERVER_ARTIFACT_DESTINATION": "{artifacts}",
    "_MLFLOW_SGI_NAME": "uvicorn",
}


def mlflow_app(workspace: Path) -> Any:
    """MLflow's server on the database of the workspace or its lab; by name, since flows import nothing of MLflow.

    Its start page is sent with `first_look`.
    """
    folder, lab = workspace / SERVERS, read_lab(workspace)
    database, artifacts = f"sqlite:///{folder}/{registry.DATABASE}", f"{folder}/artifacts"
    if lab is None:
        registry.ensure_database(folder)
    else:
        database, artifacts = lab.mlflow.connection, lab.mlflow.artifacts
    os.environ |= {name: value.format(database=database, artifacts=artifacts) for name, value in MLFLOW.items()}
    import_module("mlflow.server.handlers").initialize_backend_stores(
        os.environ["_MLFLOW_SERVER_FILE_STORE"],
        os.environ["_MLFLOW_SERVER_REGISTRY_STORE"],
        os.environ["_MLFLOW_SERVER_ARTIFACT_ROOT"],
    )
    pages = import_module("mlflow.server").app
    index = first_look((Path(pages.static_folder) / "index.html").read_text())
    pages.view_functions["serve"] = lambda: index
    return import_module("mlflow.server.fastapi_app").app


def serve(app: Any, listener: socket.socket, door: "Callable[[uvicorn.Config], uvicorn.Server] | None" = None) -> None:
    """Answer on a bound socket until SIGTERM or SIGINT, and at the door as long, if there is one."""
    import uvicorn

    config = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=GRACE, timeout_keep_alive=5)
    (door or uvicorn.Server)(config).run(sockets=[listener])


if __name__ == "__main__":
    raise SystemExit(main())
