"""The rooms of the diagnosis: who imports whom, only through faces, and no number that decides outside a dataclass."""

import ast
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from tests.import_graph import source

HOME = Path(__file__).parents[2]
ROOT = HOME / "bumblebee" / "diagnosis"
# From the ground up; a room imports from rooms on lower floors.
FLOORS = (
    {"thresholds"},
    {"simulation"},
    {"candidates", "dataset"},
    {"residuals"},
    {"estimation", "sensitivities"},
    {"comparison"},
    {"prepare"},  # a module: what a diagnosis works on
    {"selection"},
    {"discrepancy"},
    {"report"},
    {"gap"},
    {"plan"},
)
ROOMS = [room for floor in FLOORS for room in sorted(floor) if (ROOT / room).is_dir()]
GROUND = {"config", "budget"}  # modules that every room may import
# Module-level numbers that decide nothing: what they are stands beside them.
NO_THRESHOLDS = {
    "simulation/cache.py": {"_KEPT_BYTES"},  # memory
    "simulation/starts/first_order.py": {"_FORGOTTEN"},  # rounding
    "simulation/roll.py": {"_KEPT_BYTES"},  # memory
    "simulation/starts/setpoints.py": {"_BYTES"},  # memory
    "simulation/batches.py": {"_MOST_THREADS"},  # threads
    "simulation/inputs.py": {"_KEPT"},  # memory
    "simulation/simulate.py": {"_CHUNK_BYTES"},  # memory
    "simulation/units.py": {"MEASURES"},  # factors of units
    "plan/rehearsal.py": {"_BEFORE", "_TOGETHER"},  # rows of padding, memory
    "plan/written/drawing.py": {"_PANELS"},  # what fits a page
    "residuals/problem.py": {"_GROUP"},  # memory
    "selection/proposals/all_joints/regression.py": {"_NOTHING"},  # rounding
    # halved and doubled they move nothing on the fixed sample: docs/decisions/threshold-day.md
    "dataset/smoothing.py": {"_NEIGHBOURS"},
    "dataset/split.py": {"_COMMANDED"},
    "discrepancy/term_library.py": {
        "_MOST_TARGET_STEPS",
        "_FASTEST_STRENGTH_BEAT",
        "_FASTEST_FRICTION_BEAT",
        "_FEWEST_KNOTS",
    },
    "report/effect_entries.py": {"_COMPARABLE"},
    "residuals/nuisances.py": {"_LEAST_ARMATURE"},
    "estimation/covariance.py": {"_TOLD"},
    "simulation/actuators.py": {"_FEEDBACK"},
    "simulation/collision_culling.py": {"_LEVEL"},
    "simulation/starts/hidden_states.py": {"_LEAD_ERROR"},
    "simulation/windows.py": {"_LEAD_SHARE", "_BRIEF"},
    "selection/proposals/loss_likelihoods.py": {"_HALF"},  # half of the chi-square distribution's 95 % quantile
}


def modules() -> list[Path]:
    return sorted(ROOT.rglob("*.py"))


def room_of(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    return parts[0] if len(parts) > 1 else ""


def imported(path: Path) -> Iterator[tuple[int, list[str]]]:
    """(line, parts after bumblebee.diagnosis) of every import of the diagnosis in a file."""
    for one in source(path, HOME).imports:
        for name in one.names if one.module is None else [one.module]:
            if name.startswith("bumblebee.diagnosis"):
                yield one.line, name.split(".")[2:]


def test_every_folder_is_a_room_of_the_plan() -> None:
    folders = {p.name for p in ROOT.iterdir() if p.is_dir() and p.name != "__pycache__"}
    assert folders == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_from_lower_floors_only(room: str) -> None:
    level = next(k for k, floor in enumerate(FLOORS) if room in floor)
    allowed = set().union(*FLOORS[:level]) | {room} | GROUND
    found = [
        f"{path.relative_to(HOME)}:{line} imports {parts[0]}"
        for path in modules()
        if room_of(path) == room
        for line, parts in imported(path)
        if parts and parts[0] not in allowed
    ]
    assert found == []


def test_other_rooms_and_packages_import_from_a_rooms_face_alone() -> None:
    files = [
        *modules(),
        *(p for d in ("bumblebee", "tasks", "flows", "benchmarks") for p in sorted((HOME / d).rglob("*.py"))),
    ]
    found = []
    for path in dict.fromkeys(files):
        own = room_of(path) if path.is_relative_to(ROOT) else ""
        for line, parts in imported(path):
            private = len(parts) > 1 and parts[0] in ROOMS and parts[0] not in (own, "thresholds")
            if private:
                found.append(f"{path.relative_to(HOME)}:{line} imports {'.'.join(parts)}")
    assert found == []


@pytest.mark.parametrize("room", [room for room in ROOMS if room != "thresholds"])
def test_a_face_offers_what_it_says_and_nothing_that_nobody_asks_for(room: str) -> None:
    face = import_module(f"bumblebee.diagnosis.{room}")
    assert len(set(face.__all__)) == len(face.__all__)
    used = set()
    for directory in ("bumblebee", "tasks", "flows", "benchmarks"):
        for path in (HOME / directory).rglob("*.py"):
            if path.is_relative_to(ROOT / room):
                continue
            for one in source(path, HOME).imports:
                if one.module == f"bumblebee.diagnosis.{room}":
                    used |= set(one.names)
    assert set(face.__all__) - used == set()


def numbers(path: Path) -> Iterator[str]:
    """Names of a module's own that are numbers, or tuples of numbers."""
    for node in ast.parse(path.read_text()).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        if any(
            isinstance(x, ast.Call | ast.Subscript | ast.Attribute | ast.Lambda | ast.Dict)
            for x in ast.walk(node.value)
        ):
            continue
        constants = [x.value for x in ast.walk(node.value) if isinstance(x, ast.Constant)]
        if any(isinstance(x, int | float) and not isinstance(x, bool) for x in constants):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from (x.id for target in targets for x in ast.walk(target) if isinstance(x, ast.Name))


@pytest.mark.parametrize("room", ["", *ROOMS])
def test_numbers_that_decide_are_in_thresholds(room: str) -> None:
    found = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in modules()
        if room_of(path) == room
        for name in numbers(path)
        if name not in NO_THRESHOLDS.get(str(path.relative_to(ROOT)), set())
    }
    assert found == set()


def test_the_guide_names_the_file_that_says_each_line() -> None:
    guide = (HOME / "docs" / "diagnosis.md").read_text()
    rows = re.findall(r"^\| `(.+?)`(?: \(`[\w/]+\.py`.*\))? \| `([\w/]+\.py)` \|$", guide, re.M)
    assert len(rows) > 9
    for line, file in rows:
        words = max(line.split("..."), key=len).strip(" ,:")
        assert words in (ROOT / file).read_text(), (line, file)
