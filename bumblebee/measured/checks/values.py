"""Checks of values: NaN, dead channels, steps that no joint can make, positions beyond the range."""

import mujoco
import numpy as np

from bumblebee.measured.checks.units import driven_joints
from bumblebee.measured.checks.view import View, integral
from bumblebee.measured.rollout import Rollout


def check_finite(view: View) -> None:
    """NaN and infinities, one finding a column."""
    for column in ("time", *view.rollout.columns):
        values = getattr(view.rollout, column)
        bad = ~np.isfinite(values.reshape(len(values), -1))
        if not bad.any():
            continue
        row = int(np.argmax(bad.any(axis=1)))
        place = int(np.argmax(bad[row]))
        per_joint = values.ndim == 2 and values.shape[1] == len(view.rollout.joints)
        name = view.label(column, place) if per_joint else column
        came = f"{values.reshape(len(values), -1)[row, place]} ({int(bad.sum())} such values)"
        if np.isnan(values).any():
            came += ": empty cells? `rows: complete` in the import's map leaves such rows out"
        view.add(name, row, "finite", "finite numbers", came, fatal=True)


def longest_run(same: np.ndarray) -> tuple[int, int]:
    """Start and length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(np.int8), [0]])))
    if len(edges) == 0:
        return 0, 0
    lengths = edges[1::2] - edges[::2]
    longest = int(np.argmax(lengths))
    return int(edges[2 * longest]), int(lengths[longest])


def check_frozen(view: View) -> None:
    """A channel whose reading stays exactly the same while its velocity, its neighbours or its command go on.

    A servo of low gain with dry friction stands for seconds while its command moves: that is what sticking looks like,
    and a person is told no more than that. Fatal is what no standing joint shows: a velocity that adds up to a way, a
    coupled joint that moves, a tracking error far beyond those at which this joint moves, all readings repeated.
    """
    rollout = view.rollout
    if view.found("degrees"):
        return
    need = view.lasting
    ranges = view.ranges()
    for joint in range(len(rollout.joints)):
        place = rollout.joint_pos[:, joint]
        at_stop = (place < ranges[joint, 0] + 0.02) | (place > ranges[joint, 1] - 0.02)
        start, length = longest_run((np.diff(place) == 0) & ~at_stop[1:])
        if length >= need:
            _judge_standing(view, joint, start, length)
        _check_frozen_rate(view, joint, need)
    _check_frozen_base(view, need)
    _check_repeated(view, need)


def _judge_standing(view: View, joint: int, start: int, length: int) -> None:
    """One joint's longest run of equal readings: nothing, sticking, or a dead channel."""
    rollout, limits = view.rollout, view.limits
    rows = slice(start, start + length + 1)
    moved = 0.0 if rollout.joint_target is None else float(np.ptp(rollout.joint_target[rows, joint]))
    speed = float(np.abs(rollout.joint_vel[rows, joint]).mean())
    travels = speed > limits.freeze_speed or _way(view, joint, rows) > limits.freeze_command
    coupled = _coupled_travel(view, joint, rows)
    if not (moved > limits.freeze_command or travels or coupled > limits.freeze_command):
        return
    came = f"{length + 1} equal rows; the command moved {moved:.3g} rad, joint_vel said {speed:.3g} rad/s"
    strained = moved > limits.freeze_command and _strain(rollout, joint, rows) > limits.freeze_strain
    dead = strained and not _may_stall(rollout.joint_pos[:, joint], start, length, limits.freeze_share)
    fatal = travels or coupled > limits.freeze_command or dead
    expected = "a reading that follows" if fatal else "a reading that follows, unless the joint sticks"
    view.add(view.label("joint_pos", joint), start, "frozen", expected, came, fatal=fatal)


def _way(view: View, joint: int, rows: slice) -> float:
    """The largest way [rad] that joint_vel says was gone within a second of some rows.

    Of a second at most: a coarse velocity that rests one step beside zero adds up to a way in a long standstill.
    """
    time, speed = view.rollout.time[rows], view.rollout.joint_vel[rows, joint]
    window = min(view.window(1.0), len(time) - 1)
    return float(np.abs(integral(time, speed, window)).max())


