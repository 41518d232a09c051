"""Limits on what the robot may be asked for, joint by joint, and who says so."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.plan.config import PlanConfig
from bumblebee.diagnosis.plan.machine import Machine
from bumblebee.diagnosis.thresholds.plan import SafetyMargins
from bumblebee.errors import BadInput
from bumblebee.sim.servo import servos_of


@dataclass(frozen=True, eq=False)
class Limits:
    """Limits of J joints; infinite for a joint without a drive where nothing is known."""

    low: np.ndarray
    """(J,) lowest position [rad, m], with its margin."""
    high: np.ndarray
    """(J,) highest."""
    speed: np.ndarray
    """(J,) [rad/s, m/s], with its margin."""
    torque: np.ndarray
    """(J,) [N m, N], with its margin."""
    said_by: tuple[tuple[str, str], ...]
    """Kind of limit -> where it is from, in words."""


def limits_of(machine: Machine, session: Session | None, config: PlanConfig) -> Limits:
    """The limits with their margins; `BadInput` asks for what neither model, dataset nor options say."""
    rule = config.thresholds.plan.safety
    low, high, travel_by = _travel(machine, session, config, rule)
    speed, speed_by = _speed(machine, session, config)
    torque, torque_by = _torque(machine, config)
    found = Limits(
        low, high, rule.speed * speed, rule.torque * torque,
        (("travel", travel_by), ("speed", speed_by), ("torque", torque_by)),
    )  # fmt: skip
    _refuse_start(machine, found)
    return found


def given(names: Sequence[str], table: Mapping[str, float], option: str) -> np.ndarray:
    """(J,) values of an option by joint; NaN where it says none."""
    for name, value in table.items():
        if name and name not in names:
            raise BadInput(option, "a joint of the model", repr(name)[:80])
        if not (np.isfinite(value) and value > 0):
            raise BadInput(option, "positive numbers", f"{value:g}")
    return np.array([table.get(name, table.get("", np.nan)) for name in names], dtype=float)


def _travel(
    machine: Machine, session: Session | None, config: PlanConfig, rule: SafetyMargins
) -> tuple[np.ndarray, np.ndarray, str]:
    model, names = machine.plant.model, machine.joints
    ids = [int(model.joint(name).id) for name in names]
    limited = model.jnt_limited[ids].astype(bool)
    low = np.where(limited, model.jnt_range[ids, 0], -np.inf)
    high = np.where(limited, model.jnt_range[ids, 1], np.inf)
    said = ["the model's ranges"] if limited.any() else []
    inside = np.where(limited, rule.travel * (model.jnt_range[ids, 1] - model.jnt_range[ids, 0]), 0.0)
    low, high = low + inside, high - inside
    asked = given(names, config.travel, "--travel")
    told = np.isfinite(asked)
    if told.any():
        # Who tells the travel may start nearer to a stop than the margin: there the range is what is left.
        low = low - inside * (told & (machine.home < low))
        high = high + inside * (told & (machine.home > high))
        low = np.where(told, np.maximum(low, machine.home - asked), low)
        high = np.where(told, np.minimum(high, machine.home + asked), high)
        said.append("--travel")
    free = machine.moved & ~limited & ~told
    if session is not None and free.any():
        seen = np.concatenate([r.joint_pos for r in session.rollouts])
        low = np.where(~free, low, np.minimum(seen.min(axis=0), machine.home))
        high = np.where(~free, high, np.maximum(seen.max(axis=0), machine.home))
        said.append("the range that the dataset covers")
    _require(machine, np.isfinite(low) & np.isfinite(high), "a range in the model", "--travel")
    return low, high, ", ".join(said)


def _speed(machine: Machine, session: Session | None, config: PlanConfig) -> tuple[np.ndarray, str]:
    """MJCF knows no speed limit: what is told, or the fastest that the dataset shows."""
    asked = given(machine.joints, config.speed, "--speed")
    if np.isfinite(asked).all():
        return asked, "--speed"
    if session is not None:
        fastest = np.max([np.abs(r.joint_vel).max(axis=0) for r in session.rollouts], axis=0)
        said = "the fastest that the dataset shows"
        fastest = np.where(machine.moved, fastest, np.inf)
        return np.where(np.isfinite(asked), asked, fastest), f"--speed, {said}" if np.isfinite(asked).any() else said
    _require(machine, np.isfinite(asked), "a speed limit, which MJCF has none of", "--speed")
    return np.where(np.isfinite(asked), asked, np.inf), "--speed"


def _torque(machine: Machine, config: PlanConfig) -> tuple[np.ndarray, str]:
    model = machine.plant.model
    own = servos_of(model, [int(model.joint(name).id) for name in machine.joints]).limit
    asked = given(machine.joints, config.torque, "--torque")
    limit = np.fmin(own, asked)
    _require(machine, np.isfinite(limit), "a force limit of its actuator in the model", "--torque")
    said = ["the model's force limits"] * bool(np.isfinite(own).any()) + ["--torque"] * bool(np.isfinite(asked).any())
    return limit, ", ".join(said)


def _require(machine: Machine, known: np.ndarray, what: str, option: str) -> None:
    lacking = [name for name, k, moved in zip(machine.joints, known, machine.moved, strict=True) if moved and not k]
    if lacking:
        more = f" and {len(lacking) - 1} more" if len(lacking) > 1 else ""
        raise BadInput(f"{machine.name}: joint {lacking[0]!r}{more}", what, "none", f"Give it with {option}.")


def _refuse_start(machine: Machine, limits: Limits) -> None:
    out = (machine.home < limits.low) | (machine.home > limits.high)
    if (out & machine.moved).any():
        j = int(np.flatnonzero(out & machine.moved)[0])
        raise BadInput(
            f"start pose: joint {machine.joints[j]!r}",
            f"within {limits.low[j]:.3g} to {limits.high[j]:.3g}, the limits with their margins",
            f"{machine.home[j]:.3g}",
            "Choose a keyframe with --start.",
        )
