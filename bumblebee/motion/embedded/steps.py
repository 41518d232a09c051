"""Footsteps: walks, curves, turns in place and side steps from a list of where each foot lands."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.motion.embedded.plan import (
    ANKLE_X,
    ANKLE_Y,
    ANKLE_Z,
    PELVIS_HEIGHT,
    SIDES,
    SOLE_CENTRE_X,
    WAIST,
    Plan,
    bump,
    ease,
    standing,
    track,
)
from bumblebee.motion.embedded.solver import com_from_zmp

LEAD_IN, LEAD_OUT, REST = 0.7, 0.6, 0.5  # s: weight onto the first stance foot, back to the middle, standing still
STANCE_INSET = 0.004
"""How far inside the sole's middle line the weight goes over one foot [m]."""
LEG_REACH, STAND_REACH = 0.612, 0.616  # m: hip to ankle with a hardly bent knee, and in the stand
HIP_Y, HIP_BEHIND_COM = 0.1165, 0.012  # m
KNEE_RESERVE = 0.008  # m
Place = tuple[float, float, float]
"""x, y [m] and yaw [rad] of the middle of the feet on the floor."""


@dataclass(frozen=True)
class Gait:
    """How steps are taken."""

    swing: float
    """Time of a foot in the air [s]."""
    double: float
    """Time of both feet on the floor between two steps [s]."""
    lift: float = 0.055
    """Height of the ankle's path above its stance [m]."""
    toe_down: float = 0.2
    """How far the toes point down in the middle of a swing [rad]; spares the ankle's range."""
    arm_swing: float = 0.0
    """Shoulder pitch for a metre between the feet [rad/m]."""


@dataclass(frozen=True)
class Step:
    """A foot's landing: side 0 is left, 1 right; ankle x, y [m] and yaw [rad] in the world."""

    side: int
    x: float
    y: float
    yaw: float


def foot_of(place: Place, side: int, width: float = ANKLE_Y) -> Step:
    """Where a foot stands when the stand is at `place`."""
    x, y, yaw = place
    ahead, aside = ANKLE_X, width if side == 0 else -width
    return Step(side, x + ahead * np.cos(yaw) - aside * np.sin(yaw), y + ahead * np.sin(yaw) + aside * np.cos(yaw), yaw)


def walk_steps(path: Callable[[float], Place], length: float, count: int, first: int, width: float) -> list[Step]:
    """`count` alternating steps of `length` along `path(distance)`, and one that brings the feet together."""
    steps = [foot_of(path(length * (i + 0.5)), (first + i) % 2, width) for i in range(count)]
    last = path(length * (count - 0.5))
    return [*steps, foot_of(last, (first + count) % 2, width)]


def straight(sign: float = 1.0) -> Callable[[float], Place]:
    """Along x, ahead or backwards."""
    return lambda distance: (sign * distance, 0.0, 0.0)


def arc(radius: float) -> Callable[[float], Place]:
    """Along a circle: to the left for a positive radius [m], to the right for a negative one."""

    def place(distance: float) -> Place:
        angle = distance / radius
        return radius * np.sin(angle), radius * (1 - np.cos(angle)), angle

    return place


def follow(steps: list[Step], gait: Gait) -> Plan:
    """The plan of a robot that stands, takes these steps and stands again."""
    period = gait.swing + gait.double
    duration = REST + LEAD_IN + period * len(steps) - gait.double + LEAD_OUT + REST
    plan = standing(np.ceil(duration * 50) / 50)
    time = plan.time
    pos, yaw, contact = plan.foot_pos.copy(), plan.foot_yaw.copy(), plan.contact.copy()
    pitch = np.zeros_like(yaw)
    weight = [(REST, 0.5)]
    for i, step in enumerate(steps):
        lift = REST + LEAD_IN + period * i
        phase = (time - lift) / gait.swing
        _swing_foot(pos[:, step.side], yaw[:, step.side], step, phase, gait.lift)
        pitch[:, step.side] += gait.toe_down * bump(phase)
        contact[(phase > 1e-9) & (phase < 1 - 1e-9), step.side] = False
        other = 1.0 - step.side  # 0 is all on the left foot, 1 all on the right
        weight += [(lift, other), (lift + gait.swing, other)]
    weight.append((weight[-1][0] + LEAD_OUT, 0.5))
    share = track(time, weight)[:, None]
    centre = _centres(pos, yaw)
    upper = plan.upper.copy()
    heading = yaw.mean(axis=1)
    _swing_arms(upper, pos, heading, gait.arm_swing)
    plan = replace(
        plan,
        foot_pos=pos,
        foot_yaw=yaw,
        foot_pitch=pitch,
        contact=contact,
        zmp=(1 - share) * centre[:, 0] + share * centre[:, 1],
        pelvis=np.stack([heading, np.zeros_like(heading), np.zeros_like(heading)], axis=1),
        upper=upper,
    )
    walking = [(REST, 0.0), (REST + LEAD_IN, 1.0), (weight[-2][0], 1.0), (weight[-1][0], 0.0)]
    return replace(plan, height=PELVIS_HEIGHT - _lowering(plan) * track(time, walking))


