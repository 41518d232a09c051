"""Checks of order and sign: joint names, velocity against the derivative of position, response against command."""

import difflib

import numpy as np
from scipy.optimize import linear_sum_assignment

from bumblebee.measured.view import View, integral


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


def check_velocity(view: View) -> None:
    """joint_vel against the derivative of joint_pos: sign, unit, column. Compared as displacement over 40 ms."""
    rollout, limits = view.rollout, view.limits
    window = view.window(0.04)
    span = (rollout.time[window:] - rollout.time[:-window])[:, None]
    speed = (rollout.joint_pos[window:] - rollout.joint_pos[:-window]) / span
    said = integral(rollout.time, rollout.joint_vel, window) / span
    if view.found("degrees", "joint_pos"):
        speed = speed * np.pi / 180
    for joint in range(len(rollout.joints)):
        if view.found("frozen", view.label("joint_pos", joint)):
            continue
        moved, told = float(speed[:, joint].std()), float(said[:, joint].std())
        if max(moved, told) < limits.moving_speed:
            continue
        correlation = _correlation(speed[:, joint], said[:, joint])
        row = int(np.argmax(np.abs(speed[:, joint] - said[:, joint])))
        if correlation < limits.velocity_correlation_warn and _another(view, speed, said[:, joint], joint, row):
            continue
        _judge_velocity(view, joint, row, correlation, told / max(moved, 1e-9))


def _another(view: View, speed: np.ndarray, said: np.ndarray, joint: int, row: int) -> bool:
    """Whether a velocity is the derivative of another joint's position; noted if so."""
    fits = np.array([_correlation(speed[:, other], said) for other in range(speed.shape[1])])
    best = int(np.argmax(fits))
    if best == joint or fits[best] < 0.95:
        return False
    came = f"that of {view.rollout.joints[best]} (correlation {fits[best]:.2f}, with its own {fits[joint]:.2f})"
    view.add(view.label("joint_vel", joint), row, "velocity-derivative", "its own velocity", came, fatal=True)
    return True


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a, b)[0, 1]) if min(a.std(), b.std()) > 1e-9 else 0.0


def _judge_velocity(view: View, joint: int, row: int, correlation: float, ratio: float) -> None:
    limits, column = view.limits, view.label("joint_vel", joint)
    came = f"correlation {correlation:.2f}, size times {ratio:.3g}"
    expected = "the derivative of joint_pos"
    if 40 < ratio < 80 and correlation > limits.velocity_correlation_warn:
        view.add(column, row, "degrees", "rad/s", came, fatal=True)
    elif correlation < -limits.velocity_correlation_fatal:
        view.add(column, row, "velocity-sign", expected, came, fatal=True)
    else:
        off = max(ratio, 1 / max(ratio, 1e-9))
        fatal = correlation < limits.velocity_correlation_fatal or off > limits.velocity_scale_fatal
        if fatal or correlation < limits.velocity_correlation_warn or off > limits.velocity_scale_warn:
            view.add(column, row, "velocity-derivative", expected, came, fatal=fatal)


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


def check_response(view: View) -> None:
    """A joint that accelerates against its command: the sign of one of the two columns is wrong.

    Position and command may well be anticorrelated on good data (an ankle in balance), so the change of velocity is
    regressed on the command with position and velocity beside it; a command's own coefficient is positive there.
    """
    rollout, limits = view.rollout, view.limits
    by_target = rollout.joint_target is not None
    name = "joint_target" if by_target else "joint_torque_cmd"
    command = view.values(name)
    if view.found("velocity-sign") or view.found("joint-order") or view.found("degrees"):
        return
    for joint in range(len(rollout.joints)):
        still = command[:, joint].std() < (0.02 if by_target else 1e-3)
        if still or view.found("frozen", view.label("joint_pos", joint)):
            continue
        z = _response_z(view, command, joint)
        moves = np.diff(command[:, joint]), np.diff(rollout.joint_pos[:, joint])
        window = view.window(0.1)
        sums = [np.convolve(move, np.ones(window), "valid") for move in moves]
        together = _correlation(*sums)
        if z < -limits.response_z and (not by_target or together < limits.response_correlation):
            came = f"motion against it ({-z:.0f} standard errors, correlation {together:.2f})"
            view.add(
                view.label(name, joint), None, "response-sign", "a joint that follows its command", came, fatal=True
            )


def _response_z(view: View, command: np.ndarray, joint: int) -> float:
    """Standard errors of the command's effect on the next change of velocity, beside position and velocity."""
    rollout = view.rollout
    window = view.window(0.02)
    change = rollout.joint_vel[window:, joint] - rollout.joint_vel[:-window, joint]
    place, speed = rollout.joint_pos[:-window], rollout.joint_vel[:-window]
    given = integral(rollout.time, command, window) / (rollout.time[window:] - rollout.time[:-window])[:, None]
    columns = [given[:, joint], place[:, joint], speed[:, joint], np.sin(place[:, joint]), np.ones(len(change))]
    if len(rollout.joints) <= 8:
        others = [i for i in range(len(rollout.joints)) if i != joint]
        columns += [matrix[:, i] for i in others for matrix in (given, place, speed)]
    table = np.stack(columns, axis=1)[::window]
    change = change[::window]
    if len(change) < 3 * table.shape[1]:
        return 0.0
    table = table / (np.linalg.norm(table, axis=0) + 1e-12)
    # The ridge keeps collinear columns apart: a joint that rests makes its position one with the constant.
    inverse = np.linalg.inv(table.T @ table + 1e-9 * np.eye(table.shape[1]))
    weights = inverse @ (table.T @ change)
    noise = np.sqrt(((change - table @ weights) ** 2).sum() / (len(change) - table.shape[1]))
    return float(weights[0] / (noise * np.sqrt(max(inverse[0, 0], 0.0)) + 1e-12))
