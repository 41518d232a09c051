"""Every corruption of an arm's rollout is found, by its rule and in its column; good rollouts raise nothing."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.measured.checks import check_rollout
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.usable import review
from tests.measured.checks.changes import Change, edit, fatal_rules, findings, model_of, put, scale
from tests.measured.simulated import arm_model, arm_rollout, g1_rollout


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("kind", "hz"), [("position", 50.0), ("motor", 50.0), ("position", 500.0), ("motor", 250.0)])
def test_a_good_arm_raises_nothing_at_any_rate(seed: int, kind: str, hz: float) -> None:
    assert findings(arm_rollout(seed, kind, size=(0.3, 0.8, 1.5)[seed % 3], hz=hz)) == []


@pytest.mark.parametrize("seed", range(3))
def test_a_good_arm_at_rest_raises_nothing(seed: int) -> None:
    assert findings(arm_rollout(seed, size=0.0)) == []


def swap(*columns: str) -> Change:
    def apply(rollout: Rollout) -> Rollout:
        return replace(rollout, **{column: getattr(rollout, column)[:, [1, 0, 2]] for column in columns})

    return apply


def freeze(column: str, joint: int) -> Change:
    def change(values: np.ndarray) -> None:
        values[60:, joint] = values[60, joint]

    return edit(column, change)


def flip_joint(rollout: Rollout) -> Rollout:
    return scale("joint_pos", -1, 1)(scale("joint_vel", -1, 1)(rollout))


def drop(rows: slice) -> Change:
    def apply(rollout: Rollout) -> Rollout:
        keep = np.delete(np.arange(rollout.frames), rows)
        return replace(rollout, time=rollout.time[keep], **{c: getattr(rollout, c)[keep] for c in rollout.columns})

    return apply


def shake(rollout: Rollout) -> Rollout:
    rng = np.random.default_rng(0)
    return replace(rollout, time=np.sort(rng.uniform(rollout.time[0], rollout.time[-1], rollout.frames)))


ARM_CHANGES: dict[str, tuple[Change, str, str]] = {
    "gap": (drop(slice(100, 130)), "time-gap", "time"),
    "duplicate": (edit("time", lambda t: t.__setitem__(50, t[49])), "time-duplicate", "time"),
    "backwards": (edit("time", lambda t: t.__setitem__(50, t[40])), "time-order", "time"),
    "milliseconds": (lambda r: replace(r, time=r.time * 1e3), "rate", "time"),
    "other rate": (lambda r: replace(r, control_hz=100.0), "rate", "time"),
    "jitter": (shake, "time-", "time"),
    "time nan": (edit("time", put(7, np.nan)), "finite", "time"),
    "nan": (edit("joint_pos", put((9, 1), np.nan)), "finite", "joint_pos[elbow]"),
    "inf": (edit("joint_target", put((9, 1), np.inf)), "finite", "joint_target[elbow]"),
    "frozen position": (freeze("joint_pos", 1), "frozen", "joint_pos[elbow]"),
    "frozen velocity": (freeze("joint_vel", 1), "frozen", "joint_vel[elbow]"),
    "spike": (edit("joint_pos", lambda q: q.__setitem__((80, 1), q[80, 1] + 0.5)), "step", "joint_pos[elbow]"),
    "wrapped": (
        edit("joint_pos", lambda q: q.__setitem__((slice(80, None), 2), q[80:, 2] + 6.283)),
        "step",
        "joint_pos",
    ),
    "out of range": (edit("joint_pos", lambda q: q.__setitem__((..., 1), q[:, 1] + 2.4)), "range", "joint_pos[elbow]"),
    "degrees": (scale("joint_pos", 180 / np.pi), "degrees", "joint_pos"),
    "all in degrees": (
        lambda r: scale("joint_pos", 57.3)(scale("joint_vel", 57.3)(scale("joint_target", 57.3)(r))),
        "degrees",
        "joint_pos",
    ),
    "target in degrees": (scale("joint_target", 180 / np.pi), "degrees", "joint_target"),
    "velocity in degrees": (scale("joint_vel", 180 / np.pi), "degrees", "joint_vel"),
    "velocity reversed": (scale("joint_vel", -1, 1), "velocity-sign", "joint_vel[elbow]"),
    "velocity of another joint": (swap("joint_vel"), "velocity-", "joint_vel"),
    "velocity too large": (scale("joint_vel", 10, 1), "velocity-derivative", "joint_vel[elbow]"),
    "targets exchanged": (swap("joint_target"), "joint-order", "joint_pos"),
    "joint reversed": (flip_joint, "response-sign", "joint_target[elbow]"),
    "target reversed": (scale("joint_target", -1, 1), "response-sign", "joint_target[elbow]"),
    "unknown joint": (lambda r: replace(r, joints=("shoulder", "elbov", "wrist")), "joint-names", "joints"),
    "gains of another unit": (lambda r: replace(r, meta=r.meta | {"kp": [40.0, 6000.0, 40.0]}), "gains", "kp[elbow]"),
    "negative gains": (lambda r: replace(r, meta=r.meta | {"kd": [2.0, 2.0, -2.0]}), "gains", "kd[wrist]"),
}


@pytest.mark.parametrize("seed", [0, 1, 4])
@pytest.mark.parametrize("name", ARM_CHANGES)
def test_each_corruption_of_an_arm_is_found_in_its_column(name: str, seed: int) -> None:
    change, rule, column = ARM_CHANGES[name]
    found = fatal_rules(change(arm_rollout(seed)))
    assert any(broken.startswith(rule) and place.startswith(column) for broken, place in found), found


def test_a_velocity_that_was_never_logged_is_told_how_to_come_by_one() -> None:
    """A driver that fills the column with zeros; one that stops amid a log needs other advice."""
    never, stopped = (
        [f.expected for f in findings(change(arm_rollout(0))) if (f.rule, f.column) == ("frozen", "joint_vel[elbow]")]
        for change in (scale("joint_vel", 0.0), freeze("joint_vel", 1))
    )
    assert never == ["a reading that follows (or no joint_vel: an import makes it from joint_pos)"]
    assert stopped == ["a reading that follows"]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("joint", [0, 1])
def test_a_reversed_torque_or_joint_is_found(seed: int, joint: int) -> None:
    rollout = arm_rollout(seed, "motor", seconds=10.0)
    for broken in (
        scale("joint_torque_cmd", -1, joint)(rollout),
        scale("joint_pos", -1, joint)(scale("joint_vel", -1, joint)(rollout)),
    ):
        assert any(rule == "response-sign" for rule, _ in fatal_rules(broken))


def test_a_slightly_wrong_clock_and_a_lost_tick_are_warnings() -> None:
    rollout = arm_rollout(0)
    for change, rule in ((drop(slice(100, 102)), "time-gap"), (lambda r: replace(r, control_hz=52.0), "rate")):
        found = findings(change(rollout))
        assert [(finding.rule, finding.fatal) for finding in found] == [(rule, False)]


def test_joints_are_held_against_the_deployed_policy() -> None:
    rollout = arm_rollout(0)
    assert findings(rollout, {"joints": list(rollout.joints)}) == []
    for joints in (["elbow", "shoulder", "wrist"], ["shoulder", "elbow"]):
        assert [finding.rule for finding in findings(rollout, {"joints": joints})] == ["policy-joints"]
    gains = {"joints": list(rollout.joints), "kp": [40.0, 40.0, 41.0], "kd": [2.0] * 3}
    assert [finding.column for finding in findings(rollout, gains)] == ["kp[wrist]"]


def test_a_finding_is_one_line_that_names_file_column_row_and_rule() -> None:
    bad = edit("joint_pos", put((9, 1), np.nan))(arm_rollout(0))
    (finding,) = check_rollout(bad, arm_model(), file="x.parquet")
    for part in ("x.parquet", "joint_pos[elbow]", "row 9", "rule finite", "expected", "nan"):
        assert part in finding.message
    assert "\n" not in finding.message and finding.row == 9


def test_a_joint_that_is_missing_from_the_log_is_fatal() -> None:
    """No simulation can start from such a row."""
    rollout = arm_rollout(0)
    part = {column: getattr(rollout, column)[:, :2] for column in rollout.columns}
    found = findings(replace(rollout, joints=rollout.joints[:2], meta={}, **part))
    assert [(finding.rule, finding.fatal) for finding in found] == [("joint-missing", True)]


@pytest.mark.parametrize("ticks", [1, 2, 3, 5])
@pytest.mark.parametrize("seed", range(3))
def test_a_robot_that_answers_late_or_weakly_is_no_bad_file(seed: int, ticks: int) -> None:
    """Delay and encoder offset are effects for the diagnosis to find, not faults of the log."""
    for rollout in (arm_rollout(seed), arm_rollout(seed, "motor", size=0.5), g1_rollout(seed, 0.3)):
        command = "joint_target" if rollout.joint_target is not None else "joint_torque_cmd"
        early = np.roll(getattr(rollout, command), -ticks, axis=0)
        early[-ticks:] = early[-ticks - 1]
        late = replace(rollout, **{command: early}, joint_pos=rollout.joint_pos + 0.04)
        assert [finding.message for finding in findings(late)] == []


@pytest.mark.parametrize(("drift", "fatal"), [(0.03, False), (0.5, True)])
def test_a_clock_that_drifts_is_found(drift: float, fatal: bool) -> None:
    rollout = arm_rollout(0, size=0.8)
    slower = rollout.time + 0.5 * drift * (rollout.time - rollout.time[0]) ** 2 / rollout.duration
    found = [f for f in findings(replace(rollout, time=slower)) if f.rule == "time-drift"]
    assert [(f.column, f.fatal) for f in found] == [("time", fatal)]


def test_a_review_names_file_column_row_and_rule() -> None:
    rollout = arm_rollout(0, size=0.8)
    place = rollout.joint_pos.copy()
    place[7, 0] = np.inf
    refused = review(replace(rollout, joint_pos=place), model_of(rollout), "run7.parquet").refused
    assert str(refused).startswith(f"run7.parquet: column joint_pos[{rollout.joints[0]}], row 7: rule finite")
    good = review(rollout, model_of(rollout))
    assert good.refused is None and good.warnings == []
