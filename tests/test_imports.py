"""The import rule: flows -> tasks -> bumblebee, and inside bumblebee from the upper floors to the lower ones."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.import_graph import FLOORS, circles, graph, source
from tests.rooms_picture import PICTURE, drawn

HOME = Path(__file__).parent.parent
ORCHESTRATION = {"prefect", "dvc", "mlflow", "pydantic"}
ONLY = {"clustering": {"motion"}, "tracking": {"motion", "sim"}, "diagnosis": {"effects", "sim", "measured"}}
# Below the ground floor: known to everybody.
FREE = {"DISTRIBUTION", "errors", "files", "first_signal", "io", "last_line", "progress", "quaternions", "ranges"}
FREE |= {"teller", "__init__"}


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """(line, full module name) of every import in a file, those inside functions too."""
    for one in source(path, HOME).imports:
        yield from ((one.line, name) for name in one.full)


def files(package: str) -> list[Path]:
    return sorted((HOME / package).rglob("*.py"))


def offences(package: str, forbidden: set[str]) -> list[str]:
    found = []
    for path in files(package):
        for line, name in imports(path):
            if name.split(".")[0] in forbidden:
                found.append(f"{path.relative_to(HOME)}:{line} imports {name}")
    return found


def allowed_rooms(room: str) -> set[str]:
    level = next(index for index, floor in enumerate(FLOORS) if room in floor)
    below = set().union(*FLOORS[:level])
    if room in ONLY:
        below = ONLY[room] | FLOORS[0]
    return below | {room} | FREE


def test_the_library_knows_nothing_of_the_orchestration():
    assert offences("bumblebee", ORCHESTRATION | {"tasks", "flows"}) == []


def test_typer_appears_in_the_command_line_only():
    commands = ("bumblebee/cli.py", "bumblebee/commands/")
    assert [line for line in offences("bumblebee", {"typer"}) if not line.startswith(commands)] == []


def test_tasks_know_neither_prefect_nor_flows():
    assert offences("tasks", {"prefect", "flows"}) == []


def test_mlflow_is_named_in_one_folder_and_imported_inside_functions_only():
    found = offences("tasks", {"mlflow"})
    assert found != []
    named = {line.split(":")[0] for line in found}
    assert all(name.startswith("tasks/registry/") for name in named)
    for name in named:
        tree = ast.parse((HOME / name).read_text())
        top = [name for node in tree.body if isinstance(node, ast.Import) for name in [a.name for a in node.names]]
        assert "mlflow" not in top


def test_flows_leave_torch_and_mlflow_to_the_stages():
    assert offences("flows", {"torch", "mlflow", "mujoco"}) == []


def test_every_room_stands_on_a_floor():
    rooms = {path.name for path in (HOME / "bumblebee").iterdir() if path.is_dir() and list(path.glob("*.py"))}
    assert rooms <= set().union(*FLOORS) | FREE


def test_a_folder_has_at_most_twenty_modules():
    folders = {path.parent for top in ("bumblebee", "tasks", "flows", "benchmarks", "tests") for path in files(top)}
    many = {f: [p for p in f.glob("*.py") if p.name not in ("__init__.py", "__main__.py")] for f in folders}
    assert [f"{f.relative_to(HOME)}: {len(found)}" for f, found in many.items() if len(found) > 20] == []


def test_the_picture_of_the_rooms_is_the_codes():
    assert PICTURE.read_text() == drawn(), "the rooms changed; if they should: python -m tests.rooms_picture"


def rooms_with_code() -> list[str]:
    return sorted(room for room in set().union(*FLOORS) if list((HOME / "bumblebee" / room).glob("*.py")))


@pytest.mark.parametrize("room", rooms_with_code())
def test_a_room_imports_its_own_floor_or_lower_ones(room: str):
    found = []
    for path in files(f"bumblebee/{room}"):
        for line, name in imports(path):
            parts = name.split(".")
            if parts[0] == "bumblebee" and len(parts) > 1 and parts[1] not in allowed_rooms(room):
                found.append(f"{path.relative_to(HOME)}:{line} imports {name}")
    assert found == []


def test_the_rule_would_see_an_import_inside_a_function(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "bumblebee").mkdir()
    (tmp_path / "bumblebee" / "a.py").write_text("def f():\n    from prefect import flow\n")
    monkeypatch.setattr("tests.test_imports.HOME", tmp_path)
    assert offences("bumblebee", {"prefect"}) == ["bumblebee/a.py:2 imports prefect.flow"]


# Circles that are left on purpose, each with its reason; none is.
CIRCLES_INSIDE_FUNCTIONS: dict[tuple[str, ...], str] = {}


def test_no_modules_import_each_other_in_a_circle():
    assert circles(graph(HOME, late=False)) == []


def test_imports_inside_functions_close_no_circle_but_those_with_a_reason():
    assert {tuple(circle) for circle in circles(graph(HOME, late=True))} == set(CIRCLES_INSIDE_FUNCTIONS)


def test_a_circle_over_several_modules_is_seen(tmp_path: Path):
    rooms = {
        "a": "from bumblebee import b\n",
        "b": "from bumblebee.c import x\n",
        "c": "def f():\n    import bumblebee.a\n",
    }
    (tmp_path / "bumblebee").mkdir()
    for name, text in rooms.items():
        (tmp_path / "bumblebee" / f"{name}.py").write_text(text)
    assert circles(graph(tmp_path, late=False)) == []
    assert circles(graph(tmp_path, late=True)) == [["bumblebee.a", "bumblebee.b", "bumblebee.c"]]


# Rooms with a face: who is outside takes names from it alone; the engines are chosen by name in one module.
FACES = (
    "bumblebee/sim/effects",
    "bumblebee/measured/checks",
    "bumblebee/measured/importers",
    "bumblebee/learning/delta",
)
BEHIND_FACES = {"bumblebee/sim/engine_choice.py"}


@pytest.mark.parametrize("room", FACES)
def test_from_outside_a_room_is_seen_by_its_face(room: str):
    inside = {f"{path.relative_to(HOME).with_suffix('')}".replace("/", ".") for path in files(room)}
    found = []
    for package in ("bumblebee", "tasks", "flows", "benchmarks"):
        for path in files(package):
            place = str(path.relative_to(HOME))
            if not place.startswith(f"{room}/") and place not in BEHIND_FACES:
                found += [f"{place}:{line} {name}" for line, name in imports(path) if name.rpartition(".")[0] in inside]
    assert found == []


def test_what_the_loop_writes_is_named_in_one_file():
    found = []
    for path in (*files("tasks"), *files("flows")):
        for node in ast.walk(ast.parse(path.read_text())):
            text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
            if text.startswith(("data/", "models/", "reports/")) and path.name != "paths.py":
                found.append(f"{path.relative_to(HOME)}:{node.lineno} {text}")
    assert found == []
