"""An import that is refused, its printed remedy carried out to the letter, and the import again."""

import re
import sys
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd
import yaml

from bumblebee.errors import BadInput
from bumblebee.measured.importers import import_dataset

MODEL = """<mujoco><worldbody><body><joint name="hip" axis="0 1 0"/><geom size=".1" contype="0" conaffinity="0"/>
<body pos="0 0 -.3"><joint name="knee" KNEE/><geom size=".1" contype="0" conaffinity="0"/></body></body></worldbody>
<actuator><position joint="hip" kp="40" kv="2"/>ACTUATOR</actuator></mujoco>"""
HINGES = MODEL.replace("KNEE", 'axis="0 1 0"').replace("ACTUATOR", '<position joint="knee" kp="40" kv="2"/>')
PASSIVE = MODEL.replace("KNEE", 'axis="0 1 0"').replace("ACTUATOR", "")
SLIDE = MODEL.replace("KNEE", 'type="slide"').replace("ACTUATOR", '<position joint="knee" kp="40" kv="2"/>')


@dataclass
class Import:
    """Command and files of a user: `bumblebee import SOURCE OUT --kind KIND --columns MAP --model MODEL`."""

    folder: Path
    kind: str = "csv"
    map: dict[str, Any] = field(default_factory=dict)
    model: str = ""
    """MJCF; given only with the option --model."""
    options: set[str] = field(default_factory=lambda: {"--columns"})
    conditions: str = ""
    out: str = "out"

    @property
    def logs(self) -> Path:
        """The source, a folder."""
        made = self.folder / "logs"
        made.mkdir(exist_ok=True)
        return made

    def run(self) -> list[str]:
        """Ids of the rollouts."""
        logs = self.logs
        given: dict[str, Path | None] = {}
        texts = {"--model": self.model, "--columns": yaml.safe_dump(self.map), "--conditions": self.conditions}
        for (option, text), name in zip(texts.items(), ("model.xml", "map.yaml", "conditions.csv"), strict=True):
            (self.folder / name).write_text(text)
            given[option] = self.folder / name if option in self.options else None
        out = self.folder / self.out
        return import_dataset(logs, self.kind, out, given["--model"], given["--columns"], given["--conditions"])


@dataclass(frozen=True)
class Case:
    """One remedy."""

    name: str
    bad: Callable[[Import], None]
    """Makes the input."""
    line: str
    """Text of the refusal, a regular expression."""
    mend: Callable[[Import, str], None]
    """Does what the line says, and takes from it what to do."""


def settings(attempt: Import, line: str) -> None:
    """Put the first setting in back quotes into the map, beside what its key has; one "under `columns`" there."""
    said = [text for text in re.findall(r"`([^`]+)`", line) if re.fullmatch(r"\w+: .+", text)]
    setting = yaml.safe_load(said[0])
    if "under `columns`" in line:
        attempt.map["columns"] |= setting
    else:
        for key, value in setting.items():
            attempt.map[key] = attempt.map.get(key, {}) | value if isinstance(value, dict) else value


def table(rows: int = 100, hz: float = 50.0) -> pd.DataFrame:
    """A log of two joints in rad and s, with columns that a map may name."""
    time = np.arange(rows) / hz
    out = {"time": time}
    for k, joint in enumerate(("hip", "knee")):
        out[f"{joint}_pos"] = 0.5 * np.sin(3 * time + k)
        out[f"{joint}_cmd"] = 0.5 * np.sin(3 * time + k + 0.1)
    return pd.DataFrame(out)


def csv_import(attempt: Import, log: pd.DataFrame | None = None, **more: Any) -> None:
    """The log as CSV beside a map that reads it."""
    (table() if log is None else log).to_csv(attempt.logs / "log.csv", index=False)
    columns = {"joint_pos": ["hip_pos", "knee_pos"], "joint_target": ["hip_cmd", "knee_cmd"]}
    attempt.map = {"joints": ["hip", "knee"], "columns": columns} | more
    attempt.model = HINGES


@contextmanager
def recorded(sites: set[tuple[str, int]]):
    """Note file and line of every refusal with a remedy that is made meanwhile."""
    plain = BadInput.__init__

    def noting(self: BadInput, where: object, expected: str, came: str, do: str = "") -> None:
        frame = sys._getframe(1)
        if do:
            sites.add((frame.f_code.co_filename, frame.f_lineno))
        plain(self, where, expected, came, do)

    BadInput.__init__ = noting
    try:
        yield
    finally:
        BadInput.__init__ = plain


def walk(case: Case, folder: Path) -> tuple[str, list[str]]:
    """The refusal, and the ids of the rollouts after its remedy."""
    attempt = Import(folder)
    case.bad(attempt)
    try:
        attempt.run()
    except BadInput as error:
        line = str(error)
    else:
        raise AssertionError(f"{case.name}: not refused")
    assert re.search(case.line, line), f"{case.name}: {line}"
    assert not (folder / attempt.out / "rollouts").exists()
    case.mend(attempt, line)
    return line, attempt.run()


def model_of(text: str) -> mujoco.MjModel:
    """A model of MJCF."""
    return mujoco.MjModel.from_xml_string(text)
