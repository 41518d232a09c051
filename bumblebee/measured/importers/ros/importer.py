"""Importer of ROS 2 recordings by a map from the contract's columns to `topic:field`."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

from bumblebee.errors import BadInput
from bumblebee.measured.importers.column_map import ColumnMap
from bumblebee.measured.importers.mapped import rollouts_of
from bumblebee.measured.importers.ros.fields import steps
from bumblebee.measured.importers.ros.grid import Series, on_one_grid
from bumblebee.measured.importers.ros.mcap_file import read_mcap
from bumblebee.measured.importers.ros.recording import Recording, merged
from bumblebee.measured.importers.ros.sqlite_file import read_sqlite
from bumblebee.measured.importers.ros.takes import require_running, split_takes
from bumblebee.measured.importers.ros.topic_series import Wanted, series_of
from bumblebee.measured.importers.source import Source, open_source
from bumblebee.measured.rollout import Rollout

READERS = {".mcap": read_mcap, ".db3": read_sqlite}
_EPOCH = 10**18  # [ns] 2001: stamps above count from 1970, those below from a machine's start


def import_rosbag(place: Path, chosen: ColumnMap) -> list[Rollout]:
    """Every recording of a folder or zip archive, or one file; files beside one metadata.yaml are one recording."""
    source = open_source(place)
    wanted = _wanted(place, chosen)
    rollouts = []
    for rollout_id, names in _recordings(source):
        found = merged(_read(source, name, wanted) for name in names)
        rollouts += _rollouts(source.where(names[0]), rollout_id, found, wanted, chosen)
    return rollouts


def _read(source: Source, name: str, wanted: dict[str, list[Wanted]]) -> Recording:
    return READERS[_ending(name)](source.where(name), source.read(name), wanted, source.limits)


def _recordings(source: Source) -> list[tuple[str, list[str]]]:
    """Rollout id and files of each recording."""
    names = sorted(name for name in source.names if _ending(name) in READERS)
    if not names:
        packed = [name for name in source.names if name.endswith((".mcap.zstd", ".db3.zstd"))]
        do = f"Unpack it first: zstd -d {packed[0]}" if packed else ""
        raise BadInput(source.place, "recordings (.mcap or .db3)", ", ".join(packed)[:200] or "none", do)
    bags = {PurePosixPath(name).parent for name in source.names if PurePosixPath(name).name == "metadata.yaml"}
    groups: dict[PurePosixPath, list[str]] = {}
    for name in names:
        path = PurePosixPath(name)
        groups.setdefault(path.parent if path.parent in bags else path.with_suffix(""), []).append(name)
    return [(path.name or source.place.stem, files) for path, files in groups.items()]


def _ending(name: str) -> str:
    return PurePosixPath(name).suffix.lower()


def _wanted(place: Path, chosen: ColumnMap) -> dict[str, list[Wanted]]:
    """Topic -> what the map wants of it."""
    out: dict[str, list[Wanted]] = {}
    for column, names in chosen.columns.items():
        if len(names) not in (1, chosen.width(column)):
            raise BadInput(f"{place}: {column}", f"one topic, or {chosen.width(column)}", str(len(names)))
        for part, name in enumerate(names):
            topic, colon, path = name.partition(":")
            if not topic or not colon:
                raise BadInput(f"{place}: {column}", "topic:field, as /joint_states:position", repr(name)[:80])
            one = Wanted(column, steps(f"{place}: {column}", path), part if len(names) > 1 else -1)
            out.setdefault(topic, []).append(one)
    return out


def _rollouts(
    where: str, rollout_id: str, found: Recording, wanted: dict[str, list[Wanted]], chosen: ColumnMap
) -> list[Rollout]:
    series = _series(where, found, wanted, chosen)
    takes = [series]
    if chosen.episodes == "split":
        takes = split_takes(series)
    else:
        require_running(where, series, chosen, lambda other: _series(where, found, wanted, other))
    return [
        rollout
        for number, take in enumerate(takes, start=1)
        for rollout in _of_take(where, rollout_id if len(takes) == 1 else f"{rollout_id}_{number}", found, take, chosen)
    ]


def _series(where: str, found: Recording, wanted: dict[str, list[Wanted]], chosen: ColumnMap) -> list[Series]:
    """The series of all topics, by the joints' places in the map."""
    series = []
    for name, wants in wanted.items():
        topic = found.topics.get(name)
        if topic is None or not topic.messages:
            there = ", ".join(f"{other} ({kind})" for other, kind in sorted(found.others.items())[:20])
            came = f"none; others: {there or 'none'}"[:400]
            raise BadInput(f"{where}: {name}"[:300], "messages of this topic", came)
        series += series_of(f"{where}: {name}"[:300], name, topic, wants, chosen)
    return sorted(series, key=lambda one: one.places[0])


def _of_take(where: str, rollout_id: str, found: Recording, series: list[Series], chosen: ColumnMap) -> list[Rollout]:
    time, values, notes = on_one_grid(where, series, chosen)
    first = min(int(one.stamps.min()) for one in series)
    if first > _EPOCH and "recorded_at" not in chosen.meta:
        at = datetime.fromtimestamp(first // 10**9, UTC).isoformat()
        chosen = replace(chosen, meta=chosen.meta | {"recorded_at": at})
    clocks = ", ".join(f"{topic or 'stamps'}: {clock}" for topic, clock in sorted(chosen.clock.items()))
    return rollouts_of(where, rollout_id, time, values, chosen, (f"ROS 2 recording, {clocks}", *found.notes, *notes))
