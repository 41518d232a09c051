"""Raw values under the contract's names as rollouts: units, factors, orders, velocities, gains, what is left out."""

from collections.abc import Mapping

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.clock import require_clock
from bumblebee.measured.importers.column_map import LEFT_OUT, NAMED, ColumnMap
from bumblebee.measured.importers.drive import stretches
from bumblebee.measured.importers.source import NO_VELOCITY, differences, measured_rate
from bumblebee.measured.rollout import Rollout

_ANGULAR = ("joint_pos", "joint_vel", "joint_target", "target_vel")
_FACTORS = {"rad": 1.0, "deg": np.pi / 180, "turn": 2 * np.pi, "m": 1.0, "normalised": 1.0}


def rollouts_of(
    where: str,
    rollout_id: str,
    time: np.ndarray,
    values: Mapping[str, np.ndarray],
    chosen: ColumnMap,
    notes: tuple[str, ...] = (),
) -> list[Rollout]:
    """Rollouts of one log; more than one where the gains changed on the way.

    Args:
        where: the file, for messages.
        rollout_id: the rollout's name; with `_1`, `_2` ... where there are several.
        time: (T,) stamps [s].
        values: column of `NAMED` -> (T, width), in the map's units and orders; NaN where nothing was logged.
        chosen: the map.
        notes: what the reader found, for the metadata.

    Raises:
        BadInput: stamps that step back or have another unit; gains without a use; no command.
    """
    require_clock(where, time, chosen)
    lost = [f"{column}: {n} cells without a number" for column, v in values.items() if (n := int(np.isnan(v).sum()))]
    turned = {column: _turned(column, value, chosen) for column, value in values.items()}
    keep = [place for place, joint in enumerate(chosen.joints) if joint != LEFT_OUT]
    if len(keep) < len(chosen.joints):
        turned = {c: value[:, keep] if NAMED[c] == "J" else value for c, value in turned.items()}
    if "joint_vel" not in turned:
        turned["joint_vel"] = differences(time, turned["joint_pos"])
        lost.insert(0, NO_VELOCITY)
    joints = tuple(chosen.joints[place] for place in keep)
    parts, left_out = stretches(where, time, turned, joints)
    said = "; ".join(filter(None, (str(chosen.meta.get("notes") or ""), *notes, *lost, *left_out)))
    rollouts = []
    for number, part in enumerate(parts, start=1):
        name = rollout_id if len(parts) == 1 else f"{rollout_id}_{number}"
        meta = {"motion": name} | _meta(chosen, keep) | part.meta | ({"notes": said} if said else {})
        stamps = time[part.rows]
        _require_command(where, part.values)
        rollouts.append(Rollout(name, joints, measured_rate(stamps), stamps, **part.values, meta=meta))
    return rollouts


def _turned(column: str, value: np.ndarray, chosen: ColumnMap) -> np.ndarray:
    """A column (T, width) in the contract's units and order."""
    with np.errstate(all="ignore"):  # what is too large is a finding of the checks, with its row
        if column in _ANGULAR and set(chosen.angle_unit) - {"rad", "m"}:
            value = value * np.array([_FACTORS[unit] for unit in chosen.angle_unit])
        if column == "base_ang_vel":
            value = value * _FACTORS[chosen.gyro_unit]
        value = value * np.array(chosen.scale.get(column, (1.0,))) + np.array(chosen.offset.get(column, (0.0,)))
    value[:, chosen.uncommanded(column)] = 0.0
    if column == "base_quat" and chosen.quat_order == "xyzw":
        return np.roll(value, 1, axis=1)
    return value


def _meta(chosen: ColumnMap, keep: list[int]) -> dict[str, object]:
    """The map's metadata; lists of one number a joint lose the joints that are left out, as the columns do."""
    width = len(chosen.joints)
    if len(keep) == width:
        return chosen.meta
    return {
        key: [value[place] for place in keep] if isinstance(value, list) and len(value) == width else value
        for key, value in chosen.meta.items()
    }


def _require_command(where: str, values: Mapping[str, np.ndarray]) -> None:
    if "joint_target" not in values and "joint_torque_cmd" not in values:
        raise BadInput(f"{where}: joint_target", "joint_target or joint_torque_cmd in the map", "neither of them")
