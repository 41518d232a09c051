"""Checks of order: joint names against the model and the deployed policy, columns that were exchanged."""

import difflib

import numpy as np
from scipy.optimize import linear_sum_assignment

from bumblebee.measured.checks.units import driven_joints
from bumblebee.measured.checks.view import View

ORDER_WINDOW = 0.2  # s over which changes are compared: long against a servo's lag, short against a motion
ORDER_LATE = (0.06, 0.12, 0.2)  # s by which a joint's response to its own target may lag; the first for any target
_LOCKED = (
    "Of joints that the robot has locked or lacks: list them under locked in the import's map, and give the model.xml "
    "that lies in the dataset."
)
SURE_FIT, SURE_MARGIN = 0.9, 0.7  # from here on one joint alone is worth a warning


def check_names(view: View) -> None:
    """Joint names against the model's and the policy contract's, and the columns that a floating base needs."""
    known = [view.model.joint(i).name for i in range(view.model.njnt)]
    for name, joint in zip(view.rollout.joints, view.joint_ids(), strict=True):
        if joint < 0:
            near = difflib.get_close_matches(name, known, 1)
            expected = f"a joint of the model (nearest: {near[0]})" if near else "a joint of the model"
            view.add("joints", None, "joint-names", expected, name, fatal=True)
    absent = sorted(set(driven_joints(view.model)) - set(view.rollout.joints))
    if absent:
        came = f"no column for {', '.join(absent[:3])}{' ...' if len(absent) > 3 else ''} ({len(absent)} in all)"
        view.add("joints", None, "joint-missing", "every actuated joint of the model", came, fatal=True, do=_LOCKED)
    _check_contract_names(view)
    if view.floating:
        for column in ("base_quat", "base_ang_vel", "base_lin_vel"):
            if getattr(view.rollout, column) is None:
                came = "no such column, and the model has a free base"
                view.add(column, None, "base-columns", "this column", came, fatal=True)


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
    """Positions whose changes follow another joint's target and not their own: exchanged columns.

    Changes, not levels: gravity feed-forward lets a target lead its position by up to 1 rad, and so do weak motors and
    encoder offsets. Fatal where joints follow each other's target crosswise, or where many follow another's in a
    file that is long enough; anything less is told and passes, since joints in a fall follow nothing for a while.
    """
    rollout, limits = view.rollout, view.limits
    if rollout.joint_target is None or len(rollout.joints) < 2 or view.found("degrees"):
        return
    fits, moving = response_fits(view)
    if len(moving) < 2:
        return
    own = np.diag(fits)
    clear = (fits >= limits.order_fit) & (fits - np.maximum(own[:, None], own[None, :]) >= limits.order_margin)
    crosswise = clear & clear.T
    _, best = linear_sum_assignment(-fits)
    away = clear[np.arange(len(best)), best]
    many = away.sum() >= max(4, len(moving) / 3)
    long_enough = rollout.duration >= limits.order_seconds
    for row, joint in enumerate(moving):
        partner = int(np.argmax(np.where(crosswise[row], fits[row], -2.0))) if crosswise[row].any() else int(best[row])
        sure = fits[row, partner] >= SURE_FIT and fits[row, partner] - own[row] >= SURE_MARGIN
        if not clear[row, partner] or not (crosswise[row].any() or many or sure):
            continue
        name = rollout.joints[moving[partner]]
        came = f"changes like {name}'s target (correlation {fits[row, partner]:.2f}, with its own {own[row]:.2f})"
        fatal = bool(long_enough and (crosswise[row].any() or many))
        expected = "positions that follow their own target"
        view.add(view.label("joint_pos", joint), None, "joint-order", expected, came, fatal=fatal)


def response_fits(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Correlation of every moving joint's changes with every moving target's, (M, M), and those joints' columns (M,).

    Each is the better of an immediate and a late response, as a servo and a delay cause it.
    """
    window, lags = view.window(ORDER_WINDOW), [view.window(seconds) for seconds in ORDER_LATE]
    place = view.rollout.joint_pos[window:] - view.rollout.joint_pos[:-window]
    target = view.values("joint_target")[window:] - view.values("joint_target")[:-window]
    enough = view.limits.order_motion
    moving = np.flatnonzero((place.std(axis=0) > enough) & (target.std(axis=0) > enough))
    place, target = place[:, moving], target[:, moving]
    if len(moving) < 2 or len(place) <= max(lags) + 2:
        return np.zeros((0, 0)), moving[:0]
    late = [_correlations(place[lag:], target[:-lag]) for lag in lags]
    fits = np.maximum(_correlations(place, target), late[0])
    np.fill_diagonal(fits, np.maximum.reduce([np.diag(fits), *(np.diag(one) for one in late)]))
    return fits, moving


def _correlations(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(M, M) correlations of the columns of `a` (T, M) with those of `b` (T, M)."""
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    size = np.linalg.norm(a, axis=0)[:, None] * np.linalg.norm(b, axis=0)[None, :]
    return (a.T @ b) / np.maximum(size, 1e-12)
