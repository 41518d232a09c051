"""Effects in MuJoCo's own numbers, shared by the spec (compiled anew) and by models varied in place."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

# A constant joint torque is a spring so weak and so long that its torque hardly depends on the angle.
_WEAK = 1e-4
# Second, coaxial hinges: how hard the ends of the play are, and how fast a shaft's own swing dies.
PLAY_SOLREF, PLAY_SOLIMP = (0.001, 1.0), (0.95, 0.99, 1e-3)
HIDDEN_ARMATURE = 1e-5  # [kg m^2] keeps the mass matrix regular where the rotor has no armature
ROTOR_MASS, ROTOR_INERTIA = 1e-6, 1e-9  # [kg], [kg m^2] of a rotor's body, which must have some
NO_SURFACE = -10.0  # [m] the height of a surface so low that nothing touches it
POINT_RADIUS = 1e-3  # [m] of the sphere that stands for a point that touches a surface
SUFFIX = {"backlash": "_play", "series_elasticity": "_flex"}


def spring_of(stiffness: float, preload: float) -> tuple[float, float]:
    """MuJoCo's (stiffness, reference) of the torque -stiffness q + preload."""
    if abs(stiffness) < _WEAK * abs(preload):
        stiffness = math.copysign(_WEAK * abs(preload), stiffness)
    return (stiffness, preload / stiffness) if stiffness else (0.0, 0.0)


def physical_inertia(moments: Sequence[float]) -> np.ndarray:
    """Principal moments (3,) [kg m^2] that a body can have: none above the sum of the other two."""
    out = np.array(moments, dtype=float)
    largest = int(np.argmax(out))
    out[largest] = min(out[largest], 0.9999 * (out.sum() - out[largest]))
    return out


def spread_inertia(moments: Sequence[float], factor: float, spread: float) -> np.ndarray:
    """Principal moments (3,) [kg m^2] of a body whose mass has grown by `factor`.

    At spread 0 what was added sits at the centre of mass; at 1 the mass is distributed as before.
    """
    return np.asarray(moments, dtype=float) * (1 + spread * (factor - 1))


def sloped(gravity: Sequence[float], x: float, y: float, z: float = 0.0) -> np.ndarray:
    """Gravity (3,) [m/s^2] turned by the rotation vector (x, y, z) [rad] of the world."""
    axis = np.array([x, y, z])
    angle = float(np.linalg.norm(axis))
    g = np.array(gravity, dtype=float)
    if angle < 1e-12:
        return g
    k = axis / angle
    return g * math.cos(angle) + np.cross(k, g) * math.sin(angle) + k * (k @ g) * (1 - math.cos(angle))


def touch(a_type: int, a_affinity: int, b_type: int, b_affinity: int) -> bool:
    """Whether two geometries' masks let them touch."""
    return bool((a_type & b_affinity) | (b_type & a_affinity))


def touching(model: mujoco.MjModel, ground: int) -> list[int]:
    """Geometries that the geometry `ground` can touch."""
    types, affinities = model.geom_contype, model.geom_conaffinity
    pairs = ((g, touch(types[ground], affinities[ground], types[g], affinities[g])) for g in range(model.ngeom))
    return [g for g, meet in pairs if meet and g != ground]


def pairs_of(model: mujoco.MjModel, ground: int) -> np.ndarray:
    """Contact pairs (K,) of the geometry `ground` that the model names, with a friction and softness of their own."""
    return np.flatnonzero((model.pair_geom1 == ground) | (model.pair_geom2 == ground))


def contact_names(body: str) -> tuple[str, str]:
    """Names of the geometries of a body's point and of the surface that it touches."""
    return f"{body}_contact_point", f"{body}_surface"


def rotor_of(kind: str, joint: str) -> str:
    """Name of the body and the tendon of a rotor behind play or a shaft, where the encoder is on the joint."""
    return f"{joint}{SUFFIX[kind]}_rotor"


def is_hidden(joint: str) -> bool:
    """Whether a joint's name says that it stands for play or a flexible shaft, which no encoder reads."""
    return joint.endswith(tuple(SUFFIX.values()))
