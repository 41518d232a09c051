"""The benchmark of the store does in both layouts what its rows say."""

from pathlib import Path

import pytest
from dvc.repo import Repo

from benchmarks import motion_store as bench
from bumblebee.motion.store import Library


@pytest.mark.parametrize("layout", bench.LAYOUTS)
def test_each_step_does_what_it_is_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, layout: str) -> None:
    monkeypatch.setattr(bench, "KINDS", 2)
    Repo.init(str(tmp_path), no_scm=True).close()
    folder = tmp_path / "lib"
    bench.step(layout, "write", folder, 4)
    assert len(Library(folder)) == 4
    before = bench.dvc_hash(folder)
    for step in ("open", "iterate", "two_processes", "random", "append", "change"):
        bench.step(layout, step, folder, 4)
    library = Library(folder)
    assert len(library) == 5 and library.index["frames"].eq(bench.FRAMES).all()
    assert [clip.name for clip in library] == library.names
    assert bench.dvc_hash(folder) != before


def test_the_table_has_both_layouts_side_by_side() -> None:
    rows = [
        {"motions": 10, "step": "iterate", "layout": layout, "s": 9, "cpu_s": seconds, "peak_mb": 100}
        for layout, seconds in zip(bench.LAYOUTS, (6.0, 2.0), strict=True)
    ]
    assert bench.table(rows).splitlines()[-1] == "| 10 | iterate | 9 | 6 | 100 | 9 | 2 | 100 | 3 |"
