"""An effect in a package of one's own, the file as docs/adding-an-effect.md has it: found, simulated, named, undone."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]
LOOK = """
import json, sys
import numpy as np
from bumblebee.compensation.plan import compensate
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.sim.effects import CATALOGUE, single
from tests.diagnosis import arm
from tests.sim.hinge import check, reference, servo

check([single("hose_pull", "j", 60.0, 0.1)], reference(lambda t, q, v: servo(t, q, v) - 60.0 * (q - 0.1) ** 3))
(done,) = compensate([single("hose_pull", "left_knee_joint", 4.0, -0.2)]).terms
joint, stiffness, rest = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
here = (np.array(arm.JOINTS) == joint).astype(float)
logs = arm.simulate({}, count=4, seed=5, passive=lambda q, v: -stiffness * (q - rest) ** 3 * here)
print(json.dumps({"undone": done, "found": diagnose(arm.session_of(logs), arm.SMALL).document["effects"]}))
"""


SEALED = """
import sys
from types import SimpleNamespace
import numpy as np
import bumblebee.stand_in.undeclared as room
room.__path__.append(sys.argv[1])
from bumblebee.stand_in.sealed import declared_g1, entry, to_laws
from bumblebee.stand_in.undeclared.kinds import KINDS, LATER, Place

kind = KINDS["hose_pull"]
assert LATER[-1] is kind
drawn = {"sign": -1, "axis": 0, "number": 1, "other": "left_knee_joint"}
told = entry(kind, Place(declared_g1(), "left_knee_joint", drawn), 4.0)
assert (told["parameters"], told["unit"]) == ({"stiffness": 4.0, "rest": -0.2}, "N m/rad^3, rad")
(law,) = to_laws([told])
push = np.zeros((2, 1))
law.passive(SimpleNamespace(q=np.array([[0.3], [-0.2]]), column=lambda name: 0), push)
assert np.allclose(push, [[-4.0 * 0.5**3], [0.0]])
"""


def blocks() -> dict[str, str]:
    """Files of the worked example by their titles."""
    page = (HOME / "docs/adding-an-effect.md").read_text()
    return dict(re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', page, re.M | re.S))


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package, as an installation leaves it."""
    home = tmp_path_factory.mktemp("site")
    (home / "lab_effects").mkdir()
    (home / "lab_effects/__init__.py").touch()
    (home / "lab_effects/hose_pull.py").write_text(blocks()["hose_pull.py"])
    ((name, module),) = re.findall(r'^(\w+) = "([\w.]+)"$', blocks()["pyproject.toml"], re.M)
    info = home / "lab_effects-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-effects\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[bumblebee.effects]\n{name} = {module}\n")
    return home


def run(package: Path, *arguments: str) -> subprocess.CompletedProcess:
    paths = os.pathsep.join([str(package), str(HOME), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, *arguments], cwd=HOME, env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True
    )  # fmt: skip


@pytest.mark.parametrize(("joint", "stiffness", "rest"), [("j2", 4.0, 0.2)])
def test_it_is_found_by_its_name_with_its_size(package: Path, joint: str, stiffness: float, rest: float) -> None:
    done = run(package, "-c", LOOK, joint, str(stiffness), str(rest))
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["undone"][1:] == [-4.0, "(q + 0.2)^3"]
    first = told["found"][0]
    assert (first["effect"], first["where"], len(told["found"])) == ("hose_pull", [joint], 1)
    for name, truth in (("stiffness", stiffness), ("rest", rest)):
        low, high = first["parameters"][name]["ci95"]
        assert low < truth < high and high - low < 0.1 * truth


@pytest.mark.parametrize(
    ("line", "instead", "told"),
    [
        ("    native, absent = False, 0.0\n", "    native = False\n", "absent, or declared"),
        ("    def torque_at(", "    def torque_of(", "hook, or torque_at"),
        ("    law = ", "    remark = ", "law: its law in terms, or why there is none"),
        ("    def undo(", "    def redo(", "undo: how the drive undoes it, or not_undone: why not"),
        ("    native, absent = False, 0.0\n", "    absent = 0.0\n", "add, for it says native"),
    ],
)
def test_what_it_lacks_is_named_with_its_file(package: Path, line: str, instead: str, told: str) -> None:
    file = package / "lab_effects/hose_pull.py"
    whole = file.read_text()
    assert line in whole
    file.write_text(whole.replace(line, instead))
    try:
        done = run(package, "-c", "import bumblebee.sim.effects")
    finally:
        file.write_text(whole)
    assert f"TypeError: {file}: " in done.stderr and told in done.stderr


def test_a_package_that_cannot_be_imported_is_named_in_one_line(package: Path) -> None:
    file = package / "lab_effects/hose_pull.py"
    whole = file.read_text()
    file.unlink()
    try:
        done = run(package, "-c", "from bumblebee.cli import main; main()", "diagnose", "no.xml", "no", "--quick")
        met = run(package, "-c", "from bumblebee.cli import main; main()", "compensate", "no.yaml", "--out", "c.yaml")
    finally:
        file.write_text(whole)
    assert "no.xml" in done.stderr and done.returncode == 2  # what the user gave comes first
    assert met.returncode == 2 and met.stderr.startswith("lab-effects: effect hose_pull: expected a module")
    assert len(met.stderr.splitlines()) == 1


def test_its_law_in_the_stand_in_is_found_and_sealed(tmp_path: Path) -> None:
    (tmp_path / "hose_pull.py").write_text(blocks()["bumblebee/stand_in/undeclared/hose_pull.py"])
    done = run(tmp_path, "-c", SEALED, str(tmp_path))
    assert done.returncode == 0, done.stderr
