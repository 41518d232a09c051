"""Checks of units and gains: degrees given for radians, gains that are not the declared model's."""

from typing import Any

import mujoco
import numpy as np

from bumblebee.measured.checks.view import View

DEGREE = np.pi / 180
_MM = ": mm?"


def check_degrees(view: View) -> None:
    """Positions or targets that fit the model's ranges, or each other, only after division by 57.3.

    Targets that are another multiple of the positions are no degrees.
    """
    ranges = view.ranges()
    for column in ("joint_pos", "joint_target"):
        values = getattr(view.rollout, column)
        if view.found("target-scale", column):
            continue
        if values is not None and _fits_only_as_degrees(values, ranges):
            joint = int(np.argmax(_excess(values, ranges).max(axis=0)))
            row = int(np.argmax(_excess(values, ranges)[:, joint]))
            slide = is_slide(view, joint)
            why = "beyond the range" if slide else "within the range only as degrees"
            thousandth = bool((_excess(values * 1e-3, ranges)[:, joint] < 0.1).all())
            _add(view, column, joint, row, f"{values[row, joint]:.4g}, {why}{_MM if slide and thousandth else ''}")
    target, place = view.rollout.joint_target, view.rollout.joint_pos
    if target is None or view.found("degrees") or view.found("target-scale"):
        return
    for column, ratio in (("joint_target", _rms(target) / _rms(place)), ("joint_pos", _rms(place) / _rms(target))):
        if 40 < ratio < 80 and _rms(getattr(view.rollout, column)) > 3:
            joint = int(np.argmax(np.abs(getattr(view.rollout, column)).max(axis=0)))
            other = place if column == "joint_target" else target
            own = _rms(getattr(view.rollout, column)[:, joint]) / _rms(other[:, joint])
            hint = _MM if is_slide(view, joint) and 500 < own < 2000 else ""
            _add(view, column, joint, None, f"values {ratio:.0f} times those of the other column{hint}")


def _add(view: View, column: str, joint: int, row: int | None, came: str) -> None:
    unit = "m, as the joint is a slide" if is_slide(view, joint) else "radians"
    view.add(view.label(column, joint), row, "degrees", unit, came, fatal=True)


def is_slide(view: View, joint: int) -> bool:
    """Whether a column's joint is a slide of the model."""
    found = view.joint_ids()[joint]
    return found >= 0 and int(view.model.jnt_type[found]) == int(mujoco.mjtJoint.mjJNT_SLIDE)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean())) + 1e-12


def _excess(values: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """How far each value lies beyond its range, (T, J); unlimited joints are never beyond."""
    return np.maximum(ranges[:, 0] - values, values - ranges[:, 1])


def _fits_only_as_degrees(values: np.ndarray, ranges: np.ndarray) -> bool:
    """Several rows of the file are far outside as they are and all of them inside as degrees."""
    limited = np.isfinite(ranges).all(axis=1)
    if not limited.any():
        return False
    values, ranges = values[:, limited], ranges[limited]
    if np.abs(values).max() < 2 * np.pi:
        return False  # 0.11 rad at most if these were degrees: rather a reversed joint or another zero
    outside = (_excess(values, ranges) > 1.0).any(axis=1).mean() > 0.2
    jumps = np.abs(np.diff(values, axis=0)).max()
    if abs(jumps - 2 * np.pi) < 0.3 and np.abs(values).max() < 4 * np.pi:
        return False  # radians that were wrapped
    return bool(outside and (_excess(values * DEGREE, ranges) < 0.1).all())


def driven_joints(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of the joints that actuators turn directly, in the actuators' order; tendons and sites are left out."""
    return tuple(model.joint(int(model.actuator_trnid[i, 0])).name for i in range(model.nu) if at_joint(model, i))


def at_joint(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator acts on a joint."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    return int(model.actuator_trntype[actuator]) in kinds


def servo_gains(model: mujoco.MjModel) -> dict[str, tuple[float, float]]:
    """Joint name -> (kp, kd) [N m a rad, a rad/s at the joint] of a model's position servos; others are left out."""
    gains = {}
    for actuator in range(model.nu):
        affine = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
        kp = float(model.actuator_gainprm[actuator, 0])
        if at_joint(model, actuator) and affine and kp > 0 and np.isclose(-model.actuator_biasprm[actuator, 1], kp):
            name = model.joint(int(model.actuator_trnid[actuator, 0])).name
            ratio = float(model.actuator_gear[actuator, 0]) ** 2
            gains[name] = (kp * ratio, float(-model.actuator_biasprm[actuator, 2]) * ratio)
    return gains


def check_gains(view: View) -> None:
    """The gains that were in force against the declared model's and the policy contract's."""
    declared = servo_gains(view.model)
    named = {"kp": {name: pair[0] for name, pair in declared.items()}}
    named["kd"] = {name: pair[1] for name, pair in declared.items()}
    for key, wanted in named.items():
        values = view.rollout.meta.get(key)
        if values is None:
            continue
        _compare_declared(view, key, dict(zip(view.rollout.joints, values, strict=True)), wanted)
        theirs = _contract_gains(view.contract, key)
        _compare(view, key, dict(zip(view.rollout.joints, values, strict=True)), theirs, "the policy contract's", True)


def _contract_gains(contract: dict[str, Any] | None, key: str) -> dict[str, float]:
    if not contract or key not in contract or len(contract[key]) != len(contract.get("joints", [])):
        return {}
    return dict(zip(contract["joints"], contract[key], strict=True))


def _compare_declared(view: View, key: str, values: dict[str, float], wanted: dict[str, float]) -> None:
    """Gains other than the declared ones are a condition of the rollout; those of no drive of this kind are fatal."""
    if negative := next((name for name, value in values.items() if value < 0), None):
        view.add(f"{key}[{negative}]", None, "gains", "gains of at least 0", f"{values[negative]:g}", fatal=True)
        return
    most, known = view.limits.gains_factor, {name: (values[name], x) for name, x in wanted.items() if name in values}
    far = [n for n, (value, x) in known.items() if value > 0 and x > 0 and not 1 / most <= value / x <= most]
    if far:
        expected = f"N m a rad (and a rad/s), within {most:g} times the declared model's {wanted[far[0]]:.6g}"
        view.add(f"{key}[{far[0]}]", None, "gains", expected, f"{values[far[0]]:g}: another unit", fatal=True)
    else:
        _compare(view, key, values, wanted, "the declared model's", fatal=False)


def _compare(view: View, key: str, values: dict[str, float], wanted: dict[str, float], whose: str, fatal: bool) -> None:
    wrong = [
        name
        for name, value in values.items()
        if name in wanted and abs(value - wanted[name]) > view.limits.gains_relative * max(abs(wanted[name]), 1e-6)
    ]
    if wrong:
        first = wrong[0]
        came = f"{values[first]:g} ({len(wrong)} joints differ)"
        view.add(f"{key}[{first}]", None, "gains", f"{whose} {wanted[first]:.6g}", came, fatal=fatal)
