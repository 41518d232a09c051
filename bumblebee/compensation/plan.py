"""From the effects that a diagnosis found to a compensation, and to what is said about each of them."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import mujoco

from bumblebee.compensation.draft import DeclaredRobot, Draft
from bumblebee.compensation.limits import CompensationLimits
from bumblebee.compensation.numbers import Compensation, PlannedEffect
from bumblebee.effects.kind import CannotUndo
from bumblebee.errors import BadInput
from bumblebee.measured.model_file import load_model
from bumblebee.robot.facts import joint_names, robot_bodies
from bumblebee.robot.model import build_model
from bumblebee.sim.effects import CATALOGUE, Effect, effects_yaml, read_effects, read_term

LEAVE_OUT = "Take it out, or pass --leave-out to start without it."


def compensate(
    effects: Sequence[Effect],
    model: mujoco.MjModel | None = None,
    limits: CompensationLimits | None = None,
    leave_out: bool = False,
    where: object = "effects",
    effects_sha256: str = "",
) -> Compensation:
    """Plan what undoes `effects` at the joints of the G1.

    Args:
        effects: what the robot has and the model has not.
        model: the one that the policy was trained on; the declared G1 by default.
        limits: how much may be done.
        leave_out: whether to go on without effects that cannot be undone; the plan then says why.
        where: the effects' file, for messages.
        effects_sha256: its hash; that of the effects' text by default.

    Raises:
        BadInput: for the first effect beyond a limit, on a joint or body that the G1 does not have, or that no drive
            can undo, unless `leave_out`.
    """
    draft = Draft(DeclaredRobot.of(build_model() if model is None else model), limits or CompensationLimits())
    plan: list[PlannedEffect] = []
    refused: list[BadInput] = []
    for index, effect in enumerate(effects):
        place = f"{where}: effects[{index}]: {effect.effect}"
        attempt = draft.copy()
        try:
            done, size = CATALOGUE[effect.effect].undo(attempt, effect, _columns(place, effect))
            attempt.check(effect, place)
            draft = attempt
            plan.append(PlannedEffect(effect.effect, effect.where, done, size, ""))
        except CannotUndo as reason:
            refused.append(BadInput(place, "an effect that can be undone at the joint", str(reason), LEAVE_OUT))
            plan.append(PlannedEffect(effect.effect, effect.where, "", "", str(reason)))
        except BadInput as error:
            refused.append(BadInput(error.where, error.expected, error.came, LEAVE_OUT))
            why = f"expected {error.expected}, came {error.came}"
            plan.append(PlannedEffect(effect.effect, effect.where, "", "", why))
    if refused and not leave_out:
        first = refused[0]
        more = f" (and {len(refused) - 1} more)" if len(refused) > 1 else ""
        raise BadInput(first.where, first.expected, first.came + more, first.do)
    digest = effects_sha256 or hashlib.sha256(effects_yaml(effects).encode()).hexdigest()
    return draft.finished(digest, tuple(plan))


def compensate_file(
    path: Path, model: Path | None = None, limits: CompensationLimits | None = None, leave_out: bool = False
) -> Compensation:
    """Plan what undoes the effects of an `effects.yaml`; `model` is the MJCF that the policy was trained on."""
    effects = read_effects(path)
    digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()
    declared = load_model(model) if model else build_model()
    DeclaredRobot.of(declared, model or "model")  # says which file, if it is another robot's
    return compensate(effects, declared, limits, leave_out, path, digest)


def _columns(place: str, effect: Effect) -> list[int]:
    """Columns of an effect's joints; a place that the G1 does not have is a `BadInput`."""
    names, kind = joint_names(), CATALOGUE[effect.effect]
    if kind.on == "body":
        if unknown := [name for name in effect.where if name not in robot_bodies()]:
            raise BadInput(place, "a body of the G1", f"{unknown[0]!r}, of another robot")
        return []
    if kind.on != "joint":
        return []
    others = [o for text in effect.parameters for o in read_term(text).others] if effect.effect == "discovered" else []
    if unknown := [name for name in (*effect.where, *others) if name not in names]:
        raise BadInput(place, "a joint of the G1", f"{unknown[0]!r}, of another robot")
    return [names.index(name) for name in effect.where] or list(range(len(names)))
