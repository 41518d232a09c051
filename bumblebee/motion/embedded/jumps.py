"""Jumps: the height of the centre of mass is crouch, push, free fall, landing; it is C2 except where gravity is alone.

The push ends with the acceleration of free fall, so the floor's force goes to zero smoothly before the feet leave.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from bumblebee.motion.embedded.gestures import RELAXED, add
from bumblebee.motion.embedded.plan import COM_HEIGHT, FPS, SIDES, Plan, bump, ease, pose_arm, standing, track
from bumblebee.motion.embedded.solver import GRAVITY
from bumblebee.motion.embedded.vary import Vary

BEGIN, CROUCH, PUSH, LAND, RISE, END = 0.6, 0.8, 0.36, 0.4, 0.9, 0.6  # s
TAKE_OFF = COM_HEIGHT - 0.05
"""Height of the centre of mass as the feet leave and land [m]: the knees are still bent."""
LEAN = 0.45  # rad: of the torso
LIFT = 0.028
"""How far the feet come up under the body and off the floor [m]."""
Knot = tuple[float, tuple[float, float, float]]
"""Time, and height, speed, acceleration there."""


def jump(vary: Vary, airborne: float, ahead: float = 0.0, crouch: float = 0.075, hops: int = 1) -> Plan:
    """Jump for `airborne` [s], the feet landing `ahead` [m]; a crouch as deep in between where there are `hops`."""
    crouch = vary(crouch)
    airborne = round(vary(airborne) * FPS) / FPS  # leaves and lands on a frame
    speed = GRAVITY * airborne / 2
    release = TAKE_OFF - 0.15 * ahead  # the legs slant, so they leave earlier
    low = (release - crouch, 0.0, 0.0)
    knots: list[Knot] = [(BEGIN, (COM_HEIGHT, 0.0, 0.0)), (BEGIN + CROUCH, low)]
    flights = []
    for _ in range(hops):
        leave = round((knots[-1][0] + PUSH) * FPS) / FPS
        flights.append(leave)
        knots += [(leave, (release, speed, -GRAVITY)), (leave + airborne, (release, -speed, -GRAVITY))]
        knots.append((leave + airborne + LAND, low))
    knots.append((knots[-1][0] + RISE, (COM_HEIGHT, 0.0, 0.0)))
    plan = standing(knots[-1][0] + END)
    height = np.interp(plan.time, [0.0], [COM_HEIGHT])
    for start, end in pairwise(knots):
        inside = (plan.time >= start[0] - 1e-9) & (plan.time <= end[0] + 1e-9)
        height[inside] = quintic(plan.time[inside], start, end)
    plan = _fly(replace(plan, height=height, ballistic=True), flights, airborne, vary(ahead))
    return _lean(plan, knots)


def quintic(time: np.ndarray, start: Knot, end: Knot) -> np.ndarray:
    """The polynomial (T,) that joins two knots in height, speed and acceleration."""
    span = end[0] - start[0]
    s = (time - start[0]) / span
    (p, v, a), (q, w, b) = (np.array(k[1]) * [1, span, span**2] for k in (start, end))
    coefficients = [
        p,
        v,
        a / 2,
        10 * (q - p) - 6 * v - 4 * w - 1.5 * a + 0.5 * b,
        -15 * (q - p) + 8 * v + 7 * w + 1.5 * a - b,
        6 * (q - p) - 3 * (v + w) - 0.5 * (a - b),
    ]
    return np.polynomial.polynomial.polyval(s, coefficients)


def _fly(plan: Plan, flights: list[float], airborne: float, ahead: float) -> Plan:
    pos, contact, zmp = plan.foot_pos.copy(), plan.contact.copy(), plan.zmp.copy()
    for leave in flights:
        phase = (plan.time - leave) / airborne
        pos[:, :, 2] += LIFT * bump(phase)[:, None]
        pos[:, :, 0] += ahead * ease((phase - 0.1) / 0.8)[:, None]
        zmp[:, 0] += ahead * (phase > 0.5)
        contact[(phase > 1e-6) & (phase < 1 - 1e-6)] = False
    return replace(plan, foot_pos=pos, contact=contact, zmp=zmp)


def _lean(plan: Plan, knots: list[Knot]) -> Plan:
    """Torso ahead and arms back from the crouch to the last landing; neither turns while the body is fast."""
    share = track(plan.time, list(zip([knots[i][0] for i in (0, 1, -2, -1)], (0.0, 1.0, 1.0, 0.0), strict=True)))
    upper = plan.upper.copy()
    for side in SIDES:
        pose_arm(upper, side, np.array(RELAXED) + np.multiply.outer(share, [0.35, 0.1, 0.0, -0.2]))
    return add(replace(plan, upper=upper), pelvis_pitch=LEAN * share)
