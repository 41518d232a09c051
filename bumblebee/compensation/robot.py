"""Whether effects and model are the G1's: only its policies have a runner that compensates."""

from collections.abc import Iterable
from pathlib import Path

from bumblebee.compensation.draft import ONLY_G1, DeclaredRobot
from bumblebee.errors import BadInput
from bumblebee.io.read import read_json
from bumblebee.measured.model_file import load_model
from bumblebee.robot.facts import joint_names, robot_bodies
from bumblebee.sim.effects import CATALOGUE, read_effects


def require_g1(effects: Path, model: Path | None = None) -> None:
    """`BadInput` where the effects, the diagnosis beside them or the model are another robot's.

    Effects are where no joint or body that they name is the G1's, a diagnosis where no joint of its robot is.

    Args:
        effects: `effects.yaml`; a `diagnosis.json` beside it says which joints the robot has.
        model: MJCF that the policy was trained on, if it is not the declared G1.
    """
    places = [place for e in read_effects(effects) if CATALOGUE[e.effect].on in ("joint", "body") for place in e.where]
    _refuse_others(effects, places)
    document = effects.parent / "diagnosis.json"
    told = read_json(document) if document.is_file() else {}
    units = told.get("units") if isinstance(told, dict) else None
    _refuse_others(document, units if isinstance(units, dict) else ())
    if model:
        DeclaredRobot.of(load_model(model), model)


def _refuse_others(where: Path, names: Iterable[str]) -> None:
    names = list(names)
    if names and not {*joint_names(), *robot_bodies()}.intersection(names):
        raise BadInput(where, "joints and bodies of the G1", f"{names[0]!r}, of another robot", ONLY_G1)
