"""Curves of trainings beside each other: when a level was reached, and what cannot be read."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.learning_curves import draw, reached, read, table
from bumblebee.errors import BadInput


def curve(folder: Path, rows: int = 100) -> Path:
    """Half a minute before the first iteration, then one a second: success falls with the threshold and rises."""
    share = np.arange(rows) / rows
    loose = share < 0.4
    success = np.where(loose, 0.9, share)
    columns = {"iteration": np.arange(rows) + 1, "seconds": 30.0 + np.arange(rows), "success": success}
    columns |= {"key_error": 0.1 - 0.08 * share, "threshold": np.where(loose, 0.8, 0.35)}
    folder.mkdir()
    pd.DataFrame(columns).to_csv(folder / "curve.csv", index=False)
    return folder


def test_a_success_at_a_looser_threshold_does_not_count_as_reached(tmp_path: Path) -> None:
    success, near = reached(read(curve(tmp_path / "a")), 0.7, 60.0)
    assert success == pytest.approx((30 + 75) / 60, abs=0.02)  # the mean of ten lags by 4.5; .9 at first does not count
    assert near == pytest.approx((30 + 55) / 60, abs=0.02)
    assert reached(read(tmp_path / "a"), 1.0, 1.0) == (None, None)


def test_the_table_says_how_long_the_first_iteration_took_and_the_picture_is_the_same_each_time(tmp_path: Path) -> None:
    curves = {"PPO, seed 0": read(curve(tmp_path / "a")), "PPO, seed 1": read(curve(tmp_path / "b", 60))}
    assert "| PPO, seed 0 | 0.5 min | " in table(curves, 0.7, 60.0)
    pictures = []
    for name in ("one.svg", "two.svg"):
        draw(curves, tmp_path / name)
        pictures.append((tmp_path / name).read_bytes())
    assert pictures[0] == pictures[1] and b"PPO, seed 1" in pictures[0]


def test_a_folder_without_a_curve_or_with_another_one_is_a_line(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such file"):
        read(tmp_path)
    (tmp_path / "curve.csv").write_text("iteration,seconds\n1,2\n")
    with pytest.raises(BadInput, match="no success, key_error, threshold"):
        read(tmp_path)
