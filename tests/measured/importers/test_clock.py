"""Stamps that are out of order or of another unit than the map says end an import, with the remedy."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.checks import check_rollout
from bumblebee.measured.importers import read_rollouts
from bumblebee.measured.rollout import Rollout
from tests.measured.simulated import arm_model, arm_rollout

NANOSECONDS = 1_700_000_000_000_000_000 + 20_000_000 * np.arange(30)


def read(folder: Path, stamps: np.ndarray, unit: str, more: str = "", head: str = "time,q,u") -> list[Rollout]:
    lines = [f"{stamp},0.1,0.2{',' + str(k // 15) if more else ''}" for k, stamp in enumerate(stamps.tolist())]
    (folder / "log.csv").write_text("\n".join([head, *lines]))
    (folder / "map.yaml").write_text(
        f"joints: [hip]\ntime_unit: {unit}\ncolumns: {{joint_pos: [q], joint_target: [u]}}\n{more}"
    )
    return read_rollouts(folder / "log.csv", "csv", column_map=folder / "map.yaml")


@pytest.mark.parametrize(
    ("stamps", "unit", "looks"),
    [
        (NANOSECONDS, "ms", "5e-05 Hz.*time_unit is ms: these look like `time_unit: ns` (50 Hz)"),
        (20.0 * np.arange(30), "s", "0.05 Hz.*time_unit is s: these look like `time_unit: ms` (50 Hz)"),
        (0.02 * np.arange(30), "us", "5e+07 Hz.*time_unit is us: these look like `time_unit: s` (50 Hz)"),
    ],
)
def test_a_unit_that_makes_the_rate_absurd_is_refused_and_the_likely_one_named(
    tmp_path: Path, stamps: np.ndarray, unit: str, looks: str
) -> None:
    with pytest.raises(BadInput, match=re.escape(looks).replace(r"\.\*", ".*")):
        read(tmp_path, stamps, unit)


def test_rows_out_of_order_are_refused_with_their_row_unless_episodes_tell_them_apart(tmp_path: Path) -> None:
    twice = np.tile(0.02 * np.arange(15), 2)
    with pytest.raises(BadInput, match=r"time, row 15: expected stamps that grow.*of one recording"):
        read(tmp_path, twice, "s")
    assert len(read(tmp_path, twice, "s", "episode: n\n", "time,q,u,n")) == 2


@pytest.mark.parametrize(("stamps", "unit"), [(NANOSECONDS, "ns"), (1.0 * np.arange(30), "s"), (np.arange(30), "ms")])
def test_usual_rates_pass(tmp_path: Path, stamps: np.ndarray, unit: str) -> None:
    assert len(read(tmp_path, stamps, unit)) == 1


@pytest.mark.parametrize(("pause", "fatal"), [(10.0, True), (0.5, True), (0.06, False)])
def test_a_long_pause_is_fatal_to_a_rollout_that_nobody_cuts(pause: float, fatal: bool) -> None:
    rollout = arm_rollout(0)
    late = np.where(np.arange(rollout.frames) < 100, 0.0, pause)
    (found,) = (
        f for f in check_rollout(replace(rollout, time=rollout.time + late), arm_model()) if f.rule == "time-gap"
    )
    assert found.fatal == fatal


def test_cells_without_a_number_name_the_setting_that_leaves_rows_out() -> None:
    rollout = arm_rollout(0)
    place = rollout.joint_pos.copy()
    place[7, 1] = np.nan
    (found,) = (f for f in check_rollout(replace(rollout, joint_pos=place), arm_model()) if f.rule == "finite")
    assert found.row == 7 and "`rows: complete`" in found.came
