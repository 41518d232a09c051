"""Checks of a floating base: quaternion norm and order, frames and units of the base's velocities."""

import numpy as np

from bumblebee.measured.checks.stance import check_stance
from bumblebee.measured.checks.view import View, integral
from bumblebee.quaternions import conjugate, multiply_by_cross, rotate_by_cross, rotation_vector

TURN_SECONDS = (0.2, 0.5, 1.0)  # the slower the base turns, the longer until it stands out of the noise


def check_base(view: View) -> None:
    """All checks of the base's columns that are there."""
    quat = view.rollout.base_quat
    if quat is None or not _check_norm(view, quat):
        return
    quat = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    if view.rollout.base_ang_vel is not None:
        _check_turning(view, quat)
    if view.rollout.base_lin_vel is not None and not view.found("quaternion-order"):
        if view.rollout.base_pos is not None:
            _check_travel(view, quat)
        else:
            check_stance(view, quat)


def _check_norm(view: View, quat: np.ndarray) -> bool:
    error = np.abs(np.linalg.norm(quat, axis=1) - 1)
    row = int(np.argmax(error))
    fatal = error[row] > view.limits.norm_fatal
    if error[row] > view.limits.norm_warn:
        view.add("base_quat", row, "quaternion-norm", "a unit quaternion", f"norm {1 + error[row]:.3g}", fatal=fatal)
    return not fatal


def turns(quat: np.ndarray, window: int) -> tuple[np.ndarray, np.ndarray]:
    """Rotation over `window` rows as a vector in the base frame and in the world frame, (T - window, 3) each."""
    first, last = quat[:-window], quat[window:]
    in_base, in_world = multiply_by_cross(conjugate(first), last), multiply_by_cross(last, conjugate(first))
    return rotation_vector(in_base), rotation_vector(in_world)


def _check_turning(view: View, quat: np.ndarray) -> None:
    """The gyro's integral against the quaternion's change, under each reading of the two."""
    limits, rollout = view.limits, view.rollout
    for seconds in TURN_SECONDS:
        window = view.window(min(seconds, 0.25 * rollout.duration))
        gyro = integral(rollout.time, view.values("base_ang_vel"), window)
        body, world = turns(quat, window)
        size = max(_robust(body), min(_robust(gyro), np.pi))
        if size > limits.turn_wanted:
            break
    swapped, _ = turns(np.roll(quat, 1, axis=1), window)
    errors = {
        "good": _robust(body - gyro),
        "xyzw": _robust(swapped - gyro),
        "world": _robust(world - gyro),
        "degrees": _robust(body - gyro * np.pi / 180),
        "sign": _robust(body + gyro),
    }
    if size < limits.turn_floor:
        _check_still_order(view, quat)
        return
    best = min(errors, key=lambda name: errors[name])
    if best != "good" and errors["xyzw"] < 1.3 * errors[best] + 0.5 * limits.turn_floor:
        best = "xyzw"  # a base that only pitches gives a reversed gyro as well; the order is the usual mistake
    if best == "good" or errors[best] > limits.frame_gain**0.5 * errors["good"] or errors["good"] < limits.turn_floor:
        _check_loose(view, errors["good"], size, seconds)
        return
    came = f"mismatch with the gyro {errors['good']:.3g} rad in {seconds:g} s, {errors[best]:.3g} if it were so"
    rule, column, expected, what = {
        "xyzw": ("quaternion-order", "base_quat", "wxyz", "xyzw"),
        "world": ("velocity-frame", "base_ang_vel", "the base frame", "the world frame"),
        "degrees": ("degrees", "base_ang_vel", "rad/s", "deg/s"),
        "sign": ("gyro-sign", "base_ang_vel", "world from base", "the inverse rotation, or a reversed gyro"),
    }[best]
    apart = best != "world" or _robust(body - world) > limits.frame_apart * size
    view.add(column, None, rule, expected, f"{what}: {came}", fatal=apart)


def _check_loose(view: View, error: float, size: float, seconds: float) -> None:
    if size > 5 * view.limits.turn_floor and error > 0.7 * size:
        came = f"mismatch {error:.3g} rad of {size:.3g} rad in {seconds:g} s"
        view.add("base_ang_vel", None, "gyro-derivative", "the quaternion's rate of change", came, fatal=False)


def _check_still_order(view: View, quat: np.ndarray) -> None:
    """A base that hardly turns: identity in xyzw order reads as a heading of 180 degrees, and nothing tells which."""
    if np.median(np.abs(quat[:, 3])) > 0.98:
        came = "a still base that either heads backwards or is given as xyzw"
        view.add("base_quat", 0, "quaternion-order", "wxyz", came, fatal=False)


def _check_travel(view: View, quat: np.ndarray) -> None:
    """base_lin_vel against the derivative of base_pos, as base-frame and as world-frame velocity."""
    rollout, limits = view.rollout, view.limits
    window = view.window(0.1)
    place, speed = view.values("base_pos"), view.values("base_lin_vel")
    moved = place[window:] - place[:-window]
    span = (rollout.time[window:] - rollout.time[:-window])[:, None]
    readings = {"base": rotate_by_cross(quat, speed), "world": speed}
    errors = {name: _robust((moved - integral(rollout.time, value, window)) / span) for name, value in readings.items()}
    if errors["base"] < limits.drift_floor:
        return
    came = (
        f"mismatch {errors['base']:.3g} m/s with the derivative of base_pos, {errors['world']:.3g} in the world frame"
    )
    if errors["world"] < limits.frame_gain**0.5 * errors["base"]:
        apart = _robust(readings["base"] - speed) > limits.frame_apart * _robust(speed)
        view.add("base_lin_vel", None, "velocity-frame", "the base frame", f"the world frame: {came}", fatal=apart)
    elif errors["base"] > 0.7 * _robust(moved / span) and errors["base"] > 4 * limits.drift_floor:
        view.add("base_lin_vel", None, "velocity-derivative", "the derivative of base_pos", came, fatal=False)


def _robust(error: np.ndarray) -> float:
    """Root mean square of the vectors' lengths without the largest 2 % (impacts between two rows)."""
    length = np.sort(np.linalg.norm(error, axis=1))
    return float(np.sqrt((length[: max(1, int(0.98 * len(length)))] ** 2).mean()))
