"""A run sheet as sheet.json, and its line for a motion that is about to be run."""

import json
from dataclasses import asdict, fields
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.evaluation.contract import clip_digest
from bumblebee.io.read import read_json
from bumblebee.motion.clip import Clip
from bumblebee.wire.operator.sheet import Sheet, Tried, outcome
from bumblebee.wire.safety.limits import Limits

NAME = "sheet.json"
_SCHEMA = 1
_AGAIN = "Make a sheet of this policy, motion and limits: bumblebee deploy sheet --help"


def as_json(sheet: Sheet) -> str:
    """Text of sheet.json."""
    return json.dumps({"sheet": _SCHEMA, **asdict(sheet)}, indent=1, allow_nan=False) + "\n"


def read_sheet(path: Path) -> Sheet:
    """Read a sheet, or the one in a folder.

    Raises:
        BadInput: no sheet, or one of another version.
    """
    file = path / NAME if path.is_dir() else path
    content = read_json(file)
    version = content.pop("sheet", None) if isinstance(content, dict) else None
    try:
        if version != _SCHEMA:
            raise TypeError(f"version {str(version)[:20]}")
        tried = tuple(_tried(one) for one in content.pop("tried"))
        return Sheet(tried=tried, untried=tuple(content.pop("untried")), **content)
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        came = str(error)[:80] or type(error).__name__
        raise BadInput(
            file, f"a run sheet of version {_SCHEMA}", came, "Make it anew: bumblebee deploy sheet --help"
        ) from None


def before_run(sheet: Sheet, sha256: str, clip: Clip, limits: Limits) -> str:
    """The sheet's line for a run: its place, what came in simulation, what to watch.

    Raises:
        BadInput: a sheet of another policy, other limits or other motions, which says nothing about this run.
    """
    place = next((k for k, one in enumerate(sheet.tried) if one.motion == clip.name), None)
    if sheet.sha256 != sha256:
        raise BadInput("--sheet: policy", f"the one that is run, {sha256[:12]}", str(sheet.sha256)[:12], _AGAIN)
    if place is None:
        raise BadInput("--sheet", f"the motion {clip.name}", "a sheet without it", _AGAIN)
    if sheet.tried[place].sha256 != clip_digest(clip):
        raise BadInput(f"--sheet: {clip.name}", "the motion that is run", "another of this name", _AGAIN)
    now = asdict(limits)
    if other := [key for key, value in now.items() if sheet.limits.get(key) != value]:
        came = f"{sheet.limits.get(other[0])} on the sheet"
        raise BadInput(f"--sheet: limits: {other[0]}", f"{now[other[0]]}, as it is run", came, _AGAIN)
    one = sheet.tried[place]
    return f"run sheet: {place + 1} of {len(sheet.tried)} by risk; in simulation it {outcome(one)}; watch {watch(one)}"


def watch(tried: Tried) -> str:
    """Rules that come nearest to damping, each with its joint, share of the limit and time."""
    words = []
    for rule in tried.watch:
        share, joint, at = tried.uses[rule]
        words.append(f"{rule}{f' of {joint}' if joint else ''} ({100 * share:.0f} % of its limit at {at:.1f} s)")
    return ", ".join(words)


def _tried(content: dict[str, object]) -> Tried:
    names = {field.name for field in fields(Tried)}
    if set(content) != names:
        raise TypeError(f"a motion with {', '.join(sorted(set(content) ^ names))[:60]}")
    made = Tried(**content)  # type: ignore[arg-type]
    numbers = (made.seconds, made.robots, made.fell, made.damped, made.share, *made.ci95, made.tilt_deg, made.room_rad)
    uses = {rule: (float(share), str(joint), float(at)) for rule, (share, joint, at) in made.uses.items()}
    [float(number) for number in numbers]
    for rule in made.watch:
        uses[rule]
    return Tried(**{**content, "uses": uses, "watch": tuple(made.watch), "ci95": tuple(made.ci95)})  # type: ignore[arg-type]
