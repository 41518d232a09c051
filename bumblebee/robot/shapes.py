"""Shapes of a table of facts: spheres and capsules, by their ends."""

from typing import Any

import numpy as np

_SHORTEST = 1e-6  # m of a capsule; a shorter one is a sphere
_ROUND = 9  # digits that a table keeps

Bodies = dict[str, dict[str, Any]]
"""A robot's table: body name -> its facts (`folder.RobotFolder`)."""


def capsule(name: str, a: np.ndarray, b: np.ndarray, radius: float) -> dict[str, Any]:
    """A capsule between two points [m] of the body, its axis the shape's z; a sphere where they are one."""
    length = float(np.linalg.norm(b - a))
    if length < _SHORTEST:
        size = [float(round(radius, _ROUND))]
        return {"name": name, "type": "sphere", "size": size, "pos": floats((a + b) / 2), "quat": [1.0, 0.0, 0.0, 0.0]}
    quat = _turn_of_z((b - a) / length)
    at = {"pos": floats((a + b) / 2), "quat": floats(quat)}
    return {
        "name": name,
        "type": "capsule",
        "size": [float(round(radius, _ROUND)), float(round(length / 2, _ROUND))],
        **at,
    }


def _turn_of_z(to: np.ndarray) -> np.ndarray:
    """Shortest rotation (4,) [wxyz] that takes the z axis to a unit vector (3,)."""
    if to[2] < -1 + _SHORTEST:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1 + to[2], -to[1], to[0], 0.0])
    return turn / np.linalg.norm(turn)


def floats(values: np.ndarray) -> list[float]:
    """Numbers as plain ones, of so many digits that a table is the same on every machine."""
    return [float(value) for value in np.round(values, _ROUND)]
