"""Whether a command's input is there, asked before anything is imported that takes seconds."""

import os
import shlex
from pathlib import Path

from bumblebee.errors import BadInput


def require_there(path: Path, expected: str, do: str = "") -> None:
    """`BadInput` where nothing lies at `path`; without `do` it says how to see what is there."""
    if not os.path.lexists(path):  # False for a name that the system refuses, too
        raise BadInput(path, expected, "no such file or folder", do or _look(path))


def _look(path: Path) -> str:
    near = next(folder for folder in Path(os.path.abspath(path)).parents if os.path.isdir(folder))
    return f"`ls {shlex.quote(str(near))}` lists what is there."


def require_motions(path: Path) -> None:
    """`BadInput` where no folder with motion files, and no such file, lies at `path`."""
    require_there(path, "a folder with motion files, or a motion file")


def require_logs(model: Path, dataset: Path) -> None:
    """`BadInput` where a model or the folder of its rollouts is not there, or each stands in the other's place."""
    if model.is_dir() and dataset.is_file():
        do = f"Exchange the two: {shlex.join([str(dataset), str(model)])}"
        raise BadInput(model, "an MJCF file, and after it the folder of its rollouts", "the folder first", do)
    require_there(model, "an MJCF file")
    require_there(dataset, "a dataset folder that holds rollouts/*.parquet")
