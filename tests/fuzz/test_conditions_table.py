"""Tables of conditions beside logs, with bytes and values that nobody meant: rollouts, or one line of `BadInput`."""

from pathlib import Path

import numpy as np
import pytest

from bumblebee.measured.importers.conditions_table import read_conditions, with_conditions
from bumblebee.measured.importers.source import open_source
from tests.fuzz.budget import rounds
from tests.fuzz.test_measured import check, mutated
from tests.measured.simulated import arm_rollout

TABLE = b"log,kp,kd[j1],supply_voltage,motion,load\nr00,20,0.5,7.4,swing,0.1\nr01,,1,,,0.2\n"
MAP = b"""table: table.csv
log: log
values:
  gain: kp
  kp: {column: kp, scale: 0.002}
  supply_voltage: supply_voltage
  added_mass: {column: load, body: arm, position: [0, 0, -0.1]}
"""


def both(place: Path, name: str) -> None:
    """Read the table and say it of two rollouts."""
    rollout = arm_rollout(0, seconds=1.2)
    table = read_conditions(place / name, open_source(place))
    with_conditions([type(rollout)(**{**vars(rollout), "rollout_id": name}) for name in ("r00", "r01")], table)


@pytest.mark.parametrize("name", ["table.csv", "map.yaml"])
def test_odd_tables_of_conditions_are_read_or_one_line(tmp_path: Path, name: str) -> None:
    for number in rounds(0.15):
        (tmp_path / "table.csv").write_bytes(TABLE)
        (tmp_path / "map.yaml").write_bytes(MAP)
        good = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(mutated(np.random.default_rng(number), good))
        check(number, tmp_path, lambda: both(tmp_path, name))
