"""dvc.lock as a stage reads it while another one may be writing it.

DVC writes the file in place, and reads it before it takes its lock: who looks at that moment finds nothing, or a
beginning, which may well be YAML. A file that was just written to is looked at again.
"""

import time
from functools import cache
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput

FILE = Path("dvc.lock")
QUIET = 0.3  # s without a change, after which nobody is writing: DVC's longest pause is a block of 8 KB
LOOKS, PAUSE = 20, 0.1  # s: a lock file of 10,000 stages is written in less than two


def settle(path: Path = FILE) -> None:
    """Wait until nobody is writing the file, two seconds at most; not at all for one that is at rest or not there."""
    for _ in range(LOOKS):
        try:
            changed = path.stat().st_mtime
        except FileNotFoundError:
            return
        if not 0 <= time.time() - changed < QUIET:
            return
        time.sleep(PAUSE)


def locked_stages(path: Path = FILE) -> dict[str, Any]:
    """The stages of a lock file; none where there is no file.

    Raises:
        BadInput: for a file that stays empty or cut off.
    """
    said = ""
    for _ in range(LOOKS):
        settle(path)
        if not path.exists():
            return {}
        try:
            return _parsed(path.read_text(encoding="utf-8"))
        except ValueError as error:
            said = str(error)
        time.sleep(PAUSE)
    raise damaged(path, said)


def damaged(path: Path, said: str) -> BadInput:
    """The one line for a lock file that a kill left half written; `dvc repro` restores every stage's run without it."""
    do = "Remove it: what is in DVC's run cache is not computed again."
    return BadInput(path, "DVC's lock file with its stages", " ".join(said.split()), do)


@cache
def _parsed(text: str) -> dict[str, Any]:
    """Read once, since a policy's history is asked for again and again; ValueError for what is no lock file."""
    import yaml

    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())[:200]) from None
    stages = content.get("stages", {}) if isinstance(content, dict) else None
    if not isinstance(stages, dict) or not all(isinstance(stage, dict) for stage in stages.values()):
        raise ValueError(f"{len(text)} characters without whole stages")
    return stages


def read_whole() -> None:
    """Let DVC, in this process, read its lock file only when nobody is writing it, and again where it is cut off."""
    from dvc.dvcfile import Lockfile
    from dvc.utils.strictyaml import YAMLSyntaxError, YAMLValidationError

    read = Lockfile._load
    if getattr(read, "patient", False):
        return

    def patient(self: Lockfile, **options: object) -> Any:
        for _ in range(LOOKS - 1):
            settle(Path(self.path))
            try:
                return read(self, **options)
            except (YAMLSyntaxError, YAMLValidationError):
                time.sleep(PAUSE)
        return read(self, **options)

    patient.patient = True  # type: ignore[attr-defined]
    Lockfile._load = patient
