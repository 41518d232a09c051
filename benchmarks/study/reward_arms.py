"""The paper's printed reward table, ours, and the tables between them, a change at a time."""

from dataclasses import dataclass, replace

from bumblebee.learning.config import PpoConfig
from bumblebee.tracking.config import RewardConfig
from bumblebee.tracking.rewards import DEMO_SHARPNESS, DEMO_WEIGHTS


@dataclass(frozen=True)
class Arm:
    """A reward and the actions' first deviation."""

    told: str
    rewards: RewardConfig
    std: float = 0.2


def arms() -> dict[str, Arm]:
    """Each with all changes of those before it, ours the last."""
    printed = RewardConfig(preset="paper")
    ramped = replace(printed, ramp_start=0.05, ramp_share=0.5)
    steps = (
        ("actions", "action terms a hundredth", ("action_rate", "action_smoothness"), 0.01),
        ("limits", "limits as ours", ("torque_limits", "dof_position_limits", "dof_velocity_limits"), None),
        ("feet", "feet as ours", ("feet_orientation",), None),
    )
    out = {
        "printed": Arm("as printed", printed, 1.0),
        "ramped": Arm("first deviation .2, penalties from .05 up over half of the training", ramped),
        "floor": Arm("the same, a step earns at least 0", replace(ramped, floor=0.0)),
    }
    weights: dict[str, float] = {}
    for name, told, terms, factor in steps:
        weights |= {t: -2.0 * factor if factor else DEMO_WEIGHTS[t] for t in terms}
        out[name] = Arm(
            f"ramped, {told}" if name == "actions" else f"and {told}", replace(ramped, weights=dict(weights))
        )
    gentle = replace(ramped, weights=dict(weights), sharpness=dict(DEMO_SHARPNESS))
    return out | {
        "kernels": Arm("and kernels as ours", gentle),
        "ours": Arm("ours", RewardConfig(), PpoConfig().initial_std),
    }
