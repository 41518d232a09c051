"""No code names a robot's joint or link, but for what is one robot's alone."""

from pathlib import Path

from bumblebee.robot.folder import read_folder
from bumblebee.robot.which import path_of, shipped

HOME = Path(__file__).parents[2]
ITS_OWN = {
    "bumblebee/report/films/looks.py": "the G1's visible shape",
    "bumblebee/wire/links/unitree_hg.py": "slots of the messages of Unitree's G1",
    "bumblebee/report/charts/figures.py": "an example in a docstring",
    "bumblebee/diagnosis/simulation/readings.py": "an example in a docstring",
}


def test_no_joint_or_link_is_named_outside_the_robots_room() -> None:
    names = set()
    for robot in shipped():
        for body, facts in read_folder(path_of(robot)).bodies.items():
            names |= {body} | ({facts["joint"]["name"]} if "joint" in facts else set())
    names = {name for name in names if "_" in name and name not in ("left_hand", "right_hand")}  # roles
    found = {
        f"{path.relative_to(HOME)}: {name}"
        for folder in ("bumblebee", "tasks", "flows")
        for path in (HOME / folder).rglob("*.py")
        if not path.is_relative_to(HOME / "bumblebee" / "robot")
        for name in names
        if name in path.read_text()
    }
    assert {line.split(":")[0] for line in found} <= set(ITS_OWN), found
