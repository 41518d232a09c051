"""Safety rules between policy and wire: pure functions of a moment, each with the step that it asks for.

A rule knows nothing of phases or of time but what its moment says; `RULES` is the table that the guard walks through.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from bumblebee.wire.messages import Mode, State
from bumblebee.wire.safety.limits import Drives, Limits


class Step(IntEnum):
    """Answer to a moment, in order of severity."""

    GO = 0
    WARN = 1
    """Counted and shown; the order goes out, cut where a limit cuts it."""
    HOLD = 2
    """The last targets are kept until the reason is gone."""
    DAMP = 3
    """kd alone brakes; no way back but a new start."""
    OFF = 4
    """No torque."""


@dataclass(frozen=True)
class Wish:
    """Intended order to J drives, each array (J,)."""

    target: np.ndarray
    """[rad]."""
    kp: np.ndarray
    """[N m/rad]."""
    kd: np.ndarray
    """[N m s/rad]."""
    torque: np.ndarray
    """Feed-forward [N m]."""


@dataclass(frozen=True)
class Reference:
    """Reference of the control period, as the policy's worker tells it."""

    target: np.ndarray
    """(J,) joint targets of a policy that does nothing [rad]."""
    quat: np.ndarray
    """(4,) orientation of the pelvis in the robot's own world, wxyz."""
    height: float
    """Height of the pelvis above the floor [m]."""


@dataclass(frozen=True)
class Moment:
    """All that the rules know of one tick; times in seconds."""

    state: State
    """Newest usable one."""
    wish: Wish
    """Before anything is cut."""
    reference: Reference | None
    """None until the policy has answered."""
    carries: bool
    """Whether the robot carries itself, by the orders."""
    state_age: float
    policy_late: float
    """Time since an answer was due that has not come; 0 where none is due."""
    deaf: float
    """Time in which the robot took none of our orders."""
    key_age: float
    """Time without the dead-man's key; 0 where nobody needs to hold it."""
    console_age: float
    stops: int
    """How often the stop key was pressed."""
    missed: int
    """Ticks missed in a row."""
    air: float
    """Time without a foot on the floor."""
    stalled: np.ndarray
    """(J,) time at the torque limit without motion."""
    controller: int
    """Ours."""


Rule = Callable[[Moment, Drives, Limits], Step]


def torque_of(state: State, wish: Wish) -> np.ndarray:
    """Torque (J,) [N m] that the drives give for a wish in a state, before any limit."""
    return wish.kp * (wish.target - state.joint_pos) - wish.kd * state.joint_vel + wish.torque


def cut(state: State, wish: Wish, drives: Drives, limits: Limits) -> tuple[Wish, np.ndarray]:
    """The wish within range and torque, and which drives (J,) bool would have given more than their torque.

    A servo's target may lie beyond the range, as its distance makes the torque. In a soft zone what pushes outward
    fades, target and torque, from all of it at the zone's inner edge to nothing at the end of the range.
    """
    room, reach = _room(state, wish, drives, limits), wish.target - state.joint_pos
    soft = Wish(state.joint_pos + reach * room, wish.kp, wish.kd, wish.torque * room)
    target = soft.target
    torque, most = torque_of(state, soft), limits.torque * drives.effort
    over = np.clip(torque, -most, most) - torque
    strong = wish.kp > 0
    target = target + np.where(strong, over / np.where(strong, wish.kp, 1.0), 0.0)
    return Wish(target, wish.kp, wish.kd, soft.torque), over != 0


def _room(state: State, wish: Wish, drives: Drives, limits: Limits) -> np.ndarray:
    """Share (J,) of the soft zone that is left in the direction in which the wish pushes; 1 outside of it."""
    width = limits.soft_zone * (drives.high - drives.low)
    push = wish.kp * (wish.target - state.joint_pos) + wish.torque
    ahead = np.where(push > 0, drives.high - state.joint_pos, state.joint_pos - drives.low)
    return np.clip(ahead / width, 0.0, 1.0)


def lean(quat: np.ndarray, other: np.ndarray) -> float:
    """Angle [degrees] between the up axes of two orientations (4,)."""
    cosine = sum(a * b for a, b in zip(_up(quat), _up(other), strict=True))
    return math.degrees(math.acos(min(1.0, max(-1.0, cosine))))


def _up(quat: np.ndarray) -> tuple[float, float, float]:
    w, x, y, z = quat.tolist()
    return 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)


