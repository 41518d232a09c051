"""Logs of motors that turn with several joints, as in wrists and ankles: the map's `transmission` leads to joints.

With q = M m of joints q and motors m, velocities and targets follow as positions do, and torques as
tau_q = M^-T tau_m, for the power is the same.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import FORCES, LEFT_OUT, MOVES, ColumnMap

_LARGEST = 1e9
_SINGULAR = 1e-6
"""Least singular value of the matrix as a share of the largest: below it a motor moves nothing."""


def read_transmission(where: str, said: Any, joints: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Joint -> factors of the motors in whose place joints stand; joints that are not in it have their own.

    Raises:
        BadInput: names that are no joints of the map, factors that are no numbers, a matrix without an inverse.
    """
    if said is None:
        return {}
    rows = said if isinstance(said, Mapping) else {}
    if not rows or not all(isinstance(row, Mapping) and row for row in rows.values()):
        raise BadInput(where, "joint -> {joint in whose place the motor stands: factor}", repr(said)[:80])
    for name in (*rows, *(motor for row in rows.values() for motor in row)):
        if name not in joints or name == LEFT_OUT:
            raise BadInput(where, f"joints of the map ({', '.join(joints)})"[:300], repr(name)[:60])
    for joint, row in rows.items():
        for motor, factor in row.items():
            if not isinstance(factor, int | float) or isinstance(factor, bool) or not abs(factor) <= _LARGEST:
                raise BadInput(f"{where}: {joint}: {motor}", "a number", repr(factor)[:60])
    table = {joint: {motor: float(factor) for motor, factor in row.items()} for joint, row in rows.items()}
    sizes = np.linalg.svd(_matrix(table, joints)[1], compute_uv=False)
    if not sizes[-1] > _SINGULAR * sizes[0]:
        do = "Give each motor a joint that it turns, and no two joints the same factors."
        raise BadInput(where, "factors that can be solved for the motors", "a singular matrix", do)
    return table


def refuse_gains(where: str, chosen: ColumnMap) -> None:
    """`BadInput` for gains of motors that turn with several joints: no servo of a joint has them."""
    given = [key for key in ("kp", "kd") if key in chosen.columns or key in chosen.meta]
    if chosen.transmission and given:
        do = f"Take {given[0]} out of the map (it may come with a layout), and declare the joints' gains in the model."
        raise BadInput(
            f"{where}: {given[0]}", "no gains beside transmission: they are a motor's, not a joint's", given[0], do
        )


def through(values: Mapping[str, np.ndarray], chosen: ColumnMap) -> dict[str, np.ndarray]:
    """Columns (T, width) of the motors as those of the joints."""
    out = dict(values)
    if not chosen.transmission:
        return out
    places, matrix = _matrix(chosen.transmission, chosen.joints)
    for column in out.keys() & {*MOVES, *FORCES}:
        turned = out[column].copy()
        turned[:, places] = turned[:, places] @ (matrix.T if column in MOVES else np.linalg.inv(matrix))
        out[column] = turned
    return out


def _matrix(table: Mapping[str, Mapping[str, float]], joints: tuple[str, ...]) -> tuple[list[int], np.ndarray]:
    """Places of the joints and motors that are in it, and the matrix from the one to the other."""
    named = {*table, *(motor for row in table.values() for motor in row)}
    places = [place for place, joint in enumerate(joints) if joint in named]
    within = [joints[place] for place in places]
    rows = [[table.get(joint, {joint: 1.0}).get(motor, 0.0) for motor in within] for joint in within]
    return places, np.array(rows)
