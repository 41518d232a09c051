"""In which rollouts a robot touches something that its model lacks: what a person can look at, or take away."""

from collections.abc import Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.thresholds.report import Verdicts
from bumblebee.sim.effects import Effect

KIND = "surface_contact"


def surface_notes(session: Session, effects: Sequence[Effect], rule: Verdicts) -> list[str]:
    """A note for each contact with a surface: where it is, which rollouts reach it, for what share of the time."""
    notes = []
    for effect in effects:
        if effect.effect == KIND:
            where, (height, *point, _) = effect.where[0], effect.values()
            reached = [
                (_share_below(session, i, where, point, height + rule.touch), i) for i in range(len(session.rollouts))
            ]
            most = sorted(((share, i) for share, i in reached if share > 0), reverse=True)
            told = ", ".join(f"{session.ids([i])[0]} {share:.0%}" for share, i in most[: rule.touching])
            more = f" and {len(most) - rule.touching} more" if len(most) > rule.touching else ""
            place = ", ".join(f"{x:.3f}" for x in point)
            notes.append(
                f"{where} touches something level that the model lacks, {height:.3f} m above the model's origin if the "
                f"point that touches is ({place}) m in the body's frame; a higher point and a higher surface fit "
                f"alike. Reached in {told or 'no rollout'}{more}. Where the robot will not meet it, leave it out of "
                "effects.yaml"
            )
    return notes


def _share_below(session: Session, index: int, body: str, point: Sequence[float], height: float) -> float:
    """Share of a rollout's ticks at which a point (3,) of a body, in its frame, is below a height [m]."""
    plant = session.plant
    data, number = mujoco.MjData(plant.model), int(plant.model.body(body).id)
    below = 0
    for joint_pos in session.rollouts[index].joint_pos:
        data.qpos[plant.qpos] = joint_pos
        mujoco.mj_kinematics(plant.model, data)
        below += bool(data.xpos[number, 2] + data.xmat[number, 6:9] @ np.asarray(point) < height)
    return below / len(session.rollouts[index].joint_pos)
