"""Standing gestures: both feet stay, the arms and the torso move, the legs keep the balance.

An arm's pose is (shoulder pitch, roll, yaw, elbow) in the left arm's convention: pitch < 0 lifts it ahead,
roll > 0 to its own side, yaw > 0 turns the forearm outwards; elbow 0 is bent by 90 degrees, 1.45 straight.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.motion.embedded.plan import PELVIS_HEIGHT, SIDES, WAIST, Plan, pose_arm, standing, swing, track
from bumblebee.motion.embedded.vary import Vary

RELAXED = (0.2, 0.2, 0.0, 0.6)
WAVING = (-1.45, 0.9, 0.0, 0.05)
UP = (-2.8, 0.7, 0.0, 1.35)
ASIDE = (0.1, 1.45, 0.0, 1.35)
AHEAD = (-1.4, 0.2, 0.0, 1.35)
CLAPPING = (-0.75, 0.12, 0.05, 0.25)
GUARD = (0.15, 0.2, -0.15, -0.65)
ELBOWS_OUT = (0.6, 1.1, -1.0, 0.15)
START = 0.5  # s of standing still before and after

Keys = Sequence[tuple[float, Sequence[float]]]


def arms(plan: Plan, **keys: Keys) -> Plan:
    """Move arms through poses: `arms(plan, left=[(time, pose), ...])`, from and back to where the keys say."""
    upper = plan.upper.copy()
    for side, of_side in keys.items():
        pose_arm(upper, side, track(plan.time, of_side))
    return replace(plan, upper=upper)


def add(plan: Plan, **columns: np.ndarray) -> Plan:
    """Add (T,) angles to the waist (`yaw`, `roll`, `pitch`) or the pelvis (`pelvis_pitch`, `pelvis_roll`, ...)."""
    upper, pelvis = plan.upper.copy(), plan.pelvis.copy()
    for name, angle in columns.items():
        if name.startswith("pelvis_"):
            pelvis[:, ("yaw", "pitch", "roll").index(name.removeprefix("pelvis_"))] += angle
        else:
            upper[:, WAIST[name]] += angle
    return replace(plan, upper=upper, pelvis=pelvis)


def hold(pose: Sequence[float], seconds: float, move: float = 1.0) -> Keys:
    """Keys of an arm that goes to a pose, stays there and comes back."""
    return [
        (START, RELAXED),
        (START + move, pose),
        (START + move + seconds, pose),
        (START + 2 * move + seconds, RELAXED),
    ]


def _held(sides: Sequence[str], pose: Sequence[float], seconds: float, move: float) -> Plan:
    plan = standing(2 * START + 2 * move + seconds)
    return arms(plan, **{side: hold(pose, seconds, move) for side in sides})


def _oscillate(plan: Plan, side: str, joint: int, angle: np.ndarray) -> None:
    start = 3 if side == "left" else 7
    sign = 1.0 if side == "left" or joint in (0, 3) else -1.0
    plan.upper[:, start + joint] += sign * angle


def wave(vary: Vary, sides: Sequence[str]) -> Plan:
    """The forearm up, swinging from side to side."""
    move, seconds = vary(0.9), vary(2.4)
    plan = _held(sides, WAVING, seconds, move)
    angle = vary(0.4) * swing(plan.time, START + 0.8 * move, START + 1.2 * move + seconds, 4)
    for side in sides:
        _oscillate(plan, side, 2, angle)
    return plan


def pose(vary: Vary, sides: Sequence[str], arm: Sequence[float], seconds: float = 1.5) -> Plan:
    """Arms to a pose, held, and back."""
    return _held(sides, arm, vary(seconds), vary(1.2))


def clap(vary: Vary) -> Plan:
    """Hands together in front of the chest, a few times; they stop a hand's width short of each other."""
    move, seconds = vary(0.9), vary(2.4)
    plan = _held(SIDES, CLAPPING, seconds, move)
    apart = vary(0.15) * swing(plan.time, START + move, START + move + seconds, 5, rise=0.3)
    for side in SIDES:
        _oscillate(plan, side, 2, apart)
    return plan


def arm_circles(vary: Vary) -> Plan:
    """Arms to the sides, the hands drawing circles."""
    move, seconds, size = vary(1.0), vary(3.0), vary(0.22)
    plan = _held(SIDES, ASIDE, seconds, move)
    start, end = START + move, START + move + seconds
    window = track(plan.time, [(start, 0.0), (start + 0.6, 1.0), (end - 0.6, 1.0), (end, 0.0)])
    phase = 2 * np.pi * 3 * (plan.time - start) / seconds
    for side in SIDES:
        _oscillate(plan, side, 0, size * window * np.sin(phase))
        _oscillate(plan, side, 1, size * window * (np.cos(phase) - 1) / 1.5)
    return plan