def soft_zone(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A joint is pushed outward in a soft zone: the push is cut."""
    return Step.GO if (_room(now.state, now.wish, drives, limits) >= 1.0).all() else Step.WARN


def joint_range(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A joint reads beyond its range."""
    margin = limits.beyond * (drives.high - drives.low)
    inside = (now.state.joint_pos >= drives.low - margin) & (now.state.joint_pos <= drives.high + margin)
    return Step.GO if inside.all() else Step.DAMP


def speed(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A joint is too fast."""
    return Step.GO if (np.abs(now.state.joint_vel) <= limits.speed * drives.speed).all() else Step.DAMP


def torque(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A drive would give more torque than it may: its target is cut."""
    most = limits.torque * drives.effort
    return Step.GO if (np.abs(torque_of(now.state, now.wish)) <= most).all() else Step.WARN


def stall(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A joint is pushed at the limit and does not move."""
    return Step.GO if (now.stalled <= limits.stall).all() else Step.DAMP


def power(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A drive would give, or take, too much power."""
    most = limits.torque * drives.effort
    given = np.clip(torque_of(now.state, now.wish), -most, most) * now.state.joint_vel
    return Step.GO if (np.abs(given) <= limits.power * drives.effort * drives.speed).all() else Step.DAMP


def tilt(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The pelvis leans away from its reference, or is below it."""
    if not now.carries or now.reference is None:
        return Step.GO
    fallen = now.reference.height - now.state.base_pos[2] >= limits.drop_m
    leans = lean(now.state.base_quat, now.reference.quat) >= limits.tilt_deg
    return Step.DAMP if fallen or leans else Step.GO


def contact(now: Moment, drives: Drives, limits: Limits) -> Step:
    """No foot carries for longer than any jump takes."""
    return Step.DAMP if now.carries and now.air > limits.air else Step.GO


def temperature(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A motor is warm, or hot; NaN is not measured."""
    if (now.state.temperature > limits.hot).any():
        return Step.DAMP
    return Step.WARN if (now.state.temperature > limits.warm).any() else Step.GO


def motor_error(now: Moment, drives: Drives, limits: Limits) -> Step:
    """A drive reports an error."""
    return Step.DAMP if now.state.error.any() else Step.GO


def silent(now: Moment, drives: Drives, limits: Limits) -> Step:
    """No usable state for too long: lost, late, repeated, out of order, no numbers, of another robot."""
    if now.state_age > limits.state_damp:
        return Step.DAMP
    return Step.HOLD if now.state_age > limits.state_hold else Step.GO


def policy_late(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The policy's answer is late."""
    if now.policy_late > limits.policy_damp:
        return Step.DAMP
    return Step.HOLD if now.policy_late > limits.policy_hold else Step.WARN if now.policy_late > 0 else Step.GO


def policy_number(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The policy wants what is no number."""
    wish = now.wish
    parts = (wish.target, wish.kp, wish.kd, wish.torque)
    return Step.GO if all(np.isfinite(part).all() for part in parts) else Step.DAMP


def policy_far(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The policy wants targets too far from the reference's."""
    if now.reference is None:
        return Step.GO
    return Step.DAMP if (np.abs(now.wish.target - now.reference.target) > limits.far * drives.scale).any() else Step.GO


def deaf(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The robot takes none of our orders, or we hear of it late: it refuses them, or the line is broken or slow."""
    return Step.DAMP if now.deaf > limits.deaf else Step.GO


def other_controller(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The robot listens to somebody else."""
    return Step.DAMP if now.state.controller not in (0, now.controller) else Step.GO


def robot_damps(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The robot damps by itself where orders say that it carries itself."""
    return Step.DAMP if now.carries and now.state.mode is Mode.DAMP else Step.GO


def dead_man(now: Moment, drives: Drives, limits: Limits) -> Step:
    """Nobody holds the dead-man's key."""
    return Step.DAMP if now.key_age > limits.key else Step.GO


def console(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The console is gone or hangs."""
    return Step.DAMP if now.console_age > limits.console else Step.GO


def stop_key(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The stop key was pressed once, or again."""
    return (Step.GO, Step.DAMP, Step.OFF)[min(now.stops, 2)]


def own_ticks(now: Moment, drives: Drives, limits: Limits) -> Step:
    """The guard itself did not run in time."""
    if now.missed == 0:
        return Step.GO
    return Step.HOLD if now.missed > limits.missed else Step.WARN


RULES: dict[str, Rule] = {
    rule.__name__: rule
    for rule in (
        policy_number, soft_zone, joint_range, speed, torque, stall, power, tilt, contact, temperature, motor_error,
        silent, policy_late, policy_far, deaf, other_controller, robot_damps, dead_man, console, stop_key,
        own_ticks,
    )
}  # fmt: skip
"""Name -> rule; their order numbers them in a journal."""


def tripped(now: Moment, drives: Drives, limits: Limits) -> dict[str, Step]:
    """Rules that ask for anything, with what they ask for."""
    with np.errstate(invalid="ignore"):  # what is no number fails the comparisons that let it through
        answers = {name: rule(now, drives, limits) for name, rule in RULES.items()}
    return {name: step for name, step in answers.items() if step is not Step.GO}
