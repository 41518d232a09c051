"""Fields of the model that differ between the worlds, and the constants that follow from them."""

from collections.abc import Mapping

import mujoco
import numpy as np
from mujoco.batch import Batch

MASSES = {"body_mass", "body_inertia", "body_ipos"}
"""Fields from which constants follow."""
_CONSTANTS = ("body_subtreemass", "body_invweight0", "dof_invweight0", "actuator_acc0")
_AT_ONCE = 1024  # worlds, to bound the memory


def with_constants(model: mujoco.MjModel, fields: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """`fields`, name -> (B, ...), and, if masses are among them, what MuJoCo derives from those for each world."""
    masses = {name: values for name, values in fields.items() if name in MASSES}
    if not masses:
        return dict(fields)
    count = len(next(iter(masses.values())))
    parts: dict[str, list[np.ndarray]] = {name: [] for name in _CONSTANTS}
    for start in range(0, count, _AT_ONCE):
        some = {name: values[start : start + _AT_ONCE] for name, values in masses.items()}
        batch = Batch(model, min(_AT_ONCE, count - start), 1)
        for name, values in some.items():
            batch.expand(name)[:] = values
        batch.set_const()
        for name in _CONSTANTS:
            parts[name].append(np.array(batch.expand(name)))
    return {**fields, **{name: np.concatenate(values) for name, values in parts.items()}}
