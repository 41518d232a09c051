"""A made-up adult for the tests: stands, steps, jumps, reaches; which foot stands when is known."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from bumblebee.motion.human.motion import LANDMARKS, HumanMotion

FPS = 50.0
ANKLE, THIGH, SHIN = 0.08, 0.42, 0.42  # m
HIPS = 0.88  # m: the knees are a little bent
_Y = np.array([1.0, -1.0])  # left, right


def person(
    pelvis: np.ndarray,
    ankles: np.ndarray,
    elbows: np.ndarray | None = None,
    wrists: np.ndarray | None = None,
    fps: float = FPS,
    name: str = "made up",
) -> HumanMotion:
    """A person who faces x, from the hips' middle (T, 3) and the ankles (T, 2, 3) [m], left first; feet are level.

    Elbows and wrists (T, 2, 3) [m] are relative to the shoulders and the elbows; without, the arms hang.
    """
    frames = len(pelvis)
    side = np.array([0.0, 1.0, 0.0])
    up = {"pelvis": 0.05, "chest": 0.35, "neck": 0.5, "head": 0.6}
    at = {landmark: pelvis + height * np.array([0.0, 0.0, 1.0]) for landmark, height in up.items()}
    elbows = np.broadcast_to([[0.0, 0.05, -0.28], [0.0, -0.05, -0.28]], (frames, 2, 3)) if elbows is None else elbows
    wrists = np.broadcast_to([[0.05, 0.0, -0.24], [0.05, 0.0, -0.24]], (frames, 2, 3)) if wrists is None else wrists
    for i, which in enumerate(("left", "right")):
        hip, ankle = pelvis + 0.1 * _Y[i] * side, ankles[:, i]
        along = ankle - hip
        half = np.linalg.norm(along, axis=1, keepdims=True) / 2
        ahead = np.cross(along, side)
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        bent = np.sqrt(np.maximum(THIGH**2 - half**2, 1e-6))
        at |= {f"{which}_hip": hip, f"{which}_knee": hip + along / 2 + ahead * bent, f"{which}_ankle": ankle}
        at[f"{which}_toe"] = ankle + np.array([0.14, 0.0, -0.06])
        at[f"{which}_shoulder"] = at["neck"] + 0.17 * _Y[i] * side
        at[f"{which}_elbow"] = at[f"{which}_shoulder"] + elbows[:, i]
        at[f"{which}_wrist"] = at[f"{which}_elbow"] + wrists[:, i]
    return HumanMotion(name, fps, np.stack([at[n] for n in LANDMARKS], axis=1), Path("made_up.bvh"))


def standing(frames: int = 60, fps: float = FPS, **arms: np.ndarray) -> HumanMotion:
    """A person who stands still."""
    ankles = np.broadcast_to([[0, 0.1, ANKLE], [0, -0.1, ANKLE]], (frames, 2, 3))
    return person(np.tile([0.0, 0.0, HIPS], (frames, 1)), ankles, fps=fps, **arms)


def steps(count: int = 3, fps: float = FPS) -> tuple[HumanMotion, np.ndarray]:
    """A person who steps ahead, each foot in the air for 0.4 s in turn and both down for 0.3 s; who stands (T, 2)."""
    air, both, length = round(0.4 * fps), round(0.3 * fps), 0.35
    feet, stands, x = [], [], np.array([0.0, 0.0])
    for number in range(count):
        foot = number % 2
        for _ in range(both):
            feet.append([[x[0], 0.1, ANKLE], [x[1], -0.1, ANKLE]])
            stands.append([True, True])
        go = length * (1 if number else 0.5)
        for t in range(air):
            share = (t + 1) / (air + 1)
            row = [[x[0], 0.1, ANKLE], [x[1], -0.1, ANKLE]]
            row[foot][0] += go * share * share * (3 - 2 * share)
            row[foot][2] += 0.12 * np.sin(np.pi * share) ** 0.7
            feet.append(row)
            stands.append([foot != 0, foot != 1])
        x[foot] += go
    feet += [[[x[0], 0.1, ANKLE], [x[1], -0.1, ANKLE]]] * both
    stands += [[True, True]] * both
    ankles = np.array(feet)
    pelvis = np.c_[ankles[..., 0].mean(axis=1), np.zeros(len(ankles)), np.full(len(ankles), HIPS - 0.03)]
    return person(pelvis, ankles, fps=fps, name="steps"), np.array(stands)


def jump(fps: float = FPS, rise: float = 0.3) -> tuple[HumanMotion, np.ndarray]:
    """A person who stands 0.6 s, flies and stands 0.6 s again; the feet's height over the floor (T,) [m]."""
    rest, half = round(0.6 * fps), np.sqrt(2 * rise / 9.81)
    t = np.arange(-round(half * fps), round(half * fps) + 1) / fps
    up = np.r_[np.zeros(rest), np.maximum(rise - 9.81 / 2 * t**2, 0), np.zeros(rest)]
    height = up[:, None] * np.array([0.0, 0.0, 1.0])
    ankles = np.array([[0, 0.1, ANKLE], [0, -0.1, ANKLE]]) + height[:, None]
    return person(np.array([0.0, 0.0, HIPS]) + height, ankles, fps=fps, name="jump"), up


def turning_kick(turns: float = 1.5, seconds: float = 0.6, frames: int = 70) -> HumanMotion:
    """A person who stands on the left foot, kicks with the right, and turns about the left within `seconds`."""
    time = np.arange(frames) / FPS
    up = np.sin(np.pi * np.clip((time - 0.3) / (time[-1] - 0.6), 0, 1)) ** 2
    ankles = np.tile([[0.0, 0.1, ANKLE], [0.0, -0.1, ANKLE]], (frames, 1, 1))
    ankles[:, 1] += up[:, None] * np.array([0.35, -0.1, 0.5])
    share = np.clip((time - (time[-1] - seconds) / 2) / seconds, 0, 1)
    angle = 2 * np.pi * turns * share * share * (3 - 2 * share)
    zero, one = np.zeros(frames), np.ones(frames)
    rows = [[np.cos(angle), -np.sin(angle), zero], [np.sin(angle), np.cos(angle), zero], [zero, zero, one]]
    turn, about = np.moveaxis(np.array(rows), 2, 0), np.array([0.0, 0.1, 0.0])
    still = person(np.tile([0.0, 0.0, HIPS], (frames, 1)), ankles, name="turning kick")
    return changed(still, lambda p: np.einsum("tij,tkj->tki", turn, p - about) + about)


def changed(motion: HumanMotion, how: Callable[[np.ndarray], np.ndarray]) -> HumanMotion:
    """The person with other positions."""
    return HumanMotion(motion.name, motion.fps, how(motion.positions), motion.file)


def turned(motion: HumanMotion, angle: float) -> HumanMotion:
    """About the vertical through the origin [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return changed(motion, lambda p: p @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]))


def mirrored(motion: HumanMotion) -> HumanMotion:
    """Left and right exchanged."""
    other = [n.replace("left", "L").replace("right", "left").replace("L", "right") for n in LANDMARKS]
    order = [LANDMARKS.index(n) for n in other]
    return changed(motion, lambda p: p[:, order] * [1.0, -1.0, 1.0])
