"""Whether DVC looks at the folders that a stage reads: one that it does not know could change unnoticed."""

import os
from collections.abc import Mapping
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from tasks.running import paths

STAGES = Path("dvc.yaml")


def require_watched(stage: str, folders: Mapping[str, str | Path]) -> None:
    """Refuse a folder that is no dependency of the stage, where DVC runs it.

    Args:
        stage: its name in dvc.yaml, and its section in params.yaml.
        folders: key of the section -> the folder or file that it names; "" for none.

    Raises:
        BadInput: a change there would make nothing stale.
    """
    if "DVC_STAGE" not in os.environ:
        return
    known = [Path(os.path.realpath(dep)) for dep in dependencies(stage)]
    for key, folder in folders.items():
        place = Path(os.path.realpath(Path(folder).expanduser()))
        if str(folder) and not any(place.is_relative_to(dep) for dep in known):
            raise BadInput(
                f"params.yaml: {stage}.{key}",
                f"a folder in {paths.RAW}, or another dependency of the stage {stage} in {STAGES}",
                f"{folder}, whose changes DVC would not notice",
                f"Move it there and `dvc add` it, or `make demo MOTIONS={folder}`.",
            )


def dependencies(stage: str) -> list[str]:
    """The paths that dvc.yaml names for a stage, as they stand there."""
    deps = read_yaml(STAGES)["stages"][stage]["deps"]
    return [dep if isinstance(dep, str) else next(iter(dep)) for dep in deps]
