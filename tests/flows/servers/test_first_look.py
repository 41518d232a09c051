"""MLflow's start page as it is sent: the installed one, with defaults whose names it still reads."""

from pathlib import Path

from flows.servers.first_look import DEFAULTS, MODELS, first_look


def pages() -> Path:
    """The folder of MLflow's pages; its server takes seconds to import, in whichever process runs this file."""
    import mlflow.server

    return Path(mlflow.server.app.static_folder)


def test_the_installed_page_gets_the_defaults_before_its_own_script():
    index = (pages() / "index.html").read_text()
    sent = first_look(index)
    assert len(sent) > len(index) and sent.index(MODELS) < sent.index("<script defer")


def test_the_installed_page_still_reads_every_default():
    code = "".join(file.read_text() for file in (pages() / "static" / "js").rglob("*.js"))
    missing = [key for key in DEFAULTS if f'"{key.removesuffix("_v1")}"' not in code]
    assert not missing, "MLflow calls them by other names now: flows/servers/first_look.py"
