"""Every setting of the import's map that the checks of a dataset print is set, and the dataset then passes them."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.diagnosis.dataset import conventions
from bumblebee.diagnosis.thresholds.dataset import Conventions
from bumblebee.measured.model_file import load_model
from bumblebee.measured.rollout import Rollout, read_dataset
from bumblebee.measured.usable import review
from bumblebee.quaternions import conjugate, rotate_by_cross
from bumblebee.robot.facts import joint_names
from bumblebee.robot.model import write_xml
from tests.measured.importers.remedies.walk import Import, settings
from tests.measured.simulated import ARM, ARM_JOINTS, arm_rollout, tracked_rollout

SERVO = '<position name="{0}" joint="{0}" kp="40" kv="2" forcerange="-20 20"/>'
MODEL = ARM.replace("ACTUATORS", "".join(SERVO.format(name) for name in ARM_JOINTS))
VECTORS = ("joint_pos", "joint_vel", "joint_target")
BASE = {"base_quat": "wxyz", "base_ang_vel": "xyz", "base_lin_vel": "xyz"}
TURNS = ("turn_left", "turn_left_slow", "turn_right", "turn_right_slow")
Change = Callable[[pd.DataFrame], pd.DataFrame]


@cache
def log_of(seed: int, robot: str) -> pd.DataFrame:
    """A rollout as a table; of the G1 with its velocities in the world frame and the inverse rotation beside."""
    made_by = {"arm": arm_rollout, "g1": lambda seed: tracked_rollout(TURNS[seed])}
    rollout = made_by[robot](seed)
    made = {"time": rollout.time}
    for column in VECTORS:
        made |= {f"{column}.{name}": getattr(rollout, column)[:, k] for k, name in enumerate(rollout.joints)}
    if robot == "g1":
        vectors = {column: getattr(rollout, column) for column in BASE}
        vectors["world_ang_vel"] = rotate_by_cross(rollout.base_quat, rollout.base_ang_vel)
        vectors["world_lin_vel"] = rotate_by_cross(rollout.base_quat, rollout.base_lin_vel)
        vectors["world_quat"] = conjugate(rollout.base_quat)
        for column, values in vectors.items():
            made |= {f"{column}.{k}": values[:, k] for k in range(values.shape[1])}
    return pd.DataFrame(made)


def logs(attempt: Import, change: Change, robot: str = "arm", count: int = 4) -> None:
    """Logs as CSV, each with a change, beside the map that reads the unchanged ones."""
    joints = ARM_JOINTS if robot == "arm" else joint_names()
    for seed in range(count):
        change(log_of(seed, robot).copy()).to_csv(attempt.logs / f"log{seed}.csv", index=False)
    columns = {column: [f"{column}.{name}" for name in joints] for column in VECTORS}
    if robot == "g1":
        columns |= {column: numbered(column) for column in BASE}
    attempt.map = {"joints": list(joints), "columns": columns}
    attempt.model = MODEL
    attempt.options |= {"--model"}
    if robot == "g1":
        write_xml(attempt.folder / "g1.xml")
        attempt.model = (attempt.folder / "g1.xml").read_text()


def numbered(column: str, of: str = "") -> list[str]:
    return [f"{of or column}.{k}" for k in range(len(BASE[column]))]


def refusal(attempt: Import) -> str:
    """Why the dataset cannot be used, as `gap` and `diagnose` print it; empty where it can."""
    attempt.run()
    model = load_model(attempt.folder / "model.xml")
    reviewed: list[tuple[Rollout, conventions.Review]] = [
        (rollout, review(rollout, model)) for rollout in read_dataset(attempt.folder / attempt.out).rollouts
    ]
    wrong, _ = conventions.wrong_conventions(reviewed, "dataset", Conventions())
    first = next((one.refused for _, one in reviewed if one.refused), None)
    return str(wrong or first or "")


def again(attempt: Import) -> int:
    """Rollouts that can be used, all of those of an import under another name."""
    attempt.out = "mended"
    assert refusal(attempt) == ""
    return len(read_dataset(attempt.folder / attempt.out).rollouts)


def emptied(log: pd.DataFrame) -> pd.DataFrame:
    log.loc[7, "joint_pos.elbow"] = np.nan
    return log


def test_a_setting_in_a_finding_is_set_and_the_files_pass(tmp_path: Path) -> None:
    attempt = Import(tmp_path)
    logs(attempt, emptied)
    settings(attempt, refusal(attempt))
    assert again(attempt) == 4


def test_what_was_logged_at_several_rates_is_imported_as_files_of_their_own(tmp_path: Path) -> None:
    attempt = Import(tmp_path)
    rows = [*range(100), *range(100, 200, 2), *range(200, 300)]
    logs(attempt, lambda log: log.iloc[rows])
    assert "import what was logged at each rate as a file of its own" in refusal(attempt)
    for path in list(attempt.logs.iterdir()):
        whole = pd.read_csv(path)
        for k, part in enumerate((whole[:100], whole[100:150], whole[150:])):
            part.to_csv(path.with_name(f"{path.stem}{'abc'[k]}.csv"), index=False)
        path.unlink()
    assert again(attempt) == 12


def test_a_velocity_that_stands_is_left_to_the_import(tmp_path: Path) -> None:
    attempt = Import(tmp_path)
    logs(attempt, lambda log: log.assign(**{"joint_vel.elbow": 0.0}), count=1)
    assert "or no joint_vel: an import makes it from joint_pos" in refusal(attempt)
    del attempt.map["columns"]["joint_vel"]
    assert again(attempt) == 1


def test_velocities_that_an_import_made_are_no_reason_to_set_their_scale(tmp_path: Path) -> None:
    """Positions that jump to and fro are told as such."""
    attempt = Import(tmp_path)
    zero = np.arange(300) % 3 == 0
    logs(
        attempt,
        lambda log: log.assign(**{f"joint_pos.{n}": np.where(zero, 0.0, log[f"joint_pos.{n}"]) for n in ARM_JOINTS}),
    )
    del attempt.map["columns"]["joint_vel"]
    assert "joint_vel" not in refusal(attempt)


@dataclass(frozen=True)
class Wrong:
    """A convention of a logger, and what to set in the map by the line."""

    change: Change
    mend: Callable[[Import, str], None]
    robot: str = "arm"


def times(factor: float, *columns: str) -> Change:
    return lambda log: log.assign(**{name: factor * log[name] for name in log if name.startswith(columns)})


def _named(line: str) -> list[str]:
    return re.search(r"otherwise on ([\w, ]+) in", line)[1].split(", ")


def scale(column: str, pattern: str = r"set scale of [^;]*? to (-?[\d.]+)") -> Callable[[Import, str], None]:
    """`set scale of COLUMN ... to VALUE`, for the joints that the line names or `on all joints`."""

    def mend(attempt: Import, line: str) -> None:
        assert f"set scale of {column}" in line or "set scale of the command" in line, line
        value = float(re.search(pattern, line)[1])
        joints = attempt.map["joints"] if "on all joints" in line else _named(line)
        attempt.map["scale"] = {column: [value if name in joints else 1.0 for name in attempt.map["joints"]]}

    return mend


def says(words: str, **keys: object) -> Callable[[Import, str], None]:
    """The line says `WORDS in the import's map`; keys of `columns` are set there, None takes one out."""

    def mend(attempt: Import, line: str) -> None:
        assert words in line, line
        for key, value in keys.items():
            place = attempt.map["columns"] if key in attempt.map["columns"] else attempt.map
            if value is None:
                del place[key]
            else:
                place[key] = value

    return mend


def exchanged(log: pd.DataFrame) -> pd.DataFrame:
    """The file's names of two targets are each other's."""
    one, other = "joint_target.shoulder", "joint_target.elbow"
    return log.rename(columns={one: other, other: one})


def one_order(attempt: Import, line: str) -> None:
    assert "set the names of joint_pos and of joint_target in one order" in line
    names = attempt.map["columns"]["joint_target"]
    attempt.map["columns"]["joint_target"] = ["elbow_u", "shoulder_u", names[2]]
    for path in attempt.logs.iterdir():
        text = path.read_text().replace("joint_target.shoulder", "elbow_u").replace("joint_target.elbow", "shoulder_u")
        path.write_text(text)
    attempt.map["columns"]["joint_target"] = ["shoulder_u", "elbow_u", names[2]]


def put(**columns: str) -> Change:
    """Columns of the base hold what others have."""
    return lambda log: log.assign(
        **{f"{ours}.{k}": log[f"{theirs}.{k}"] for ours, theirs in columns.items() for k in range(len(BASE[ours]))}
        | {f"kept_{ours}.{k}": log[f"{ours}.{k}"] for ours in columns for k in range(len(BASE[ours]))}
    )


def rolled(log: pd.DataFrame) -> pd.DataFrame:
    return log.assign(**{f"base_quat.{k}": log[f"base_quat.{(k + 1) % 4}"] for k in range(4)})


DEG = 180 / np.pi
WRONG = {
    "degrees": Wrong(times(DEG, *VECTORS), says("set angle_unit to deg", angle_unit="deg")),
    "degrees of velocities": Wrong(times(DEG, "joint_vel"), scale("joint_vel")),
    "degrees of targets": Wrong(times(DEG, "joint_target"), scale("joint_target")),
    "degrees of the gyro": Wrong(times(DEG, "base_ang_vel"), says("set gyro_unit to deg", gyro_unit="deg"), "g1"),
    "target-scale": Wrong(
        times(9.0, "joint_target.elbow"), scale("joint_target", r"one over the gear, about ([\d.]+)")
    ),
    "joint-order": Wrong(exchanged, one_order),
    "velocity-sign": Wrong(times(-1.0, "joint_vel.elbow"), scale("joint_vel")),
    "response-sign": Wrong(times(-1.0, "joint_target.wrist"), scale("joint_target")),
    "velocity-derivative": Wrong(
        times(5.0, "joint_vel"), says("leave joint_vel out, which is then made", joint_vel=None)
    ),
    "range": Wrong(
        lambda log: log.assign(**{n: log[n] + 3.0 for n in log if n.endswith(".elbow") and "vel" not in n}),
        says("set scale or offset of joint_pos", offset={c: [0.0, -3.0, 0.0] for c in ("joint_pos", "joint_target")}),
    ),
    "quaternion-order": Wrong(rolled, says("set quat_order to xyzw", quat_order="xyzw"), "g1"),
    "velocity-frame": Wrong(
        put(base_ang_vel="world_ang_vel", base_lin_vel="world_lin_vel"),
        says(
            "set base_ang_vel and base_lin_vel to columns in the base frame",
            **{c: numbered(c, f"kept_{c}") for c in ("base_ang_vel", "base_lin_vel")},
        ),
        "g1",
    ),
    "gyro-sign": Wrong(
        put(base_quat="world_quat"),
        says(
            "set base_quat to columns of the rotation from base to world",
            base_quat=numbered("base_quat", "kept_base_quat"),
        ),
        "g1",
    ),
}


@pytest.mark.parametrize("name", list(WRONG))
def test_the_setting_that_a_wrong_convention_names_mends_it(tmp_path: Path, name: str) -> None:
    attempt, case = Import(tmp_path), WRONG[name]
    logs(attempt, case.change, case.robot)
    line = refusal(attempt)
    assert f"rule {name.split(' ')[0]}" in line
    case.mend(attempt, line)
    assert again(attempt) == 4


def test_every_convention_is_walked() -> None:
    elsewhere = {"target-copy"}  # no setting of the map: tests/measured/checks/test_target_copy.py
    assert set(conventions._CONVENTIONS) - elsewhere == {name.split(" ")[0] for name in WRONG}
