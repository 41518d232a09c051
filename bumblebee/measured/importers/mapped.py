"""Raw values under the contract's names as rollouts: units, factors, orders, velocities, gains, what is left out."""

from collections.abc import Mapping

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.importers.clock import require_clock, takes
from bumblebee.measured.importers.column_map import ANGLE_FACTORS, LEFT_OUT, MOVES, NAMED, ColumnMap
from bumblebee.measured.importers.drive import Stretch, stretches
from bumblebee.measured.importers.source import NO_VELOCITY, differences, measured_rate
from bumblebee.measured.importers.transmission import through
from bumblebee.measured.pauses import SHORTEST
from bumblebee.measured.rollout import COMMANDS, WIDTHS, Rollout

_NEEDED = ("joint_pos", *COMMANDS)


def rollouts_of(
    where: str,
    rollout_id: str,
    time: np.ndarray,
    values: Mapping[str, np.ndarray],
    chosen: ColumnMap,
    notes: tuple[str, ...] = (),
) -> list[Rollout]:
    """Rollouts of one log; more than one where it holds several takes or the gains changed on the way.

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
    rows = [slice(0, len(time))]
    if chosen.episodes == "split":
        rows = takes(time)
        if not rows:
            raise BadInput(f"{where}: episodes", f"takes of {SHORTEST:g} s or more", "none")
        short = len(time) - sum(part.stop - part.start for part in rows)
        notes = (*notes, *[f"{short} rows of takes shorter than {SHORTEST:g} s left out"] * bool(short))
    turned = through({column: _turned(column, value, chosen) for column, value in values.items()}, chosen)
    keep = [place for place, joint in enumerate(chosen.joints) if joint != LEFT_OUT]
    if len(keep) < len(chosen.joints):
        turned = {c: value[:, keep] if NAMED[c] == "J" else value for c, value in turned.items()}
    joints = tuple(chosen.joints[place] for place in keep)
    parts = [part for take in rows for part in _parts(where, time, turned, take, joints, chosen)]
    rollouts = []
    for number, (stamps, part, found) in enumerate(parts, start=1):
        said = "; ".join(filter(None, (str(chosen.meta.get("notes") or ""), *notes, *found)))
        name = rollout_id if len(parts) == 1 else f"{rollout_id}_{number}"
        meta = {"motion": name} | _meta(chosen, keep) | part.meta | ({"notes": said} if said else {})
        _require_command(where, part.values)
        rollouts.append(Rollout(name, joints, measured_rate(stamps), stamps, **part.values, meta=meta))
    return rollouts


def _parts(
    where: str, time: np.ndarray, values: dict[str, np.ndarray], take: slice, joints: tuple[str, ...], chosen: ColumnMap
) -> list[tuple[np.ndarray, Stretch, list[str]]]:
    """Stamps, columns and notes of every stretch of constant gains in one take."""
    time, values = time[take], {column: value[take] for column, value in values.items()}
    values, notes = _with_numbers(where, values, joints)
    if chosen.rows == "complete":
        whole = np.isfinite(time) & np.all([np.isfinite(value).all(axis=1) for value in values.values()], axis=0)
        time, values = time[whole], {column: value[whole] for column, value in values.items()}
        notes += [f"{int((~whole).sum())} rows without a number left out"] * (not whole.all())
        if len(time) < 2:
            raise BadInput(where, "rows with a number in every column", f"{len(time)}", "Take a column out of the map.")
    require_clock(where, time, chosen)
    lost = [f"{column}: {n} cells without a number" for column, v in values.items() if (n := int(np.isnan(v).sum()))]
    if "joint_vel" not in values:
        values["joint_vel"] = differences(time, values["joint_pos"])
        notes.insert(0, NO_VELOCITY)
    parts, left_out = stretches(where, time, values, joints)
    return [(time[part.rows], part, [*notes, *lost, *left_out]) for part in parts]


def _with_numbers(
    where: str, values: dict[str, np.ndarray], joints: tuple[str, ...]
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns with numbers of every joint, and notes on the others, which are left out where they are optional."""
    kept, notes = {}, []
    for column, value in values.items():
        empty = np.isnan(value).all(axis=0)
        which = "" if empty.all() or NAMED[column] != "J" else f" of {', '.join(np.array(joints)[empty])}"
        if empty.any() and column in _NEEDED:
            raise BadInput(f"{where}: {column}", "numbers", f"no number{which} in any row")
        if empty.any() and column in WIDTHS:
            notes.append(f"{column} left out: no number{which} in any row")
        else:
            kept[column] = value
    return kept, notes


def _turned(column: str, value: np.ndarray, chosen: ColumnMap) -> np.ndarray:
    """A column (T, width) in the contract's units and order."""
    with np.errstate(all="ignore"):  # what is too large is a finding of the checks, with its row
        if column in MOVES and set(chosen.angle_unit) - {"rad", "m"}:
            value = value * np.array([ANGLE_FACTORS[unit] for unit in chosen.angle_unit])
        if column == "base_ang_vel":
            value = value * ANGLE_FACTORS[chosen.gyro_unit]
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
