"""The intake of a batch: good files into `accepted`, others copied to `quarantine` with their findings beside them.

Originals are never touched and nothing is ever overwritten. Running it again changes nothing: a file whose content lies
there already is skipped, a file of the same name with other content is a finding.
"""

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io.names import safe_stem
from bumblebee.io.read import file_hash
from bumblebee.measured.checks import Finding, Thresholds, check_rollout
from bumblebee.measured.rollout import BadRollout, Rollout, read_rollout

UNFORESEEN = "check-failed"  # the rule of a file over which a check itself broke
LONGEST_NAME = 220  # bytes: `<name>.findings.json` lies beside it, and file systems take 255
FINDING_COLUMNS = ("file", "column", "row", "rule", "expected", "came", "fatal", "message")


@dataclass(frozen=True)
class Item:
    """One incoming file and what became of it."""

    file: str
    sha256: str
    accepted: bool
    motion: str
    cluster: str
    seconds: float
    joints: tuple[str, ...]


@dataclass(frozen=True)
class IntakeSummary:
    """Outcome of a batch."""

    items: tuple[Item, ...]
    findings: pd.DataFrame
    """One row a finding: file, column, row, rule, expected, came, fatal, message."""

    @property
    def accepted(self) -> list[str]:
        """Names of the files that are accepted."""
        return [item.file for item in self.items if item.accepted]

    @property
    def quarantined(self) -> list[str]:
        """Names of the files that were set aside."""
        return [item.file for item in self.items if not item.accepted]


def intake(
    incoming: Path,
    accepted: Path,
    quarantine: Path,
    model: mujoco.MjModel,
    contracts: Mapping[str, dict[str, Any]] | None = None,
    tick: Callable[[str], None] = lambda file: None,
    limits: Thresholds | None = None,
) -> IntakeSummary:
    """Check every rollout of a folder and sort it.

    Args:
        incoming: a dataset folder (rollouts/*.parquet) or a folder of *.parquet; only read.
        accepted: folder for copies of the files that can be used.
        quarantine: folder for copies of the others, each with `<file>.findings.json`.
        model: the declared model.
        contracts: cluster -> contract.json of the policy that was deployed for it; "" holds for every cluster.
        tick: called with each file's name when it is done.
        limits: what still passes.
    """
    items, findings = [], []
    for source in incoming_files(incoming):
        item, found = _take(source, accepted, quarantine, lambda path: _check(path, model, contracts or {}, limits))
        items.append(item)
        findings += found
        tick(source.name)
    return IntakeSummary(tuple(items), findings_table(findings))


def incoming_files(folder: Path) -> list[Path]:
    """The Parquet files of a dataset folder or a plain folder, by name."""
    folder = Path(folder)
    if not folder.is_dir():
        raise BadInput(folder, "a folder of measured rollouts", "no such folder")
    inner = folder / "rollouts"
    files = (inner if inner.is_dir() else folder).glob("*.parquet")
    return sorted(file for file in files if not file.name.startswith("."))


def findings_table(findings: Iterable[Finding]) -> pd.DataFrame:
    """Findings as a table, in the order in which they were made."""
    table = pd.DataFrame([finding.as_dict() for finding in findings], columns=list(FINDING_COLUMNS))
    return table.astype({"row": "Int64", "fatal": bool})


def merge(summaries: Iterable[IntakeSummary]) -> IntakeSummary:
    """Several folders' summaries as one."""
    summaries = list(summaries)
    tables = [summary.findings for summary in summaries if len(summary.findings)]
    items = tuple(item for summary in summaries for item in summary.items)
    return IntakeSummary(items, pd.concat(tables, ignore_index=True) if tables else findings_table([]))


