"""Every check of the contract on one rollout, in an order in which each may rely on the ones before it."""

from typing import Any

import mujoco
import numpy as np

from bumblebee.measured.checks.base import check_base
from bumblebee.measured.checks.compensation import check_compensation
from bumblebee.measured.checks.finding import Finding
from bumblebee.measured.checks.magnitude import check_magnitude
from bumblebee.measured.checks.order import check_names, check_order
from bumblebee.measured.checks.response import check_response
from bumblebee.measured.checks.sign import check_velocity
from bumblebee.measured.checks.target_copy import RULE as TARGET_COPY
from bumblebee.measured.checks.target_copy import check_target_copy
from bumblebee.measured.checks.target_scale import check_target_scale
from bumblebee.measured.checks.thresholds import Thresholds
from bumblebee.measured.checks.time import check_time
from bumblebee.measured.checks.units import check_degrees, check_gains
from bumblebee.measured.checks.values import check_finite, check_frozen, check_range, check_silent, check_steps
from bumblebee.measured.checks.view import View
from bumblebee.measured.rollout import Rollout

__all__ = ["Finding", "Thresholds", "check_rollout"]


def check_rollout(
    rollout: Rollout,
    model: mujoco.MjModel,
    contract: dict[str, Any] | None = None,
    file: str = "",
    limits: Thresholds | None = None,
) -> list[Finding]:
    """All findings on one rollout.

    Args:
        rollout: as read from its file.
        model: the declared model.
        contract: the deployed policy's contract.json (`joints`, `kp`, `kd`), where there is one.
        file: the name that the findings carry; the rollout's own by default.
        limits: what still passes.
    """
    view = View(file or f"{rollout.rollout_id}.parquet", rollout, model, contract, limits or Thresholds())
    with np.errstate(all="ignore"):  # every quotient is guarded where it matters
        _check_all(view)
    return view.findings


def _check_all(view: View) -> None:
    rollout = view.rollout
    if check_compensation(view):
        return  # its gains and commands are meant to differ: more findings would hide the reason
    check_names(view)
    check_finite(view)
    check_magnitude(view)
    check_gains(view)
    if view.found("finite", "time") or view.found("magnitude"):
        return  # a square of such a number is no number any more
    check_time(view)
    other_unit = any(finding.rule == "rate" and "these are" in finding.came for finding in view.findings)
    no_clock = view.found("time-order") or view.found("time-duplicate") or other_unit
    if no_clock or view.found("finite") or rollout.frames < 4:
        return  # what follows needs numbers and a clock
    check_target_copy(view)
    if view.found(TARGET_COPY):
        return  # what compares positions with targets would compare positions with themselves
    check_target_scale(view)
    check_degrees(view)
    check_frozen(view)
    check_silent(view)
    check_range(view)
    check_velocity(view)
    check_steps(view)
    check_order(view)
    check_response(view)
    check_base(view)