def _coupled_travel(view: View, joint: int, rows: slice) -> float:
    """How far [rad, m] a joint moved meanwhile that an equality of the model ties to this one; 0 for none."""
    model, ids = view.model, view.joint_ids()
    travel = 0.0
    for e in np.flatnonzero(model.eq_type == int(mujoco.mjtEq.mjEQ_JOINT)):
        pair = {int(model.eq_obj1id[e]), int(model.eq_obj2id[e])}
        for other in (k for k, i in enumerate(ids) if i in pair and ids[joint] in pair and k != joint):
            travel = max(travel, float(np.ptp(view.rollout.joint_pos[rows, other])))
    return travel


def _strain(rollout: Rollout, joint: int, rows: slice) -> float:
    """Largest tracking error in some rows by the usual largest one at which the joint moves elsewhere; 0 for none.

    A joint that sticks breaks away at errors of the size at which it then moves; a dead reading does not.
    """
    assert rollout.joint_target is not None
    error = np.abs(rollout.joint_target[:, joint] - rollout.joint_pos[:, joint])
    goes = np.concatenate([np.diff(rollout.joint_pos[:, joint]) != 0, [False]])
    goes[rows] = False
    usual = float(np.quantile(error[goes], 0.95)) if goes.any() else 0.0
    return float(error[rows].max()) / usual if usual > 0 else 0.0


def _check_repeated(view: View, need: int) -> None:
    """A logger that repeats all its readings, of several joints, while their commands go on.

    Coarse readings of joints that rest repeat themselves too: then they do so elsewhere as well.
    """
    rollout, limits = view.rollout, view.limits
    command = rollout.joint_target
    readings = [getattr(rollout, c) for c in rollout.columns if c not in ("joint_target", "joint_torque_cmd", "action")]
    same = np.logical_and.reduce([(np.diff(v, axis=0) == 0).reshape(len(v) - 1, -1).all(axis=1) for v in readings])
    start, length = longest_run(same)
    if length < need or command is None or len(rollout.joints) < 2 or _repeats(same, start, length):
        return
    moved = np.ptp(command[start : start + length + 1], axis=0) > limits.freeze_command
    if moved.sum() >= max(2, len(rollout.joints) / 2):
        came = f"{length + 1} rows with the same readings throughout, while the commands of {moved.sum()} joints moved"
        view.add("joint_pos", start, "frozen", "readings that are taken anew in every row", came, fatal=True)


def _may_stall(place: np.ndarray, start: int, length: int, share: float) -> bool:
    """Whether equal readings may be a stalled joint: a coarse encoder, equal elsewhere too, that moves again."""
    moves_again = start + length < len(place) - 1
    return _repeats(np.diff(place) == 0, start, length) and moves_again and length < share * len(place)


def _repeats(same: np.ndarray, start: int, length: int) -> bool:
    """Whether readings are the same as in the row before (T - 1,) outside a run, too."""
    outside = np.delete(same, np.s_[start : start + length])
    return bool(len(outside) and outside.mean() > 0.05)


def _check_frozen_rate(view: View, joint: int, need: int) -> None:
    rollout, limits = view.rollout, view.limits
    start, length = longest_run(np.diff(rollout.joint_vel[:, joint]) == 0)
    if length < need:
        return
    rows = slice(start, start + length + 1)
    travelled = np.ptp(rollout.joint_pos[rows, joint])
    seconds = rollout.time[start + length] - rollout.time[start]
    said = abs(float(rollout.joint_vel[start, joint])) * seconds
    if abs(travelled - said) > limits.freeze_command and abs(travelled - said) > 0.3 * max(travelled, said):
        came = f"{length + 1} equal rows in which the joint travelled {travelled:.3g} rad"
        never = length + 1 == rollout.frames
        expected = "a reading that follows" + " (or no joint_vel: an import makes it from joint_pos)" * never
        view.add(view.label("joint_vel", joint), start, "frozen", expected, came, fatal=True)


