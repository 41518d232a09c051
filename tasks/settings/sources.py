"""The files and folders that params.yaml names: each is looked for before the first stage, not when its stage comes."""

from pathlib import Path
from typing import Any

from bumblebee.clustering.text import encoder_folder
from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.policy import FILE as POLICY
from bumblebee.robot.facts import ROBOT
from tasks.running import paths
from tasks.settings.filter_files import SHIPPED


def check_sources(found: dict[str, Any], path: Path) -> None:
    """Refuse a source that is not there.

    Args:
        found: the sections by name, as their dataclasses.
        path: the file that they come from.

    Raises:
        BadInput: naming the key.
    """
    motions, rollouts, ingest = found["motions"], found["rollouts"], found["ingest"]
    if ROBOT != pretrained.THEIRS:
        _require_own(found, path)
    if found["base"].init == "own" and not (paths.POLICY / POLICY).is_file():
        came = f"no {POLICY} in {paths.POLICY}"
        raise BadInput(f"{path}: base.init", "a policy of `bumblebee train`", came, "make demo POLICY=<folder>")
    if motions.source != "embedded":
        place, wanted = f"{path}: motions.source", "a folder of motions or 'embedded'"
        _require(_at_home(motions.source, place, wanted), place, wanted, either=True)
    try:
        motions.read.require_skeleton()
    except BadInput as error:
        raise BadInput(f"{path}: motions.read.skeleton: {error.where}", error.expected, error.came, error.do) from None
    texts = motions.read.describe
    for key, wanted in (("captions_folder", "a folder of captions"), ("humanml3d", "HumanML3D's folder")):
        if getattr(texts, key):
            _require(Path(getattr(texts, key)).expanduser(), f"{path}: motions.read.describe.{key}", wanted)
    if texts.captions_csv and not Path(texts.captions_csv).expanduser().is_file():
        came = f"{texts.captions_csv}: no such file"
        raise BadInput(f"{path}: motions.read.describe.captions_csv", "a CSV file of captions", came)
    rules = found["filter"]
    if rules.overrule and not Path(rules.overrule).is_file():
        raise BadInput(f"{path}: filter.overrule", "a CSV or YAML file", f"{rules.overrule}: no such file")
    if rules.policy.source not in ("", SHIPPED):
        _require(
            Path(rules.policy.source), f"{path}: filter.policy.source", f"{SHIPPED!r} or an exported policy's folder"
        )
    try:
        encoder_folder(found["cluster"].text_encoder)
    except BadInput as error:
        raise BadInput(f"{path}: cluster.text_encoder", error.expected, error.came, error.do) from None
    if rollouts.source is not None:
        _require(rollouts.source, f"{path}: rollouts.source", "a folder of measured rollouts")
    before = _before_round(ingest.incoming)
    if before.parts[:1] != paths.DATA.parts:
        _require(before, f"{path}: ingest.incoming", "a folder of measured rollouts")
    if ingest.model and not Path(ingest.model).is_file():
        raise BadInput(f"{path}: ingest.model", "an MJCF file", f"{ingest.model}: no such file")


def _require_own(found: dict[str, Any], path: Path) -> None:
    """Refuse what comes along for our G1 alone, of another robot's loop."""
    needs = (
        ("motions.source", found["motions"].source == "embedded", "a folder of motions", "make demo MOTIONS=<folder>"),
        ("base.init", found["base"].init not in ("own", "scratch"), "own or scratch", "make demo POLICY=<folder>"),
        ("filter.policy.source", found["filter"].policy.source == SHIPPED, "an exported policy's folder", ""),
    )
    for key, wrong, wanted, do in needs:
        if wrong:
            came = f"what comes along for {pretrained.THEIRS}, and this is {ROBOT}"
            raise BadInput(f"{path}: {key}", wanted, came, do)


def _require(place: Path, key: str, wanted: str, either: bool = False) -> None:
    """Refuse what is no folder (`either`: nor a file)."""
    if place.is_dir() or (either and place.is_file()):
        return
    raise BadInput(key, wanted, f"{place}: {'no folder' if place.exists() else 'nothing there'}")


def _at_home(name: str, key: str, wanted: str) -> Path:
    """The path, `~` replaced."""
    try:
        return Path(name).expanduser()
    except RuntimeError:
        raise BadInput(key, wanted, f"{name}: no such user") from None


def _before_round(incoming: str) -> Path:
    """Path before the part that is another in each round."""
    parts = Path(incoming).parts
    changing = [index for index, part in enumerate(parts) if "{" in part]
    return Path(*parts[: changing[0]]) if changing else Path(incoming)
