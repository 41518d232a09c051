"""The metadata's conditions: what is kept, what is refused in one line, and how a table brings them in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.conditions import stated_conditions
from bumblebee.measured.importers.dataset import import_dataset
from bumblebee.measured.rollout import Rollout, read_rollout, write_rollout

ZEROS = np.zeros((20, 2))
PLAIN = Rollout("r", ("hip", "knee"), 50.0, np.arange(20) / 50, ZEROS, ZEROS, joint_target=ZEROS)
LOAD = {"body": "shank", "kg": 0.4, "position": [0, 0, -0.2]}
KEPT = {
    "added_mass": [LOAD, LOAD | {"body": "thigh", "kg": 1}],
    "supply_voltage": 23.5,
    "temperature": -4,
    "heading": 1.2,
    "surface": "carpet",
    "operator's mood": "good",
    "gain": 400,
}
REFUSED = {
    "a list": [1],
    "a number for a load": {"added_mass": 0.4},
    "a load without a place": {"added_mass": [{"body": "shank", "kg": 0.4}]},
    "a load that pulls up": {"added_mass": [LOAD | {"kg": -1}]},
    "a load at infinity": {"added_mass": [LOAD | {"position": [0, 0, 1e300]}]},
    "a load of too many numbers": {"added_mass": [LOAD | {"position": [0, 0, 0, 0]}]},
    "no voltage": {"supply_voltage": 0},
    "voltage as text": {"supply_voltage": "24 V"},
    "colder than cold": {"temperature": -300},
    "a heading of a truth": {"heading": True},
    "a surface of a number": {"surface": 3},
    "a name that the command line cannot say": {"a=b": 1},
    "gains in the wrong place": {"kp": 3},
    "a list for a label": {"gain": [1, 2]},
    "a label of nothing": {"gain": ""},
    "a name of control signs": {"a\x1b[2J": 1},
    "too many": {f"n{k}": k for k in range(65)},
    "a long story": {"story": "x" * 1000},
}


def test_conditions_are_written_and_read_as_they_are(tmp_path: Path) -> None:
    write_rollout(tmp_path / "r.parquet", replace(PLAIN, meta={"conditions": KEPT, "kp": [4.0, 4.0], "kd": [1.0, 2.0]}))
    back = read_rollout(tmp_path / "r.parquet")
    assert back.meta["conditions"] == KEPT
    said = stated_conditions(back.meta, back.joints)
    assert said["kp"] == 4.0 and said["kd[knee]"] == 2.0 and "kd" not in said
    assert said["added_mass"] == 1.4 and said["added_mass[shank]"] == 0.4
    assert (said["surface"], said["gain"]) == ("carpet", 400.0)


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_condition_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(BadInput, match="conditions") as error:
        write_rollout(tmp_path / "r.parquet", replace(PLAIN, meta={"conditions": REFUSED[name]}))
    assert "\n" not in str(error.value) and "\x1b" not in str(error.value) and len(str(error.value)) < 500
    assert not list(tmp_path.iterdir())


def logs(folder: Path) -> None:
    """Two logs of one joint, of which the second ends switched off, and a table of what was different."""
    folder.mkdir()
    rows = [f"{k / 50},{k},{0.1 * k},{0.2 * k},{int(k < 30)}" for k in range(40)]
    (folder / "low.csv").write_text("\n".join(["t,n,goal,place,powered", *rows]))
    (folder / "high.csv").write_text("\n".join(["t,n,goal,place,powered", *rows]))
    (folder / "what.csv").write_text("log,register,payload,floor\nlow.csv,100,,tiles\nhigh.csv,800,0.5,tiles\n")


MAP = "joints: [hip]\ntime: t\nvalid: powered\ncolumns: {joint_pos: place, joint_target: goal}\n"
TABLE = """table: what.csv
log: log
values:
  gain: register
  kp: {column: register, scale: 0.002}
  kd[hip]: {column: register, scale: 0.0}
  surface: floor
  added_mass: {column: payload, body: shank, position: [0, 0, -0.2]}
"""


def brought(tmp_path: Path, table: str, name: str = "table.yaml") -> dict[str, Rollout]:
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / name).write_text(table)
    ids = import_dataset(tmp_path / "logs", "csv", tmp_path / "out", None, tmp_path / "map.yaml", tmp_path / name)
    return {name: read_rollout(tmp_path / "out" / "rollouts" / f"{name}.parquet") for name in ids}


def test_a_table_beside_the_logs_brings_gains_loads_and_labels(tmp_path: Path) -> None:
    logs(tmp_path / "logs")
    found = brought(tmp_path, TABLE)
    assert set(found) == {"low", "high"}  # the table is no log
    assert found["low"].meta["kp"] == [0.2] and found["high"].meta["kp"] == [1.6]
    assert found["high"].meta["kd"] == [0.0]
    assert found["low"].meta["conditions"] == {"gain": 100.0, "surface": "tiles"}
    assert found["high"].meta["conditions"]["added_mass"] == [LOAD | {"kg": 0.5}]
    assert found["low"].frames == 30  # rows after it was switched off do not count


def test_a_csv_alone_names_conditions_by_its_header(tmp_path: Path) -> None:
    logs(tmp_path / "logs")
    (tmp_path / "logs" / "what.csv").unlink()
    found = brought(tmp_path, "log,kp,supply_voltage,weather\nlow,0.2,7.4,\nhigh,1.6,7.1,rain\n", "table.csv")
    assert found["low"].meta["conditions"] == {"supply_voltage": 7.4}
    assert found["high"].meta["conditions"] == {"supply_voltage": 7.1, "weather": "rain"}
    assert found["high"].meta["kp"] == [1.6]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("register", "registry"), "the column registry"),
        (("surface: floor", "surface: register"), "surface"),
        (("table: what.csv", "table: gone.csv"), "gone.csv"),
        (("body: shank, ", ""), "body"),
        (("kd[hip]", "kd[ankle]"), "ankle"),
        (("gain: register", "gain: [register]"), "gain"),
        (("scale: 0.002", "scale: fast"), "scale"),
        (("log: log\n", ""), "table, log and values"),
    ],
)
def test_a_table_that_does_not_fit_is_refused_in_one_line(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    logs(tmp_path / "logs")
    with pytest.raises(BadInput, match=says) as error:
        brought(tmp_path, TABLE.replace(*change))
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("low,1\n", "a row for high"),
        ("low,1\nhigh,1\nhigh,2\n", "every log once"),
        ("low,1\nhigh,1\nmiddle,1\n", "middle"),
    ],
)
def test_every_log_has_a_row_and_every_row_a_log(tmp_path: Path, rows: str, says: str) -> None:
    logs(tmp_path / "logs")
    (tmp_path / "logs" / "what.csv").unlink()
    with pytest.raises(BadInput, match=says):
        brought(tmp_path, f"log,gain\n{rows}", "table.csv")
