"""Importer of LeRobot datasets, v3 and v2: meta/info.json, and Parquet files of episodes under data/.

The dataset says neither units (degrees, -100 to 100 of a joint's calibrated range, rad) nor which joint of the model an
element is: the map does. Row k holds the observation, and the action taken on it, as the contract's rows do. The time
stamps are frame number / fps, not measured, which the rollouts' notes say.
"""

from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_json
from bumblebee.measured.importers.column_map import ColumnMap
from bumblebee.measured.importers.csv_map import read_table
from bumblebee.measured.importers.map_file import same_order
from bumblebee.measured.importers.source import Source, open_source
from bumblebee.measured.rollout import Rollout

INFO = "meta/info.json"
_VERSIONS = ("v2", "v3")
NOTES = "LeRobot: time stamps are frame numbers over fps, not measured"


def import_lerobot(place: Path, chosen: ColumnMap) -> list[Rollout]:
    """Every episode of a dataset's folder or zip archive, a rollout each."""
    source = open_source(place)
    infos = [name for name in source.names if name == INFO or name.endswith(f"/{INFO}")]
    if len(infos) != 1:
        came = ", ".join(infos)[:200] or "none"
        raise BadInput(place, f"one LeRobot dataset, a folder with {INFO}", came)
    info = _info(source, infos[0])
    _require_fit(source.where(infos[0]), info, chosen)
    base = PurePosixPath(infos[0]).parent.parent
    names = [name for name in source.ending(".parquet") if PurePosixPath(name).is_relative_to(base / "data")]
    if not names:
        raise BadInput(place, f"Parquet files under {base / 'data'}", "none")
    chosen = replace(chosen, meta=_meta(info, chosen))
    return [rollout for name in names for rollout in read_table(source, name, "episode", [chosen])]


def _info(source: Source, name: str) -> dict[str, Any]:
    where = source.where(name)
    info = parse_json(where, source.read_text(name))
    if not isinstance(info, dict) or not isinstance(info.get("features"), dict):
        raise BadInput(where, "an object with features", type(info).__name__)
    version = str(info.get("codebase_version"))
    if not version.startswith(_VERSIONS):
        raise BadInput(f"{where}: codebase_version", "v2 or v3", version[:60])
    return info


def _require_fit(where: str, info: dict[str, Any], chosen: ColumnMap) -> None:
    """Features that the map names, as many elements as it has joints, and names that speak of no other joint."""
    for column, names in chosen.columns.items():
        if len(names) != 1:
            continue
        feature = info["features"].get(names[0])
        if not isinstance(feature, dict):
            came = ", ".join(map(str, info["features"]))[:200]
            raise BadInput(f"{where}: features", f"{names[0]}, as the map says of {column}", f"only {came}")
        elements, width = _elements(feature.get("names")), chosen.width(column)
        shape = feature.get("shape")
        if isinstance(shape, list) and shape != [width]:
            expected = f"{width} values, as the map has joints (`_` for one left out)"
            raise BadInput(f"{where}: {names[0]}", expected, f"shape {shape}, {', '.join(elements)}"[:200])
        if chosen.names and column in ("joint_pos", "joint_target") and elements and elements != chosen.names:
            raise BadInput(f"{where}: {names[0]}", ", ".join(chosen.names)[:200], ", ".join(elements)[:200])
        same_order(f"{where}: {names[0]}", chosen.joints, elements)


def _elements(names: Any) -> tuple[str, ...]:
    """Names of a vector's elements: a list, or a list under one key (`motors`)."""
    if isinstance(names, dict) and len(names) == 1:
        names = next(iter(names.values()))
    return tuple(map(str, names)) if isinstance(names, list) else ()


def _meta(info: dict[str, Any], chosen: ColumnMap) -> dict[str, Any]:
    """The map's metadata, the robot's name as the dataset says it, and the note on the time stamps."""
    robot = {"robot": info["robot_type"]} if isinstance(info.get("robot_type"), str) and info["robot_type"] else {}
    notes = NOTES if chosen.time == ("timestamp",) and not chosen.hz else ""
    said = "; ".join(filter(None, (str(chosen.meta.get("notes") or ""), notes)))
    return robot | chosen.meta | ({"notes": said} if said else {})
