"""One wrong convention of a whole logger ends a diagnosis in one line; faults of single recordings do not."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bumblebee.diagnosis.dataset import Session, open_session
from bumblebee.diagnosis.quick import first_look, told
from bumblebee.diagnosis.thresholds.dataset import Conventions, DatasetThresholds
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout, write_rollout
from tests.commands.conftest import run
from tests.diagnosis import arm
from tests.diagnosis.test_catalogue import CONFIG


@cache
def good(count: int, still: int | None = None) -> list[Rollout]:
    """Rollouts of the arm, with a joint that is never moved if one is named."""
    name = "moving" if still is None else "resting"
    made = arm.simulate({}, count=count, seconds=6.0, seed=2, still=still)
    # A joint at rest keeps its encoder's noise.
    rng = np.random.default_rng(0)
    made = [replace(r, joint_pos=r.joint_pos + 1e-4 * rng.standard_normal(r.joint_pos.shape)) for r in made]
    return [replace(r, rollout_id=f"{name}{k}") for k, r in enumerate(made)]


def reversed_targets(rollouts: Sequence[Rollout]) -> list[Rollout]:
    return [replace(r, rollout_id=f"bad{k}", joint_target=r.joint_target * [1, -1, 1]) for k, r in enumerate(rollouts)]


def session(folder: Path, rollouts: Sequence[Rollout], rule: Conventions | None = None, xml: str = arm.XML) -> Session:
    for rollout in rollouts:
        write_rollout(folder / "set" / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
    (folder / "model.xml").write_text(xml)
    rules = DatasetThresholds() if rule is None else DatasetThresholds(conventions=rule)
    return open_session(folder / "model.xml", folder / "set", rules)


def test_a_sign_that_is_wrong_throughout_is_one_line_with_its_remedy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BadInput, match=r"rule response-sign: .* on j2 in 4 of 4 rollouts .* scale of the command"):
        session(tmp_path, reversed_targets(good(4)))
    before = sorted(tmp_path.rglob("*"))
    for options in (("--quick",), ("--out", tmp_path / "out")):
        assert run("diagnose", tmp_path / "model.xml", tmp_path / "set", *options) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_rollouts_in_which_the_joint_rests_do_not_save_a_wrong_convention(tmp_path: Path) -> None:
    """The two that pass have the reversed sign, too: what is fitted to them is no effect of the robot."""
    rollouts = [*reversed_targets(good(4)), *good(2, still=1)]
    with pytest.raises(BadInput, match=r"rule response-sign: .* on j2 in 4 of 6 rollouts"):
        session(tmp_path, rollouts)
    assert len(session(tmp_path / "again", rollouts, Conventions(share=0.9)).rollouts) == 2


def test_rollouts_in_which_the_joint_follows_its_command_speak_against_it(tmp_path: Path) -> None:
    """Another logger's: the others are used, and nobody can overlook that most are not."""
    made = session(tmp_path, [*reversed_targets(good(4)), *good(2)])
    assert [r.rollout_id for r in made.rollouts] == ["moving0", "moving1"]
    (warning,) = made.warnings
    assert "4 of 6 rollouts were set aside by rule response-sign on j2" in warning and "scale" in warning
    assert f"WARNING: {warning}" in told(first_look(made, CONFIG), "")


def test_a_few_reversed_rollouts_are_set_aside_as_ever(tmp_path: Path) -> None:
    made = session(tmp_path, [*reversed_targets(good(4)[:2]), *good(4)[2:]])
    assert len(made.rollouts) == 2 and len(made.set_aside) == 2 and not made.warnings


def test_faults_of_single_recordings_are_set_aside_however_many(tmp_path: Path) -> None:
    """A channel that is dead in most rollouts says nothing about those in which it is not."""
    rollouts = good(6)
    for rollout in rollouts[:4]:
        dead = rollout.joint_pos.copy()
        dead[30:, 1] = dead[30, 1]
        rollouts = [replace(r, joint_pos=dead) if r is rollout else r for r in rollouts]
    made = session(tmp_path, rollouts)
    assert len(made.rollouts) == 2 and len(made.set_aside) == 4 and not made.warnings


def test_a_range_that_most_rollouts_leave_spoils_no_others(tmp_path: Path) -> None:
    """Another zero, or a wrong range in the model: nothing of it is in those that stay within."""
    away = np.array([0.0, 4.0, 0.0])
    rollouts = [replace(r, joint_pos=r.joint_pos + away, joint_target=r.joint_target + away) for r in good(4)]
    xml = arm.XML.replace('<joint name="j2"', '<joint name="j2" range="-2.5 2.5" limited="true"')
    made = session(tmp_path, [*rollouts, *good(2, still=1)], xml=xml)
    assert len(made.rollouts) == 2
    assert "rule range on j2" in made.warnings[0] and "offset of joint_pos" in made.warnings[0]


def test_velocities_of_another_size_are_told_where_all_have_them(tmp_path: Path) -> None:
    """Where some fail by another rule, nothing is common to all, and the first reason ends it as ever."""
    large = [replace(r, joint_vel=5 * r.joint_vel) for r in good(4)]
    with pytest.raises(BadInput, match=r"rule velocity-derivative: .* in 4 of 4 rollouts .* leave joint_vel out"):
        session(tmp_path, large)
    broken = good(4)[3].joint_pos.copy()
    broken[7] = np.nan
    with pytest.raises(BadInput, match=r"^moving0\.parquet: column joint_vel"):
        session(tmp_path / "some", [*large[:3], replace(good(4)[3], joint_pos=broken)])


def test_degrees_of_all_joints_name_the_unit(tmp_path: Path) -> None:
    xml = arm.XML.replace('axis="0 1 0"', 'axis="0 1 0" range="-2.5 2.5" limited="true"')
    turned = [
        replace(r, **{c: np.degrees(getattr(r, c)) for c in ("joint_pos", "joint_vel", "joint_target")})
        for r in good(4)
    ]
    with pytest.raises(BadInput, match=r"rule degrees: .* in 4 of 4 rollouts .* angle_unit to deg"):
        session(tmp_path, turned, xml=xml)
    rates = [replace(r, joint_vel=np.degrees(r.joint_vel)) for r in good(4)]
    with pytest.raises(BadInput, match=r"rule degrees: .* scale of joint_vel to 0\.01745"):
        session(tmp_path / "rates", rates, xml=xml)


def test_copies_of_the_positions_end_it_unless_commands_are_seen_elsewhere(tmp_path: Path) -> None:
    """Rollouts in which nothing moves say nothing for the targets; commands that positions follow do."""
    copies = [replace(r, rollout_id=f"bad{k}", joint_target=r.joint_pos) for k, r in enumerate(good(4))]
    rest = np.tile(copies[0].joint_pos[:1], (copies[0].frames, 1))
    stands = replace(copies[0], rollout_id="stands", joint_pos=rest, joint_target=rest, joint_vel=0 * rest)
    with pytest.raises(BadInput, match=r"rule target-copy: .* on j1, j2, j3 in 4 of 5 .* the same row.*--set targets"):
        session(tmp_path, [*copies, stands])
    made = session(tmp_path / "some", [*copies, *good(2)])
    assert [r.rollout_id for r in made.rollouts] == ["moving0", "moving1"]
    assert "4 of 6 rollouts were set aside by rule target-copy" in made.warnings[0] and "Log the" in made.warnings[0]
