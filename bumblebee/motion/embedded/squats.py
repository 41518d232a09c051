"""Squats and low reaches: the pelvis goes down and the torso leans ahead so that the weight stays over the feet."""

from dataclasses import replace

import numpy as np

from bumblebee.motion.embedded.gestures import AHEAD, RELAXED, START, add
from bumblebee.motion.embedded.plan import PELVIS_HEIGHT, SIDES, Plan, pose_arm, standing, track
from bumblebee.motion.embedded.vary import Vary

REACHING = (-1.2, 0.2, 0.0, 1.3)
FOR_BALANCE = (-0.75, 0.2, 0.0, 0.9)
PITCH_PER_DEPTH = 2.1
"""Lean of the pelvis for a metre of depth [rad/m]."""


def squat(vary: Vary, depth: float, move: float, pause: float = 0.3, times: int = 1, ahead: bool = False) -> Plan:
    """Go down by `depth` [m] in `move` [s], stay, come up; `times` over; the arms go ahead a little or all the way."""
    depth, move, pause = vary(depth), vary(move), vary(pause)
    keys, now = [(START, 0.0)], START
    for _ in range(times):
        keys += [(now + move, 1.0), (now + move + pause, 1.0), (now + 2 * move + pause, 0.0)]
        now += 2 * move + pause + 0.25
        keys.append((now, 0.0))
    plan = standing(now + START)
    return _down(plan, track(plan.time, keys), depth, AHEAD if ahead else FOR_BALANCE, SIDES)


def reach_low(vary: Vary, sides: tuple[str, ...], depth: float) -> Plan:
    """Squat and reach for the floor with one hand or both; one hand turns the waist too."""
    depth, move, pause = vary(depth), vary(1.5), vary(0.8)
    plan = standing(2 * START + 2 * move + pause)
    keys = [(START, 0.0), (START + move, 1.0), (START + move + pause, 1.0), (START + 2 * move + pause, 0.0)]
    phase = track(plan.time, keys)
    plan = _down(plan, phase, depth, REACHING, sides)
    sign = (sides == ("right",)) * 1.0 - (sides == ("left",)) * 1.0
    return add(plan, yaw=sign * 0.35 * phase, pitch=0.2 * phase)


def _down(plan: Plan, phase: np.ndarray, depth: float, arm: tuple[float, ...], sides: tuple[str, ...]) -> Plan:
    lean = PITCH_PER_DEPTH * depth * phase
    plan = add(plan, pelvis_pitch=lean, pitch=0.25 * lean)
    upper = plan.upper.copy()
    for side in sides:
        pose_arm(upper, side, np.array(RELAXED) + np.multiply.outer(phase, np.subtract(arm, RELAXED)))
    return replace(plan, upper=upper, height=PELVIS_HEIGHT - depth * phase)
