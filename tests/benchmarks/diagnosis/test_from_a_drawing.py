"""Robots from drawings: what is declared lacks rotors and friction, what is true has them, and the table counts."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.from_a_drawing import arms, humanoid
from benchmarks.from_a_drawing.__main__ import brief, main
from benchmarks.from_a_drawing.case import Case
from benchmarks.from_a_drawing.table import HORIZONS, table


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    return [arms.case(3), humanoid.case(0, "stand", None), humanoid.case(2, "stand", None)]


def test_the_declared_model_lacks_what_the_robot_has(cases: list[Case]) -> None:
    for case in cases:
        model, joints = case.session.plant.model, case.session.plant.joints
        dofs = [int(model.joint(name).dofadr[0]) for name in joints]
        assert not model.dof_frictionloss[dofs].any() and not model.dof_damping[dofs].any()
        assert model.dof_armature[dofs].any() == case.row.get("rotors", False)
        for sizes in case.sizes.values():
            assert set(sizes) == set(joints) and min(sizes.values()) > 0
    assert [case.row["robot"] for case in cases] == ["arm", "stand", "stand"]


def test_the_same_seed_is_the_same_robot(cases: list[Case]) -> None:
    again = humanoid.case(0, "stand", None)
    assert again.sizes == cases[1].sizes and again.row == cases[1].row
    for one, other in zip(again.session.rollouts, cases[1].session.rollouts, strict=True):
        assert np.array_equal(one.joint_pos, other.joint_pos)


def _row(seed: int, after: float, armature: float) -> dict:
    errors = {h: [0.03, after, 0.001] for h in HORIZONS}
    sizes = {"armature": [armature, 0.0], "coulomb_friction": [0.1, -0.1]}
    row = {"robot": "stand", "seed": seed, "joints": 2, "more": "a load", "errors": errors, "sizes": sizes}
    return row | {"seconds": 10.0 + seed}


def test_the_table_counts_what_was_found() -> None:
    fell = {"robot": "track", "seed": 2, "failed": "BadInput: no rollouts"}
    text = table([_row(0, 0.0015, 0.5), _row(1, 0.01, 0.05), fell])
    assert "stand, 2 diagnosed, 0 failed" in text and "2 with a load more" in text
    assert "track: 1 failed, none diagnosed" in text and brief(fell) == "track 2: BadInput: no rollouts"
    assert "largest corrected 10; within 2 times the noise 50 %" in text
    assert "armature within 15%: 75 %" in text and "coulomb_friction within 15%: 100 %" in text
    assert "most 11" in text
    assert brief(_row(0, 0.0015, 0.5)).startswith("stand 0: 2 joints, a load: 0.2 s 30 1.5 1")


@pytest.mark.parametrize(("given", "came"), [([], "none came"), (["--policy", "nowhere"], "none in nowhere")])
def test_a_robot_that_tracks_needs_a_policy(
    capsys: pytest.CaptureFixture[str], given: list[str], came: str, tmp_path: Path
) -> None:
    """Before anything is run: a robot that failed for it would be a row of the results."""
    out = tmp_path / "results.jsonl"
    with pytest.raises(SystemExit) as stopped:
        main(["--robot", "track", "--out", str(out), *given])
    assert stopped.value.code == 2 and not out.exists()
    assert came in capsys.readouterr().err
