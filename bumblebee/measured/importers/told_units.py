"""The note on the unit in which a log's joints were read: how it was known, what the values show, how to change it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.measured.importers.column_map import ANGLE_FACTORS, LEFT_OUT, ColumnMap
from bumblebee.measured.rollout import Rollout


def with_units_told(rollouts: Sequence[Rollout], chosen: ColumnMap) -> list[Rollout]:
    """The rollouts with the note in their metadata; unchanged where the map states units that are the contract's.

    Args:
        rollouts: of one import, by this map.
        chosen: the map.
    """
    note = units_note(rollouts, chosen)
    if not note:
        return list(rollouts)
    return [
        replace(one, meta=one.meta | {"notes": "; ".join(filter(None, (one.meta.get("notes"), note)))})
        for one in rollouts
    ]


def units_note(rollouts: Sequence[Rollout], chosen: ColumnMap) -> str:
    """One line; empty where the map states every unit and none is converted.

    The evidence is the span of `joint_pos` over all rollouts, in the file's own values.
    """
    turned = sorted({unit for unit in chosen.angle_unit if ANGLE_FACTORS[unit] != 1.0})
    if chosen.angle_unit and not turned:
        return ""
    known = f"read in {', '.join(turned)} and turned to rad, as `angle_unit` of the map says"
    if not chosen.angle_unit:
        known = "read in rad (m of slides), since the map has no `angle_unit`"
    gyro = ""
    if chosen.gyro_unit == "deg" and "base_ang_vel" in chosen.columns:
        gyro = ", base_ang_vel in deg/s (`gyro_unit`)"
    spans = ", ".join(f"{low:.4g} to {high:.4g}{unit}" for unit, low, high in _spans(rollouts, chosen))
    other = ["rad" if unit in turned else unit for unit in chosen.angle_unit or ("deg",)]
    said = other[0] if len(other) == 1 else f"[{', '.join(other)}]"
    do = f"If that is wrong, write `angle_unit: {said}` in the map"
    return f"joints {known}{gyro}: joint_pos in the file goes from {spans}. {do}"


def _spans(rollouts: Sequence[Rollout], chosen: ColumnMap) -> Iterator[tuple[str, float, float]]:
    """Unit, least and largest joint position in the file of the joints that have it."""
    kept = [place for place, joint in enumerate(chosen.joints) if joint != LEFT_OUT]
    units = (chosen.angle_unit or ("",)) * (1 if len(chosen.angle_unit) > 1 else len(chosen.joints))
    factor, offset = (
        np.broadcast_to(np.array(given.get("joint_pos", (none,))), len(chosen.joints))[kept]
        for given, none in ((chosen.scale, 1.0), (chosen.offset, 0.0))
    )
    names = np.array([units[place] for place in kept])
    values = (np.concatenate([one.joint_pos for one in rollouts]) - offset) / factor
    for unit in dict.fromkeys(names.tolist()):
        own = values[:, names == unit] / ANGLE_FACTORS.get(unit, 1.0)
        yield f" {unit}" if unit else "", float(np.nanmin(own)), float(np.nanmax(own))
