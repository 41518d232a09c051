"""Standing on one leg: the weight goes over one foot, the other is lifted, held or swung, and put back."""

from dataclasses import replace

import numpy as np

from bumblebee.motion.embedded.gestures import add
from bumblebee.motion.embedded.plan import PELVIS_HEIGHT, SIDES, SOLE_CENTRE_X, Plan, pose_arm, standing, track
from bumblebee.motion.embedded.vary import Vary

BEGIN, SHIFT = 0.5, 1.1  # s: standing still, weight onto the foot
INSET = 0.002  # m: the weight is a little inside the sole's middle line
LEAN = 0.16
"""The torso's lean over the stance foot [rad]; spares the ankle, which rolls by 0.26 rad at most."""
ARMS_OUT = (0.1, 0.55, 0.0, 0.7)


def one_leg(
    vary: Vary, stance: str, lift: float = 0.12, ahead: float = 0.06, seconds: float = 1.2, pitch: float = 0.15
) -> Plan:
    """Stand on `stance`; the other ankle goes `lift` [m] up and `ahead` [m], is held for `seconds` and returns."""
    lift, ahead, seconds, move = vary(lift), vary(ahead), vary(seconds), vary(0.8)
    up, down = BEGIN + SHIFT, BEGIN + SHIFT + move + seconds
    raised = [(up, 0.0), (up + move, 1.0), (down, 1.0), (down + move, 0.0)]
    over = [(up + 0.15, 0.0), (up + move, 1.0), (down, 1.0), (down + move - 0.15, 0.0)]
    return _stand_on(stance, (up, down + move), raised, over, (lift, ahead, pitch))


def kick(vary: Vary, stance: str, lift: float = 0.13, ahead: float = 0.24) -> Plan:
    """Stand on `stance`; the other foot goes back a little and then slowly ahead and up, and returns."""
    lift, ahead, move = vary(lift), vary(ahead), vary(0.7)
    up = BEGIN + SHIFT
    times = up + np.cumsum([0.0, move, 1.1 * move, 0.3, 1.3 * move])
    raised = list(zip(times, (0.0, 0.6, 1.0, 1.0, 0.0), strict=True))
    inner = [times[0] + 0.15, *times[1:-1], times[-1] - 0.15]
    over = list(zip(inner, (0.0, -0.3, 1.0, 1.0, 0.0), strict=True))
    return _stand_on(stance, (up, float(times[-1])), raised, over, (lift, ahead, 0.0))


def _stand_on(stance: str, air: tuple[float, float], raised: list, over: list, far: tuple[float, float, float]) -> Plan:
    side = SIDES.index(stance)
    free, sign = 1 - side, 1.0 if side == 0 else -1.0
    plan = standing(air[1] + SHIFT + BEGIN)
    time = plan.time
    pos, contact, pitch = plan.foot_pos.copy(), plan.contact.copy(), plan.foot_pitch.copy()
    centre = pos[0, side, :2] + [SOLE_CENTRE_X, -sign * INSET]
    height = track(time, raised)
    pos[:, free, 2] += far[0] * height
    pos[:, free, 1] += sign * 0.03 * height
    pos[:, free, 0] += far[1] * track(time, over)
    pitch[:, free] = far[2] * height
    contact[(time > air[0] + 1e-9) & (time < air[1] - 1e-9), free] = False
    shifted = [(BEGIN, 0.0), (air[0], 1.0), (air[1], 1.0), (air[1] + SHIFT, 0.0)]
    share = track(time, shifted)
    zmp = plan.zmp + np.multiply.outer(share, centre - plan.zmp[0])
    upper = plan.upper.copy()
    for name in SIDES:
        pose_arm(upper, name, track(time, [(t, ARMS_OUT if s else (0.2, 0.2, 0.0, 0.6)) for t, s in shifted]))
    plan = replace(plan, foot_pos=pos, contact=contact, foot_pitch=pitch, zmp=zmp, upper=upper)
    plan = add(plan, roll=-sign * LEAN * share)
    return replace(plan, height=PELVIS_HEIGHT - 0.02 * share)