def _swing_foot(pos: np.ndarray, yaw: np.ndarray, step: Step, phase: np.ndarray, lift: float) -> None:
    """Up, over and down, in place on (T, 3) and (T,); it moves sideways only well above the floor."""
    over = ease((phase - 0.1) / 0.8)
    start, start_yaw = pos[-1].copy(), float(yaw[-1])
    pos[:, :2] += np.multiply.outer(over, [step.x - start[0], step.y - start[1]])
    pos[:, 2] += lift * bump(phase)
    yaw += over * (step.yaw - start_yaw)


def _centres(pos: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """The point of each sole that carries, (T, 2, 2), from ankles (T, 2, 3) and yaws (T, 2)."""
    aside = np.array([-STANCE_INSET, STANCE_INSET])
    x = SOLE_CENTRE_X * np.cos(yaw) - aside * np.sin(yaw)
    y = SOLE_CENTRE_X * np.sin(yaw) + aside * np.cos(yaw)
    return pos[..., :2] + np.stack([x, y], axis=-1)


def _lowering(plan: Plan) -> float:
    """How much lower than in the stand the pelvis must go for every leg to reach its foot with a bent knee [m]."""
    com = com_from_zmp(plan, plan.zmp)
    yaw = plan.pelvis[:, 0]
    ahead, aside = np.stack([np.cos(yaw), np.sin(yaw)], axis=1), np.stack([-np.sin(yaw), np.cos(yaw)], axis=1)
    lowest = 0.0
    for i, half in enumerate((HIP_Y, -HIP_Y)):
        apart = plan.foot_pos[:, i, :2] - (com - HIP_BEHIND_COM * ahead + half * aside)
        reach = np.sqrt(LEG_REACH**2 - (apart**2).sum(axis=1))
        lowest = max(lowest, float(np.max(STAND_REACH - (plan.foot_pos[:, i, 2] - ANKLE_Z) - reach)))
    return lowest + KNEE_RESERVE


def _swing_arms(upper: np.ndarray, pos: np.ndarray, heading: np.ndarray, gain: float) -> None:
    """Arms against the legs: the arm goes back as its foot goes ahead."""
    apart = pos[:, 0, :2] - pos[:, 1, :2]
    ahead = apart[:, 0] * np.cos(heading) + apart[:, 1] * np.sin(heading)
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        upper[:, 3 if side == "left" else 7] += sign * gain * ahead
    upper[:, WAIST["yaw"]] += 0.25 * gain * ahead * 0.5


def walk(speed: float, period: float, count: int, sign: float = 1.0, radius: float = 0.0, first: int = 0) -> Plan:
    """Walk `count` steps at a speed [m/s] and time a step [s], straight or on a circle of `radius` [m]."""
    length = speed * period
    path = arc(radius) if radius else straight(sign)
    gait = Gait(swing=0.78 * period, double=0.22 * period, arm_swing=0.9)
    return follow(walk_steps(path, length, count, first, ANKLE_Y), gait)


def turn(angle: float, each: float, period: float) -> Plan:
    """Turn in place by `angle` [rad], `each` [rad] a pair of steps; positive is to the left."""
    pairs = max(1, round(abs(angle) / each))
    first = 0 if angle > 0 else 1
    places = [(0.0, 0.0, angle * (i + 1) / pairs) for i in range(pairs)]
    steps = [foot_of(place, side) for place in places for side in (first, 1 - first)]
    return follow(steps, Gait(swing=0.65 * period, double=0.35 * period))


def side_steps(distances: list[float], period: float) -> Plan:
    """Side steps by these distances [m], positive to the left, the feet together again after each."""
    steps, y = [], 0.0
    for distance in distances:
        y += distance
        first = 0 if distance > 0 else 1
        steps += [foot_of((0.0, y, 0.0), side) for side in (first, 1 - first)]
    return follow(steps, Gait(swing=0.65 * period, double=0.35 * period))


def march(period: float, count: int, lift: float) -> Plan:
    """March in place, `count` steps with the feet `lift` [m] high."""
    steps = [foot_of((0.0, 0.0, 0.0), i % 2) for i in range(count)]
    return follow(steps, Gait(swing=0.7 * period, double=0.3 * period, lift=lift))
