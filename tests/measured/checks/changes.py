"""Changes of a rollout's columns, and the findings in what comes of them."""

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.measured.checks import Finding, check_rollout
from bumblebee.measured.rollout import Rollout
from tests.measured.simulated import arm_model, g1_model

Change = Callable[[Rollout], Rollout]


def model_of(rollout: Rollout) -> mujoco.MjModel:
    if len(rollout.joints) == 23:
        return g1_model()
    return arm_model("position" if rollout.joint_target is not None else "motor")


def findings(rollout: Rollout, contract: dict | None = None) -> list[Finding]:
    return check_rollout(rollout, model_of(rollout), contract)


def fatal_rules(rollout: Rollout) -> set[tuple[str, str]]:
    return {(finding.rule, finding.column) for finding in findings(rollout) if finding.fatal}


def edit(column: str, change: Callable[[np.ndarray], None]) -> Change:
    """A change made in place on a copy of one column."""

    def apply(rollout: Rollout) -> Rollout:
        values = getattr(rollout, column).copy()
        change(values)
        return replace(rollout, **{column: values})

    return apply


def put(where: object, value: object) -> Callable[[np.ndarray], None]:
    def change(values: np.ndarray) -> None:
        values[where] = value

    return change


def scale(column: str, factor: float, joint: int | slice = slice(None)) -> Change:
    def change(values: np.ndarray) -> None:
        values[:, joint] *= factor

    return edit(column, change)