def check_silent(view: View) -> None:
    """Torques that are exactly 0 nearly always while their joint moves: told, since a free joint has none."""
    rollout, limits = view.rollout, view.limits
    driven = set(driven_joints(view.model))
    moves = np.abs(rollout.joint_vel) > limits.moving_speed
    for column in ("joint_torque", "joint_torque_cmd"):
        values = getattr(rollout, column)
        for joint, name in enumerate(rollout.joints) if values is not None else ():
            rows = moves[:, joint]
            if name not in driven or rows.sum() < view.lasting:
                continue
            silent = float((values[rows, joint] == 0).mean())
            if silent >= limits.silent_share:
                came = f"0 in {100 * silent:.0f} % of them"
                expected = "a torque in the rows in which the joint moves"
                view.add(view.label(column, joint), None, "silent", expected, came, fatal=False)


def _check_frozen_base(view: View, need: int) -> None:
    rollout = view.rollout
    for column in ("base_quat", "base_ang_vel", "base_lin_vel", "base_pos"):
        values = getattr(rollout, column)
        if values is None:
            continue
        start, length = longest_run((np.diff(values, axis=0) == 0).all(axis=1))
        moved = np.ptp(rollout.joint_pos[start : start + length + 1], axis=0).max()
        if length >= need and moved > 2 * view.limits.freeze_command:
            came = f"{length + 1} equal rows while a joint moved {moved:.3g} rad"
            view.add(column, start, "frozen", "a reading that changes as the robot moves", came, fatal=True)


def check_steps(view: View) -> None:
    """Jumps of joint_pos that neither joint_vel nor an impact between two rows explains."""
    rollout, limits = view.rollout, view.limits
    if view.found("degrees"):
        return
    times = np.diff(rollout.time)[:, None]
    jumps = np.abs(np.diff(rollout.joint_pos, axis=0))
    speed = np.abs(np.pad(rollout.joint_vel, ((1, 1), (0, 0)), mode="edge"))
    near = np.maximum.reduce([speed[:-3], speed[1:-2], speed[2:-1], speed[3:]])
    allowed = 1.5 * near * times + np.maximum(limits.step_floor, limits.step_speed * times)
    for joint in np.flatnonzero(((jumps > allowed) | (jumps > limits.speed_limit * times)).any(axis=0)):
        excess = jumps[:, joint] / np.minimum(allowed[:, joint], limits.speed_limit * times[:, 0])
        row = int(np.argmax(excess))
        size = jumps[row, joint]
        turn = ", a whole turn: the angle was wrapped" if abs(size - 2 * np.pi) < 0.3 else ""
        came = f"{size:.3g} rad in {times[row, 0]:.3g} s ({int((excess > 1).sum())} such steps){turn}"
        expected = f"at most {min(allowed[row, joint], limits.speed_limit * times[row, 0]):.3g} rad"
        view.add(view.label("joint_pos", joint), row + 1, "step", expected, came, fatal=True)


def check_range(view: View) -> None:
    """Positions beyond the model's range."""
    limits, ranges, place = view.limits, view.ranges(), view.rollout.joint_pos
    if view.found("degrees", "joint_pos"):
        return
    excess = np.maximum(ranges[:, 0] - place, place - ranges[:, 1])
    held = max(3, round(0.5 / view.period))
    for joint in range(excess.shape[1]):
        start, length = longest_run(excess[:, joint] > limits.range_held)
        row = int(np.argmax(excess[:, joint]))
        if excess[row, joint] <= limits.range_brief and length < held:
            continue
        low, high = ranges[joint]
        expected = f"within the model's range {low:.4g} to {high:.4g}"
        came = f"{place[row, joint]:.4g} (beyond it for {length} rows from row {start})"
        fatal = excess[row, joint] > limits.range_fatal
        view.add(view.label("joint_pos", joint), row, "range", expected, came, fatal=fatal)
