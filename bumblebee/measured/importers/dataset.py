"""`import_dataset`: any known layout of logs as a dataset of the contract, with the declared model beside it."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import mujoco

from bumblebee.errors import BadInput
from bumblebee.io.names import distinct_stems
from bumblebee.io.write import new_folder, try_output
from bumblebee.measured.importers.asap_npz import import_asap
from bumblebee.measured.importers.column_map import DOUBLE_PENDULUM
from bumblebee.measured.importers.conditions_table import read_conditions, with_conditions, with_settings
from bumblebee.measured.importers.csv_map import import_csv
from bumblebee.measured.importers.hdf5_log import import_hdf5
from bumblebee.measured.importers.lerobot import import_lerobot
from bumblebee.measured.importers.map_file import read_map
from bumblebee.measured.importers.model_joints import require_joints
from bumblebee.measured.importers.ros import import_rosbag
from bumblebee.measured.importers.so101 import import_so101
from bumblebee.measured.importers.source import open_source
from bumblebee.measured.importers.sysid_npz import import_sysid
from bumblebee.measured.importers.told_units import with_units_told
from bumblebee.measured.model_file import copy_model, load_model
from bumblebee.measured.rollout import Rollout, write_rollout

KINDS = ("so101", "csv", "double_pendulum", "asap", "sysid", "rosbag", "lerobot", "hdf5")
MAPPED = ("csv", "rosbag", "lerobot", "hdf5")
"""Layouts that a column map reads."""


def read_rollouts(
    source: Path,
    kind: str,
    model: mujoco.MjModel | None = None,
    column_map: Path | None = None,
    conditions: Path | None = None,
    settings: Sequence[str] = (),
) -> list[Rollout]:
    """The rollouts of a source in one of the layouts `KINDS`.

    Args:
        source: folder, zip archive or file.
        kind: one of `KINDS`; asap and sysid need `model`, those of `MAPPED` a `column_map`.
        model: the declared model.
        column_map: YAML file with the fields of `ColumnMap`.
        conditions: table of what was different in each log, see `conditions_table`.
        settings: NAME=VALUE, conditions of all logs.
    """
    table = read_conditions(conditions, open_source(source)) if conditions else None
    no_log = (table.member,) if table else ()
    if kind in ("asap", "sysid") and model is None:
        raise BadInput(kind, "the declared model, by whose joints the file is read", "none", "Give it: --model.")
    if kind in MAPPED and column_map is None:
        raise BadInput(kind, "a column map", "none", "Give a YAML file with joints, columns and units: --columns.")
    mapped = read_map(column_map, kind) if kind in MAPPED and column_map else DOUBLE_PENDULUM[0]
    if kind in MAPPED and column_map:
        require_joints(column_map, mapped, model)
    readers: dict[str, Callable[[], list[Rollout]]] = {
        "so101": lambda: import_so101(source),
        "csv": lambda: import_csv(source, [mapped], no_log),
        "double_pendulum": lambda: import_csv(source, DOUBLE_PENDULUM),
        "asap": lambda: import_asap(source, model),
        "sysid": lambda: import_sysid(source, model),
        "rosbag": lambda: import_rosbag(source, mapped),
        "lerobot": lambda: import_lerobot(source, mapped),
        "hdf5": lambda: import_hdf5(source, mapped),
    }
    if kind not in readers:
        raise BadInput(kind, f"one of {', '.join(KINDS)}", repr(kind))
    rollouts = _distinct(readers[kind]())
    if kind in MAPPED:
        rollouts = with_units_told(rollouts, mapped)
    return with_settings(with_conditions(rollouts, table) if table else rollouts, settings)


def import_dataset(
    source: Path,
    kind: str,
    out: Path,
    model_path: Path | None = None,
    column_map: Path | None = None,
    conditions: Path | None = None,
    settings: Sequence[str] = (),
    require_match: Callable[[Path, Sequence[Rollout], object], None] | None = None,
) -> list[str]:
    """Write `out`/rollouts/*.parquet and `out`/model.xml; `out` appears whole and must not exist. Returns the ids.

    `require_match(model, rollouts, where)` raises where the model that is written, called `where`, suits no rollout.
    """
    out = Path(out)
    if os.path.lexists(out):
        raise BadInput(out, "a new folder", "one that exists", "Choose another name.")
    try_output(out)
    model = load_model(model_path) if model_path else None
    rollouts = read_rollouts(Path(source), kind, model, column_map, conditions, settings)
    with new_folder(out) as folder:
        for rollout in rollouts:
            write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
        if model_path:
            locked = read_map(column_map, kind).locked if kind in MAPPED and column_map else ()
            copy_model(model_path, folder / "model.xml", locked)
            if require_match:
                require_match(folder / "model.xml", rollouts, model_path)
    return [rollout.rollout_id for rollout in rollouts]


def _distinct(rollouts: list[Rollout]) -> list[Rollout]:
    """The rollouts under names that can be files' and of which no two are alike; none is lost."""
    names = distinct_stems([rollout.rollout_id for rollout in rollouts], "rollout")
    return [_renamed(rollout, name) for rollout, name in zip(rollouts, names, strict=True)]


def _renamed(rollout: Rollout, name: str) -> Rollout:
    if name == rollout.rollout_id:
        return rollout
    motion = {"motion": name} if rollout.meta.get("motion") == rollout.rollout_id else {}
    return replace(rollout, rollout_id=name, meta=rollout.meta | motion)
