"""Where a command may write: never over what it reads, and over nothing but an earlier result of the same command."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.io.read import read_json, read_text
from bumblebee.io.write import refuse_entering, try_output

_OWN = replace(LIMITS, text_bytes=1 << 28, nodes=20_000_000)  # our own results may be larger than settings
_FILE = re.compile(r"""\b(?:file|fileright|filefront|fileback|fileleft|fileup|filedown)\s*=\s*["']([^"']+)["']""")
_DIRECTORY = re.compile(r"""\b(?:meshdir|texturedir|assetdir)\s*=\s*["']([^"']*)["']""")
_OVERWRITE = "Add --overwrite to replace it."


@dataclass(frozen=True)
class Result:
    """A folder that a command writes, as it is recognised."""

    what: str
    document: str
    """Its JSON file."""
    keys: frozenset[str]
    """Some that the JSON has."""
    files: frozenset[str]
    """All names that may lie in it."""


DIAGNOSIS = Result(
    "a diagnosis", "diagnosis.json", frozenset({"effects", "unexplained", "error"}),
    frozenset({"diagnosis.json", "model.xml", "effects.yaml", "report.html"}),
)  # fmt: skip
GAP = Result(
    "a gap report", "gap.json", frozenset({"missing_torque", "reported_torque", "error"}),
    frozenset({"gap.json", "gap.html"}),
)  # fmt: skip


def inputs_of(model: Path, dataset: Path, *more: Path | None) -> list[Path]:
    """Inputs of a command: the model with all files that it names, the dataset, and `more`."""
    return [Path(dataset) / "rollouts", Path(dataset), *model_files(model), *(path for path in more if path)]


def claim_folder(out: Path, result: Result, overwrite: bool, inputs: Sequence[Path]) -> None:
    """See that a result may be written at `out` and that the disk takes it, before the work; else `BadInput`."""
    refuse_entering(out, inputs)
    try_output(out)
    refuse_folder(out, result, overwrite)


def claim_file(out: Path, overwrite: bool, inputs: Sequence[Path]) -> None:
    """Claim the file of errors that `replay` writes."""
    refuse_entering(out, inputs)
    try_output(out)
    refuse_file(out, overwrite)


def refuse_folder(out: Path, result: Result, overwrite: bool) -> None:
    """`BadInput` where something lies at `out`, unless it is an earlier result and may be replaced."""
    if not os.path.lexists(out):
        return
    expected = f"a new folder, or {result.what} to replace"
    if out.is_symlink() or not out.is_dir():
        raise BadInput(out, expected, "a link" if out.is_symlink() else "a file", "Choose another name.")
    if names := sorted(os.listdir(out)):
        if foreign := _foreign(out, result, names):
            raise BadInput(out, expected, f"a folder that holds {foreign}", "Choose another name.")
        if not overwrite:
            raise BadInput(out, "a folder that does not exist yet", f"{result.what} from before", _OVERWRITE)


def refuse_file(out: Path, overwrite: bool) -> None:
    """`BadInput` where something lies at `out`, unless it is a file of errors and may be replaced."""
    if not os.path.lexists(out):
        return
    came = "a link" if out.is_symlink() else "a folder" if out.is_dir() else None
    if came is None and not _is_errors(out):
        came = "another file" if out.is_file() else "a device or a pipe"
    if came:
        raise BadInput(out, "a new file, or one that `replay` wrote to replace", came, "Choose another name.")
    if not overwrite:
        raise BadInput(out, "a file that does not exist yet", "errors from before", _OVERWRITE)


def model_files(model: Path) -> list[Path]:
    """The MJCF file and those that it names: includes, meshes, textures; as far as they exist."""
    found, waiting = [Path(model)], [Path(model)]
    home = Path(model).parent
    folders = [home]
    while waiting:
        text = _text(waiting.pop())
        folders += [home / name for name in _DIRECTORY.findall(text)]
        for name in _FILE.findall(text):
            for path in [folder / name for folder in folders]:
                if path.is_file() and path not in found:
                    found.append(path)
                    waiting += [path] if path.suffix == ".xml" else []
    return found


def _foreign(out: Path, result: Result, names: Sequence[str]) -> str | None:
    """First entry of a folder that is not of our making, if any."""
    for name in names:
        path = out / name
        if name not in result.files or path.is_symlink() or not path.is_file():
            return repr(name)
    if result.document not in names:
        return f"no {result.document}"
    content = _json(out / result.document)
    ours = isinstance(content, dict) and content.get("schema") == 1 and result.keys <= set(content)
    return None if ours else f"a {result.document} of another kind"


def _is_errors(path: Path) -> bool:
    content = _json(path)
    blocks = list(content.values()) if isinstance(content, dict) else []
    return bool(blocks) and all(isinstance(b, dict) and {"joint_pos_rmse", "chi2"} <= set(b) for b in blocks)


def _json(path: Path) -> object:
    try:
        return read_json(path, _OWN)
    except BadInput:
        return None


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except BadInput:
        return ""
