"""Checks of sign: the velocity against the derivative of the position, the response against the command."""

import numpy as np

from bumblebee.measured.view import View, integral

# Window [s] -> the factor of `moving_speed` that suffices: over a longer time, noise and coarse steps average out.
WINDOWS = {0.04: 1.0, 0.2: 0.4, 0.5: 0.2, 1.0: 0.13}
NOT_ALONG = 2.0  # standard errors: from here on a joint's acceleration is seen to go along with its command


def check_velocity(view: View) -> None:
    """joint_vel against the derivative of joint_pos: sign, unit, column; compared as displacement over a window.

    The window is the shortest over which a joint moves fast enough. Joints that move slowly are judged on sign, unit
    and column alone, since coarse velocities (a servo's 50 counts/s) say little more about them.
    """
    pairs = {seconds: _displacements(view, seconds) for seconds in WINDOWS}
    for joint in range(len(view.rollout.joints)):
        if view.found("frozen", view.label("joint_pos", joint)):
            continue
        for seconds, factor in WINDOWS.items():
            speed, said = pairs[seconds]
            if max(speed[:, joint].std(), said[:, joint].std()) >= factor * view.limits.moving_speed:
                _judge_velocity(view, joint, speed, said, slow=factor < 1)
                break


def _displacements(view: View, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean speed over a window by position and by velocity, (T - window, J) each [rad/s]."""
    rollout = view.rollout
    window = view.window(seconds)
    span = (rollout.time[window:] - rollout.time[:-window])[:, None]
    speed = (rollout.joint_pos[window:] - rollout.joint_pos[:-window]) / span
    unit = np.pi / 180 if view.found("degrees", "joint_pos") else 1.0
    return unit * speed, integral(rollout.time, rollout.joint_vel, window) / span


def _judge_velocity(view: View, joint: int, speed: np.ndarray, said: np.ndarray, slow: bool) -> None:
    limits, column = view.limits, view.label("joint_vel", joint)
    fits = np.array([_correlation(speed[:, other], said[:, joint]) for other in range(speed.shape[1])])
    fit, best = float(fits[joint]), int(np.argmax(fits))
    ratio = float(said[:, joint].std() / max(speed[:, joint].std(), 1e-9))
    row = int(np.argmax(np.abs(speed[:, joint] - said[:, joint])))
    came, expected = f"correlation {fit:.2f}, size times {ratio:.3g}", "the derivative of joint_pos"
    off = max(ratio, 1 / max(ratio, 1e-9))
    if 40 < ratio < 80 and fit > limits.velocity_correlation_warn:
        view.add(column, row, "degrees", "rad/s", came, fatal=True)
    elif fit < -(0.6 if slow else limits.velocity_correlation_fatal):
        view.add(column, row, "velocity-sign", expected, came, fatal=True)
    elif best != joint and fits[best] > 0.95 and fit < limits.velocity_correlation_warn:
        came = f"that of {view.rollout.joints[best]} (correlation {fits[best]:.2f}, with its own {fit:.2f})"
        view.add(column, row, "velocity-derivative", expected, came, fatal=True)
    elif not slow and (fit < limits.velocity_correlation_warn or off > limits.velocity_scale_warn):
        fatal = fit < limits.velocity_correlation_fatal or off > limits.velocity_scale_fatal
        view.add(column, row, "velocity-derivative", expected, came, fatal=fatal)


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a, b)[0, 1]) if min(a.std(), b.std()) > 1e-9 else 0.0


def check_response(view: View) -> None:
    """A joint that moves against its command: the sign of one of the two columns is wrong.

    Position and target may well be anticorrelated on good data (an ankle in balance). So either the change of velocity,
    regressed on the command with position and velocity beside it, must oppose the command, or the position must follow
    the negative target far better than the target itself.
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
        place, given = rollout.joint_pos[:, joint], command[:, joint]
        window = view.window(0.1)
        together = _correlation(place[window:] - place[:-window], given[window:] - given[:-window])
        z = _response_z(view, command, joint)
        against = z < -limits.response_z and (not by_target or together < limits.response_correlation)
        if against or (by_target and z < NOT_ALONG and _follows_negative(view, place, given)):
            came = f"motion against it ({-z:.0f} standard errors, correlation of the changes {together:.2f})"
            column = view.label(name, joint)
            view.add(column, None, "response-sign", "a joint that follows its command", came, fatal=True)


def _follows_negative(view: View, place: np.ndarray, target: np.ndarray) -> bool:
    """Whether -target is tracked as a servo tracks, and target is not."""
    limits = view.limits
    own, other = (float(np.sqrt(((place - sign * target) ** 2).mean())) for sign in (1, -1))
    return own > limits.order_error and other < 0.45 * own and _correlation(place, target) < -0.7


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
