"""Remedies of HDF5 and of ASAP's arrays."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from bumblebee.robot.model import write_xml
from tests.measured.importers.remedies.tables import mapped, option
from tests.measured.importers.remedies.walk import HINGES, PASSIVE, Case, Import, settings, table
from tests.measured.simulated import arm_rollout, g1_rollout
from tests.measured.test_importers import asap_file


def without_model(attempt: Import) -> None:
    asap_file(attempt.logs / "log.npz", g1_rollout(0, 0.5), g1_rollout(0, 0.5).base_lin_vel)
    write_xml(attempt.folder / "g1.xml")
    attempt.kind, attempt.options, attempt.model = "asap", set(), (attempt.folder / "g1.xml").read_text()


def xyzw(attempt: Import) -> None:
    without_model(attempt)
    attempt.options = {"--model"}
    roll(attempt, -1)


def roll(attempt: Import, by: int) -> None:
    place = attempt.logs / "log.npz"
    held = dict(np.load(place))
    np.savez(place, **held | {"IMU_quaternion": np.roll(held["IMU_quaternion"], by, axis=1)})


def another_robot(attempt: Import) -> None:
    rollout = arm_rollout(0, seconds=1.2)
    np.savez(
        attempt.logs / "log.npz",
        time=rollout.time, joint_pos=rollout.joint_pos[:, :2], joint_vel=rollout.joint_vel[:, :2],
        joint_pos_cmd=rollout.joint_target[:, :2],
    )  # fmt: skip
    attempt.kind, attempt.options, attempt.model = "asap", {"--model"}, PASSIVE


def given(model: str) -> Callable[[Import, str], None]:
    def mend(attempt: Import, line: str) -> None:
        assert "Give the model of the robot that was logged: --model." in line
        attempt.model = model

    return mend


def hdf5(attempt: Import) -> None:
    import h5py

    made = table()
    with h5py.File(attempt.logs / "log.h5", "w") as file:
        file["q"] = made[["hip_pos", "knee_pos"]].to_numpy()
        file["u"] = made[["hip_cmd", "knee_cmd"]].to_numpy()
        file["t"] = made["time"].to_numpy()
    columns = {"joint_pos": "q", "joint_target": "u"}
    attempt.map = {"joints": ["hip", "knee"], "columns": columns, "angle_unit": "rad", "time": "t", "time_unit": "s"}
    attempt.kind = "hdf5"


def hdf5_without(key: str, **more: Any) -> Callable[[Import], None]:
    def bad(attempt: Import) -> None:
        hdf5(attempt)
        attempt.map.pop(key, None)
        attempt.map |= more

    return bad


CASES = (
    Case("no model", without_model, "--model", option),
    Case("hdf5 without a unit", hdf5_without("angle_unit"), "angle_unit.*state it", mapped(angle_unit="rad")),
    Case("hdf5 without stamps", hdf5_without("time"), "time: expected the path.*state it", mapped(time="t")),
    Case(
        "hdf5 and valid",
        hdf5_without("", valid="u"),
        "valid: expected no such key",
        lambda a, line: (settings(a, line), a.map.pop("valid")),
    ),
    Case("asap as xyzw", xyzw, "np.roll", lambda a, line: roll(a, int(re.search(r"np.roll\(\w+, (\d)", line)[1]))),
    Case("asap of another robot", another_robot, "--model", given(HINGES)),
)
