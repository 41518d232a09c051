"""Checks of order: joint names against the model and the deployed policy, columns that were exchanged."""

import difflib

import numpy as np
from scipy.optimize import linear_sum_assignment

from bumblebee.measured.view import View


def check_names(view: View) -> None:
    """Joint names against the model's and the policy contract's, and the columns that a floating base needs."""
    known = [view.model.joint(i).name for i in range(view.model.njnt)]
    for name, joint in zip(view.rollout.joints, view.joint_ids(), strict=True):
        if joint < 0:
            near = difflib.get_close_matches(name, known, 1)
            expected = f"a joint of the model (nearest: {near[0]})" if near else "a joint of the model"
            view.add("joints", None, "joint-names", expected, name, fatal=True)
    moved = {view.model.joint(int(i)).name for i in view.model.actuator_trnid[:, 0] if 0 <= i < view.model.njnt}
    absent = sorted(moved - set(view.rollout.joints))
    if absent:
        came = f"no column for {', '.join(absent[:3])}{' ...' if len(absent) > 3 else ''} ({len(absent)} in all)"
        view.add("joints", None, "joint-missing", "every actuated joint of the model", came, fatal=False)
    _check_contract_names(view)
    if view.floating:
        for column in ("base_quat", "base_ang_vel", "base_lin_vel"):
            if getattr(view.rollout, column) is None:
                came = "no such column, and the model has a free base"
                view.add(column, None, "base-columns", "this column", came, fatal=column != "base_lin_vel")


def _check_contract_names(view: View) -> None:
    wanted = tuple((view.contract or {}).get("joints", ()))
    if not wanted or wanted == view.rollout.joints:
        return
    if set(wanted) != set(view.rollout.joints):
        differ = sorted(set(wanted) ^ set(view.rollout.joints))
        came = f"{len(view.rollout.joints)} joints; not in both: {', '.join(differ[:3])}"
        view.add("joints", None, "policy-joints", f"the deployed policy's {len(wanted)} joints", came, fatal=True)
        return
    first = next(i for i, pair in enumerate(zip(wanted, view.rollout.joints, strict=True)) if pair[0] != pair[1])
    expected = f"the deployed policy's order, {wanted[first]} at place {first}"
    view.add("joints", None, "policy-joints", expected, view.rollout.joints[first], fatal=True)


def check_order(view: View) -> None:
    """Positions that follow another joint's target much better than their own: exchanged columns."""
    rollout, limits = view.rollout, view.limits
    if rollout.joint_target is None or len(rollout.joints) < 2 or view.found("degrees"):
        return
    place, target = rollout.joint_pos, rollout.joint_target
    error = np.sqrt(((place[:, :, None] - target[:, None, :]) ** 2).mean(axis=0))
    _, best = linear_sum_assignment(error**2)
    own = np.diag(error)
    for joint in np.flatnonzero(best != np.arange(len(best))):
        other = int(best[joint])
        if own[joint] > limits.order_error and error[joint, other] < limits.order_gain * own[joint]:
            came = f"{error[joint, other]:.3g} rad from {rollout.joints[other]}'s target, {own[joint]:.3g} from its own"
            expected = "positions that follow their own target"
            fatal = own[other] > limits.order_error and own[joint] > 2 * error[joint, other]
            view.add(view.label("joint_pos", joint), None, "joint-order", expected, came, fatal=fatal)