def arm_swing(vary: Vary) -> Plan:
    """Both arms swing to and fro, against each other."""
    seconds = vary(4.0)
    plan = standing(2 * START + seconds)
    angle = vary(0.5) * swing(plan.time, START, START + seconds, 4)
    _oscillate(plan, "left", 0, angle)
    _oscillate(plan, "right", 0, -angle)
    return plan


def look(vary: Vary, sign: float) -> Plan:
    """The torso turns to one side and back."""
    turn, move, seconds = sign * vary(0.7), vary(1.1), vary(1.0)
    plan = standing(2 * START + 2 * move + seconds)
    keys = [(START, 0.0), (START + move, turn), (START + move + seconds, turn), (START + 2 * move + seconds, 0.0)]
    return add(plan, yaw=track(plan.time, keys))


def twist(vary: Vary) -> Plan:
    """The torso turns left and right, the arms half raised."""
    seconds = vary(4.2)
    plan = _held(SIDES, (-0.35, 0.5, 0.0, 0.3), seconds, 0.8)
    return add(plan, yaw=vary(0.55) * swing(plan.time, START + 0.6, START + 1.0 + seconds, 3))


def bow(vary: Vary, depth: float) -> Plan:
    """Bend forward at the hips and the waist; the pelvis goes back to keep the balance."""
    move, seconds, depth = vary(1.3), vary(0.8), vary(depth)
    plan = standing(2 * START + 2 * move + seconds)
    keys = [(START, 0.0), (START + move, depth), (START + move + seconds, depth), (START + 2 * move + seconds, 0.0)]
    bend = track(plan.time, keys)
    plan = add(plan, pelvis_pitch=0.6 * bend, pitch=0.4 * bend)
    return replace(plan, height=PELVIS_HEIGHT - 0.05 * bend)


def side_bend(vary: Vary) -> Plan:
    """The torso bends to the left and to the right."""
    seconds = vary(5.0)
    plan = standing(2 * START + seconds)
    return add(plan, roll=vary(0.28) * swing(plan.time, START, START + seconds, 2))


def sway(vary: Vary, reach: float, cycles: int) -> Plan:
    """Shift the weight from foot to foot, `reach` [m] to either side."""
    seconds = vary(2.4) * cycles
    plan = standing(2 * START + seconds)
    zmp = plan.zmp.copy()
    zmp[:, 1] += vary(reach) * swing(plan.time, START, START + seconds, cycles, rise=1.0)
    end = START + seconds
    down = 0.015 * track(plan.time, [(START, 0.0), (START + 1, 1.0), (end - 1, 1.0), (end, 0.0)])
    return replace(plan, zmp=zmp, height=plan.height - down)


def shrug(vary: Vary) -> Plan:
    """Both arms go a little up and out, forearms ahead, twice."""
    move = vary(0.6)
    out = (0.05, 0.5, 0.55, -0.1)
    times = np.cumsum([START, move, 0.4, move, 0.3, move, 0.4, move])
    keys = list(zip(times, (RELAXED, out, out, RELAXED, RELAXED, out, out, RELAXED), strict=True))
    return arms(standing(float(times[-1]) + START), left=keys, right=keys)


def punch(vary: Vary) -> Plan:
    """Slow punches straight ahead, left and right in turn, from a guard."""
    move = vary(0.55)
    guard_left, guard_right = [(START, RELAXED), (START + 0.8, GUARD)], [(START, RELAXED), (START + 0.8, GUARD)]
    now = START + 0.8
    for i in range(4):
        keys = guard_left if i % 2 == 0 else guard_right
        keys += [(now, GUARD), (now + move, AHEAD), (now + 2 * move, GUARD)]
        now += 2 * move
    for keys in (guard_left, guard_right):
        keys += [(now + 0.1, GUARD), (now + 0.9, RELAXED)]
    plan = arms(standing(now + 0.9 + START), left=_tidy(guard_left), right=_tidy(guard_right))
    ends = START + 0.8, now
    return add(plan, yaw=-0.2 * swing(plan.time, *ends, 2))


def _tidy(keys: Keys) -> Keys:
    """Drop keys that repeat a time."""
    return [key for i, key in enumerate(keys) if i == 0 or key[0] > keys[i - 1][0] + 1e-9]
