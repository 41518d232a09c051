"""Check of the velocity against the derivative of the position: sign, unit, column."""

import numpy as np

from bumblebee.measured.checks.view import View, integral

# Window [s] -> the factor of `moving_speed` that suffices: over a longer time, noise and coarse steps average out.
WINDOWS = {0.04: 1.0, 0.2: 0.4, 0.5: 0.2, 1.0: 0.13}


def check_velocity(view: View) -> None:
    """joint_vel against the derivative of joint_pos: sign, unit, column; compared as displacement over a window.

    The window is the shortest over which a joint moves fast enough. Joints that move slowly are judged on sign, unit
    and column alone, since coarse velocities (a servo's 50 counts/s) say little more about them. Velocities that an
    import made of the positions, as the log had none, are not judged.
    """
    if _made_of_positions(view):
        return
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


def _made_of_positions(view: View) -> bool:
    """Whether joint_vel are the central differences of joint_pos."""
    rollout = view.rollout
    made = np.gradient(rollout.joint_pos, rollout.time, axis=0)
    return bool(np.allclose(made[1:-1], rollout.joint_vel[1:-1]))


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
    lasting = [correlation(moved[:, joint], told[:, joint]) for moved, told in longer]
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


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Correlation of two series (T,); 0 where either rests."""
    return float(_correlations(a[:, None], b)[0])


def _correlations(several: np.ndarray, one: np.ndarray) -> np.ndarray:
    """Correlation (J,) of each column of `several` (T, J) with `one` (T,); 0 where either rests."""
    spread, size = several.std(axis=0), one.std()
    moving = np.minimum(spread, size) > 1e-9
    product = (several - several.mean(axis=0)).T @ (one - one.mean()) / len(one)
    return np.where(moving, product / np.where(moving, spread * size, 1.0), 0.0)
