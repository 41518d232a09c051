"""The plan's folder: the runs as CSV and Parquet, `plan.json` and the run sheet; whole or not at all."""

import hashlib
import io
import json
import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.diagnosis.plan.config import Gain
from bumblebee.diagnosis.plan.plan import Plan
from bumblebee.diagnosis.plan.predicted import refuse_idle
from bumblebee.diagnosis.plan.written.document import document, run_names
from bumblebee.diagnosis.plan.written.sheet import sheet
from bumblebee.errors import BadInput
from bumblebee.io.read import read_json
from bumblebee.io.write import new_folder, refuse_entering, try_output

PARQUET_KEY = b"bumblebee.plan"
_RUNS, _DOCUMENT, _SHEET = "runs", "plan.json", "sheet.html"


def claim_plan(out: Path, overwrite: bool, inputs: list[Path]) -> None:
    """See that a plan may be written at `out` and that the disk takes it, before the work; else `BadInput`."""
    refuse_entering(out, inputs)
    try_output(out)
    refuse_plan(out, overwrite)


def refuse_plan(out: Path, overwrite: bool) -> None:
    """`BadInput` where something lies at `out`, unless it is an earlier plan and may be replaced."""
    if not os.path.lexists(out):
        return
    expected = "a new folder, or a plan to replace"
    if out.is_symlink() or not out.is_dir():
        raise BadInput(out, expected, "a link" if out.is_symlink() else "a file", "Choose another name.")
    if not os.listdir(out):
        return
    if foreign := _foreign(out):
        raise BadInput(out, expected, f"a folder that holds {foreign}", "Choose another name.")
    if not overwrite:
        raise BadInput(out, "a folder that does not exist yet", "a plan from before", "Add --overwrite to replace it.")


def write_plan(plan: Plan, out: Path, overwrite: bool = False) -> dict:
    """Write the folder; the document that lies in it. `overwrite` replaces an earlier plan and nothing else.

    `BadInput`, and nothing written, where effects are open and the plan tells none of them apart.
    """
    tables = {name: csv_of(plan, k) for k, name in enumerate(run_names(plan))}
    told = document(plan, hashlib.sha256("".join(tables.values()).encode()).hexdigest())
    refuse_idle(told)
    page = sheet(plan, told)
    refuse_plan(out, overwrite)  # time has passed since the command looked
    with new_folder(out) as folder:
        (folder / _RUNS).mkdir()
        for k, (name, table) in enumerate(tables.items()):
            (folder / _RUNS / f"{name}.csv").write_text(table, encoding="utf-8")
            (folder / _RUNS / f"{name}.parquet").write_bytes(parquet_of(plan, k))
        (folder / _DOCUMENT).write_text(json.dumps(told, indent=1, allow_nan=False), encoding="utf-8")
        (folder / _SHEET).write_text(page, encoding="utf-8")
    return told


def csv_of(plan: Plan, k: int) -> str:
    """Header `time` and the driven joints' names; a row a tick, time [s] from 0, targets [rad], [m] for slides."""
    names, values = _table(plan, k)
    lines = [",".join(_quoted(name) for name in ("time", *names))]
    lines += [",".join(f"{v:.9g}" for v in row) for row in values]
    return "\n".join(lines) + "\n"


def parquet_of(plan: Plan, k: int) -> bytes:
    """Parquet file of the same columns as float64; the player's further facts are JSON under `bumblebee.plan`."""
    names, values = _table(plan, k)
    motion, machine = plan.motions[k], plan.machine
    about = {"schema": 1, "run": run_names(plan)[k], "rate": machine.rate, "factors": motion.gain._asdict()}
    if motion.gain != Gain() or machine.tracked:
        about |= {"joints": list(machine.joints)}
        about |= {"kp": (motion.gain.kp * machine.kp).tolist(), "kd": (motion.gain.kd * machine.kd).tolist()}
    table = pa.table(dict(zip(("time", *names), values.T, strict=True)))
    stream = io.BytesIO()
    pq.write_table(table.replace_schema_metadata({PARQUET_KEY: json.dumps(about)}), stream, compression="zstd")
    return stream.getvalue()


def _table(plan: Plan, k: int) -> tuple[list[str], np.ndarray]:
    """Names of the driven joints, and (T, 1 + J) time and targets, rounded as the CSV has them."""
    machine, motion = plan.machine, plan.motions[k]
    time = np.arange(len(motion.shape)) / machine.rate
    values = np.concatenate((time[:, None], motion.targets[:, machine.moved]), axis=1)
    names = [name for name, moved in zip(machine.joints, machine.moved, strict=True) if moved]
    return names, np.array([[float(f"{v:.9g}") for v in row] for row in values])


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if set(name) & set(',"\n\r') else name


def _foreign(out: Path) -> str | None:
    """First entry of a folder that is not of a plan's making, if any."""
    names = sorted(os.listdir(out))
    for name in names:
        path = out / name
        if path.is_symlink() or name not in (_RUNS, _DOCUMENT, _SHEET) or path.is_dir() != (name == _RUNS):
            return repr(name)
    if _DOCUMENT not in names:
        return f"no {_DOCUMENT}"
    for path in sorted((out / _RUNS).iterdir()) if _RUNS in names else ():
        if path.is_symlink() or not path.is_file() or path.suffix not in (".csv", ".parquet"):
            return repr(f"{_RUNS}/{path.name}")
    try:
        content = read_json(out / _DOCUMENT)
    except BadInput:
        content = None
    ours = isinstance(content, dict) and content.get("schema") == 1 and content.get("kind") == "plan"
    return None if ours else f"a {_DOCUMENT} of another kind"
