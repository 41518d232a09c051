"""Checks of sign: the velocity against the derivative of the position, the response against the command."""

import mujoco
import numpy as np

from bumblebee.measured.checks_units import servo_gains
from bumblebee.measured.view import View, integral

# Window [s] -> the factor of `moving_speed` that suffices: over a longer time, noise and coarse steps average out.
WINDOWS = {0.04: 1.0, 0.2: 0.4, 0.5: 0.2, 1.0: 0.13}
CLEARLY_MIRRORED = -0.75  # the same, for joints that a floating robot's weight may move against their command
CARRIED = 0.15  # share of the robot's mass beyond a joint from which on that is so
MIRRORED = -0.9  # correlation of the changes of a position that follows its target's negative
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
                longer = [pair for other, pair in pairs.items() if other > seconds]
                _judge_velocity(view, joint, speed, said, longer, slow=factor < 1)
                break


def _displacements(view: View, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean speed over a window by position and by velocity, (T - window, J) each [rad/s]."""
    rollout = view.rollout
    window = view.window(seconds)
    span = (rollout.time[window:] - rollout.time[:-window])[:, None]
    speed = (rollout.joint_pos[window:] - rollout.joint_pos[:-window]) / span
    unit = np.pi / 180 if view.found("degrees", "joint_pos") else 1.0
    return unit * speed, integral(rollout.time, rollout.joint_vel, window) / span


def _judge_velocity(
    view: View, joint: int, speed: np.ndarray, said: np.ndarray, longer: list[tuple[np.ndarray, np.ndarray]], slow: bool
) -> None:
    """One joint's velocity, over the shortest window in which it moves and over the longer ones.

    A joint that sticks and slips (dry friction, contact) moves between the samples: its displacement and its sampled
    velocity then have little to do with each other, over any window, which is a warning and no wrong file.
    """
    limits, column = view.limits, view.label("joint_vel", joint)
    fits = _correlations(speed, said[:, joint])
    fit, best = float(fits[joint]), int(np.argmax(fits))
    ratio = float(said[:, joint].std() / max(speed[:, joint].std(), 1e-9))
    row = int(np.argmax(np.abs(speed[:, joint] - said[:, joint])))
    lasting = [_correlation(moved[:, joint], told[:, joint]) for moved, told in longer]
    came, expected = f"correlation {fit:.2f}, size times {ratio:.3g}", "the derivative of joint_pos"
    off = max(ratio, 1 / max(ratio, 1e-9))
    if 40 < ratio < 80 and fit > limits.velocity_correlation_warn:
        view.add(column, row, "degrees", "rad/s", came, fatal=True)
    elif fit < -(0.6 if slow else limits.velocity_correlation_fatal) and max(lasting, default=fit) < 0:
        view.add(column, row, "velocity-sign", expected, came, fatal=True)
    elif best != joint and fits[best] > 0.95 and fit < limits.velocity_correlation_warn:
        came = f"that of {view.rollout.joints[best]} (correlation {fits[best]:.2f}, with its own {fit:.2f})"
        view.add(column, row, "velocity-derivative", expected, came, fatal=True)
    elif not slow and (fit < limits.velocity_correlation_warn or off > limits.velocity_scale_warn):
        travels = speed[:, joint].std() > limits.travel_speed
        nothing = travels and max(fit, *lasting) < limits.velocity_correlation_fatal
        fatal = nothing or (fit > limits.velocity_correlation_unit and off > limits.velocity_scale_fatal)
        view.add(column, row, "velocity-derivative", expected, came, fatal=fatal)


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(_correlations(a[:, None], b)[0])


def _correlations(several: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Correlation (J,) of each column of `several` (T, J) with `one` (T,); 0 where either rests."""
    spread, size = several.std(axis=0), one.std()
    moving = np.minimum(spread, size) > 1e-9
    product = (several - several.mean(axis=0)).T @ (one - one.mean()) / len(one)
    return np.where(moving, product / np.where(moving, spread * size, 1.0), 0.0)


def check_response(view: View) -> None:
    """A joint that moves against its command: the sign of one of the two columns is wrong.

    Position and target may well be anticorrelated on good data: an ankle in balance, a waist whose target leads by
    gravity's torque. So only the response itself decides: the change of velocity, regressed on the command with
    position and velocity beside it, must oppose the command as strongly as the declared servo acts. A position that
    merely follows the negative target is pointed out.
    """
    rollout, limits = view.rollout, view.limits
    by_target = rollout.joint_target is not None
    name = "joint_target" if by_target else "joint_torque_cmd"
    command = view.values(name)
    exchanged = any(finding.rule == "joint-order" and finding.fatal for finding in view.findings)
    if view.found("velocity-sign") or exchanged or view.found("degrees"):
        return
    effects = _declared_effects(view, by_target)
    for joint in range(len(rollout.joints)):
        still = command[:, joint].std() < (0.02 if by_target else 1e-3)
        if still or view.found("frozen", view.label("joint_pos", joint)):
            continue
        place, given = rollout.joint_pos[:, joint], command[:, joint]
        window = view.window(0.1)
        together = _correlation(place[window:] - place[:-window], given[window:] - given[:-window])
        z, effect = _response(view, command, joint)
        strong = effect < -limits.response_effect * effects[joint]
        against = strong and z < -limits.response_z and (not by_target or together < limits.response_correlation)
        mirrored = by_target and z < NOT_ALONG and together < MIRRORED and _follows_negative(view, place, given)
        if against or mirrored:
            came = f"motion against it ({-z:.0f} standard errors, correlation of the changes {together:.2f})"
            column = view.label(name, joint)
            clear = together < CLEARLY_MIRRORED or not _carries_weight(view, joint)
            view.add(column, None, "response-sign", "a joint that follows its command", came, fatal=against and clear)


def _carries_weight(view: View, joint: int) -> bool:
    """Whether a floating robot's weight may move the joint against its command for seconds: hips, knees, a waist."""
    model, number = view.model, view.joint_ids()[joint]
    if number < 0 or not (model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).any():
        return False
    return bool(model.body_subtreemass[model.jnt_bodyid[number]] > CARRIED * model.body_subtreemass[0])


def _declared_effects(view: View, by_target: bool) -> np.ndarray:
    """(J,) acceleration of the free joint per unit of the command: servo gain over inertia; 0 where it is unknown."""
    gains, effects = servo_gains(view.model), np.zeros(len(view.rollout.joints))
    for column, joint in enumerate(view.joint_ids()):
        if joint >= 0:
            gain = gains.get(view.rollout.joints[column], (0.0, 0.0))[0] if by_target else 1.0
            effects[column] = gain * view.model.dof_invweight0[view.model.jnt_dofadr[joint]]
    return effects


def _follows_negative(view: View, place: np.ndarray, target: np.ndarray) -> bool:
    """Whether -target is tracked as a servo tracks, and target is not."""
    limits = view.limits
    own, other = (float(np.sqrt(((place - sign * target) ** 2).mean())) for sign in (1, -1))
    return own > limits.follow_error and other < limits.follow_gain * own and _correlation(place, target) < -0.7


def _response(view: View, command: np.ndarray, joint: int) -> tuple[float, float]:
    """The command's effect on the next change of velocity, beside position and velocity.

    In standard errors, and as acceleration per unit of the command.
    """
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
        return 0.0, 0.0
    sizes = np.linalg.norm(table, axis=0) + 1e-12
    table = table / sizes
    # The ridge keeps collinear columns apart: a joint that rests makes its position one with the constant.
    inverse = np.linalg.inv(table.T @ table + 1e-9 * np.eye(table.shape[1]))
    weights = inverse @ (table.T @ change)
    noise = np.sqrt(((change - table @ weights) ** 2).sum() / (len(change) - table.shape[1]))
    z = weights[0] / (noise * np.sqrt(max(inverse[0, 0], 0.0)) + 1e-12)
    return float(z), float(weights[0] / sizes[0] / (window * view.period))
