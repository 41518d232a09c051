"""Remedies of maps and of logs in tables."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.measured.importers.remedies.walk import HINGES, PASSIVE, SLIDE, Case, Import, csv_import, settings, table


def log(attempt: Import) -> Path:
    return attempt.logs / "log.csv"


def edited(change: Callable[[str], str | bytes], beside: bool = False) -> Callable[[Import], None]:
    """The good log with its text changed; `beside`: in a file of its own beside the good one."""

    def bad(attempt: Import) -> None:
        csv_import(attempt)
        text = change(log(attempt).read_text())
        place = attempt.logs / "other.csv" if beside else log(attempt)
        place.write_bytes(text if isinstance(text, bytes) else text.encode())

    return bad


def with_columns(model: str = "", options: tuple[str, ...] = (), **more: Any) -> Callable[[Import], None]:
    """The good log with keys of the map; `columns` are put into those of the map."""

    def bad(attempt: Import) -> None:
        made = table()
        for name in ("wx", "wy", "wz", "qw", "qx", "qy", "qz", "force1", "force2", "kp1", "kp2"):
            made[name] = 0.5
        csv_import(attempt, made, **{key: value for key, value in more.items() if key != "columns"})
        attempt.map["columns"] |= more.get("columns", {})
        attempt.model = model or HINGES
        attempt.options |= set(options)

    return bad


def timed(change: Callable[[pd.DataFrame], pd.DataFrame], **more: Any) -> Callable[[Import], None]:
    return lambda attempt: csv_import(attempt, change(table(200)), **more)


def removed(attempt: Import, line: str) -> None:
    """Take the named file out of the source."""
    Path(line.split(": ", 1)[0]).unlink()


def beside_conditions(attempt: Import) -> None:
    csv_import(attempt)
    (attempt.logs / "conditions.csv").write_text("log,supply_voltage\nlog.csv,24\n")


def given_as_said(attempt: Import, line: str) -> None:
    """Give the option that the line ends with."""
    option, path = line.split()[-2:]
    attempt.options.add(option)
    attempt.conditions = Path(path).read_text()


def without_line(attempt: Import, line: str) -> None:
    lines = log(attempt).read_text().splitlines()
    del lines[int(re.search(r"line (\d+)", line)[1]) - 1]
    log(attempt).write_text("\n".join(lines))


def rewritten(change: Callable[[str], str]) -> Callable[[Import, str], None]:
    return lambda attempt, line: log(attempt).write_text(change(log(attempt).read_text()))


def mapped(**keys: Any) -> Callable[[Import, str], None]:
    """State keys of the map; the line asks for each by its name."""

    def mend(attempt: Import, line: str) -> None:
        for key, value in keys.items():
            assert key in line
            attempt.map["columns" if key in attempt.map["columns"] else key] = value

    return mend


def columns(**names: Any) -> Callable[[Import, str], None]:
    return lambda attempt, line: attempt.map["columns"].update(names)


def locked(attempt: Import, line: str) -> None:
    """Put `_` in the place of the joint that is named, and the joint under `locked`."""
    joint = re.search(r"came (?:kp 0 of|all but) (\w+)\.", line)[1]
    attempt.map["joints"] = ["_" if name == joint else name for name in attempt.map["joints"]]
    attempt.map["locked"] = [joint]


def dead_motor(attempt: Import) -> None:
    """The good log with gains, zero for the knee."""
    csv_import(attempt, table(200).assign(kp1=40.0, kd1=2.0, off=0.0))
    attempt.map["columns"] |= {"kp": ["kp1", "off"], "kd": ["kd1", "off"]}
    attempt.options.add("--model")


def option(attempt: Import, line: str) -> None:
    attempt.options.add(re.search(r"--\w+", line)[0])


def nearest(attempt: Import, line: str) -> None:
    wrong, right = re.search(r"came '(\w+)'", line)[1], re.search(r"nearest is (\w+)", line)[1]
    attempt.map["joints"] = [right if joint == wrong else joint for joint in attempt.map["joints"]]


def units(*said: str) -> Callable[[Import, str], None]:
    return lambda attempt, line: attempt.map.update(angle_unit=list(said))


def millimetres(attempt: Import, line: str) -> None:
    assert "Say m, and factors of 0.001 under scale" in line
    attempt.map |= {"angle_unit": "m", "scale": {"joint_pos": 0.001, "joint_target": 0.001}}


def never_complete(made: pd.DataFrame) -> pd.DataFrame:
    made["effort1"] = np.where(np.arange(len(made)) % 2, 1.0, np.nan)
    made["effort2"] = np.where(np.arange(len(made)) % 2, np.nan, 1.0)
    return made


def never(attempt: Import) -> None:
    csv_import(attempt, never_complete(table()), rows="complete")
    attempt.map["columns"]["joint_torque"] = ["effort1", "effort2"]


def retake(made: pd.DataFrame) -> pd.DataFrame:
    made["time"] = np.concatenate((made["time"][:80], made["time"][:120]))
    return made


def swapped(made: pd.DataFrame) -> pd.DataFrame:
    return made.iloc[[*range(50), 51, 50, *range(52, 200)]]


def still(made: pd.DataFrame) -> pd.DataFrame:
    return made.assign(stamp=made["time"], time=1.0)


def existing(attempt: Import) -> None:
    csv_import(attempt)
    (attempt.folder / "out").mkdir()


NAMES = {"joint_pos": ["knee_pos", "hip_pos"]}
CASES = (
    Case(
        "not UTF-8",
        edited(lambda t: t.replace("time", "zeit_\xe4,time").replace("\n", "\n0,").encode("latin-1")),
        "line 1.*Save it as UTF-8",
        lambda a, line: log(a).write_text(log(a).read_bytes().decode("latin-1")),
    ),
    Case("empty", edited(lambda t: "", beside=True), "Take it out of what is imported", removed),
    Case("no rows", edited(lambda t: t.split("\n")[0], beside=True), "Take the file out", removed),
    Case(
        "a line too long",
        edited(lambda t: t.replace("\n", "\n,,,,,,,,,,", 20).replace("\n,,,,,,,,,,", "\n", 19)),
        r"line \d+.*remove the line",
        without_line,
    ),
    Case(
        "cells beyond the header",
        edited(lambda t: re.sub(r"(?<=\d)\n", ",\n", t)),
        "a separator at the end of rows",
        rewritten(lambda t: re.sub(",\n", "\n", t)),
    ),
    Case(
        "a title",
        edited(lambda t: f"my,log,of,3,May\n{t}"),
        "header must be the first line",
        rewritten(lambda t: t.split("\n", 1)[1]),
    ),
    Case(
        "stamps under another name",
        timed(lambda t: t.rename(columns={"time": "stamp"})),
        "Name the column of the time stamps in the map, beside `columns`: `time: NAME`",
        lambda a, line: a.map.update(time="stamp"),
    ),
    Case(
        "stamps under columns",
        with_columns(columns={"time": "time"}),
        "'time'. It is a key beside `columns`: `time:",
        lambda a, line: a.map.update(time=a.map["columns"].pop("time")),
    ),
    Case(
        "another joint's column",
        with_columns(columns={"joint_vel": ["hip_v", "knee_v"]}),
        "Name the columns in the map as the header does",
        lambda a, line: a.map["columns"].pop("joint_vel"),
    ),
    Case(
        "a table of conditions beside the logs",
        beside_conditions,
        r"A table of conditions is an option: --conditions \S+/conditions\.csv$",
        given_as_said,
    ),
    Case(
        "a column twice",
        edited(lambda t: t.replace("knee_cmd", "hip_cmd")),
        "hip_cmd.*Rename or remove one",
        rewritten(lambda t: t.replace("hip_cmd\n", "knee_cmd\n")),
    ),
    Case("milliseconds", timed(lambda t: t.assign(time=1e3 * t["time"])), "look like `time_unit: ms`", settings),
    Case(
        "two stamps",
        timed(lambda t: t.assign(ns=1e9 * t["time"], zero=0), time=["ns", "zero"]),
        "name one, with its",
        lambda a, line: a.map.update(time="ns", time_unit="ns"),
    ),
    Case(
        "a stamp that stands still",
        timed(still),
        "column of another clock under `time`",
        lambda a, line: a.map.update(time="stamp"),
    ),
    Case("two takes", timed(retake), "row 80.*time that starts again.*2 takes in one file", settings),
    Case(
        "rows out of order",
        timed(swapped),
        "Sort the rows by time",
        lambda a, line: pd.read_csv(log(a)).sort_values("time").to_csv(log(a), index=False),
    ),
    Case(
        "no complete row", never, "Take a column out of the map", lambda a, line: a.map["columns"].pop("joint_torque")
    ),
    Case("no map", lambda a: (csv_import(a), a.options.clear()), "--columns", option),
    Case("out exists", existing, "Choose another name", lambda a, line: setattr(a, "out", "another")),
    Case(
        "torque without gains",
        with_columns(columns={"feed_forward": ["force1", "force2"]}),
        "Name the column of kp in the map",
        columns(kp=["kp1", "kp2"]),
    ),
    Case(
        "gyro_unit",
        with_columns(angle_unit="turn", columns={"base_ang_vel": ["wx", "wy", "wz"]}),
        "gyro_unit: expected rad or deg.*state it",
        mapped(gyro_unit="deg"),
    ),
    Case(
        "quaternion's order",
        with_columns(quat_order="xyzw", columns={"base_quat": ["qw", "qx", "qy", "qz"]}),
        "quat_order",
        settings,
    ),
    Case("mm", with_columns(angle_unit="mm"), "0.001", millimetres),
    Case(
        "normalised",
        with_columns(angle_unit="normalised"),
        "span of the joint's calibration",
        lambda a, line: a.map.update(scale={"joint_pos": [0.5, 0.5], "joint_target": 0.5}, offset={"joint_pos": 0.1}),
    ),
    Case(
        "a state left out",
        with_columns(columns={"joint_pos": ["hip_pos", "_"]}),
        "names in the file, came '_'",
        columns(joint_pos=["hip_pos", "knee_pos"]),
    ),
    Case(
        "two orders",
        with_columns(columns=NAMES),
        "It names knee: use one order for all",
        columns(joint_pos=["hip_pos", "knee_pos"]),
    ),
    Case("a joint's name", with_columns(joints=["hip", "kneee"], options=("--model",)), "nearest is knee", nearest),
    Case(
        "another's joint",
        with_columns(joints=["hip", "zzz"], options=("--model",)),
        "It has hip, knee",
        lambda a, line: a.map.update(joints=re.search(r"It has (.*)\.$", line)[1].split(", ")),
    ),
    Case("a slide in rad", with_columns(SLIDE, ("--model",), angle_unit="rad"), "m for slides", units("rad", "m")),
    Case("a hinge in m", with_columns(HINGES, ("--model",), angle_unit="m"), "a list", units("rad", "rad")),
    Case(
        "no model of a passive joint",
        with_columns(PASSIVE, columns={"joint_target": ["hip_cmd", "_"]}),
        "--model",
        option,
    ),
    Case(
        "a driven joint's command",
        with_columns(HINGES, ("--model",), columns={"joint_target": ["hip_cmd", "_"]}),
        "Name it",
        columns(joint_target=["hip_cmd", "knee_cmd"]),
    ),
    Case("no model of a locked joint", with_columns(joints=["hip", "_"], locked=["knee"]), "Give it", option),
    Case("a driven joint out", with_columns(joints=["hip", "_"], options=("--model",)), "under locked", locked),
    Case("a dead motor", dead_motor, "kp 0 of knee", locked),
)