def _take(
    source: Path,
    accepted: Path,
    quarantine: Path,
    check: Callable[[Path], tuple[Rollout | None, list[Finding]]],
) -> tuple[Item, list[Finding]]:
    shown = _shown(source.name)
    try:
        digest = file_hash(source)
    except BadInput as error:  # there is nothing that could be copied, only something to tell
        found = Finding(shown, "", None, "readable", error.expected, error.came, fatal=True)
        _note(quarantine / source.name, shown, "", [found])
        return Item(shown, "", False, "", "", 0.0, ()), [found]
    rollout, findings = check(source)
    fatal = any(finding.fatal for finding in findings)
    place = accepted / source.name
    if place.exists():
        same = file_hash(place) == digest
        if not same or fatal:
            came = "a file of that name that was accepted before" + ("" if same else ", with other content")
            findings.append(Finding(shown, "", None, "name-taken", "a name that is free", came, fatal=True))
            fatal = True
    elif not fatal:
        copy_new(source, place)
    if fatal:
        _set_aside(source, digest, quarantine, findings)
    meta = rollout.meta if rollout else {}
    return Item(
        shown,
        digest,
        not fatal,
        str(meta.get("motion", "")),
        str(meta.get("cluster", "")),
        round(rollout.duration, 6) if rollout and np.isfinite(rollout.duration) else 0.0,
        rollout.joints if rollout else (),
    ), findings


def _check(
    source: Path, model: mujoco.MjModel, contracts: Mapping[str, dict[str, Any]], limits: Thresholds | None
) -> tuple[Rollout | None, list[Finding]]:
    name = _shown(source.name)
    try:
        rollout = read_rollout(source)
    except BadRollout as bad:
        return None, [Finding(name, bad.column, None, bad.rule, bad.expected, bad.came, fatal=True)]
    contract = contracts.get(str(rollout.meta.get("cluster", "")), contracts.get(""))
    try:
        return rollout, check_rollout(rollout, model, contract, name, limits)
    except BadInput:
        raise
    except Exception as error:  # one file that a check stumbles over must not keep a batch of good ones from its end
        came = f"{type(error).__name__}: {error}"[:200]
        return rollout, [Finding(name, "", None, UNFORESEEN, "a file that the checks can judge", came, fatal=True)]


def _shown(name: str) -> str:
    """A file's name as text that every file and page can hold; bytes that are no UTF-8 become question marks."""
    return name.encode("utf-8", "replace").decode()


def _set_aside(source: Path, digest: str, quarantine: Path, findings: list[Finding]) -> None:
    place = quarantine / source.name
    if len(os.fsencode(source.name)) > LONGEST_NAME:
        place = quarantine / f"{safe_stem(source.stem)}.{digest[:12]}{source.suffix}"
    if place.exists() and file_hash(place) != digest:
        place = quarantine / f"{source.stem}.{digest[:12]}{source.suffix}"
    if not place.exists():
        copy_new(source, place)
    _note(place, _shown(source.name), digest, findings)


def _note(place: Path, file: str, digest: str, findings: list[Finding]) -> None:
    """Write the findings as JSON beside the file that was set aside."""
    notes = place.with_name(f"{place.name}.findings.json")
    table = {"file": file, "sha256": digest, "findings": [finding.as_dict() for finding in findings]}
    if not notes.exists():
        write_new(notes, json.dumps(table, indent=1, ensure_ascii=False, default=str).encode())


def copy_new(source: Path, target: Path) -> None:
    """Copy a file; the copy appears whole, and an existing one is never replaced."""
    with _appearing(target) as temporary:
        shutil.copyfile(source, temporary)


def write_new(target: Path, content: bytes) -> None:
    """Write a new file; it appears whole, and an existing one is never replaced."""
    with _appearing(target) as temporary:
        temporary.write_bytes(content)


@contextlib.contextmanager
def _appearing(target: Path) -> Iterator[Path]:
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=".", suffix=".part")
    os.close(handle)
    try:
        yield Path(name)
        os.chmod(name, 0o644)
        try:
            os.link(name, target)  # fails where the target exists; os.replace would not
        except FileExistsError:
            raise BadInput(target, "a name that is free", "a file that exists") from None
        except OSError:  # a file system without hard links
            if target.exists():
                raise BadInput(target, "a name that is free", "a file that exists") from None
            os.replace(name, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
