"""The limits of the checks, each with its reason. They leave room for sensor noise, falls and vigorous motion."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """Limits that pass. Usual noise: joint_pos 5e-4 rad, joint_vel 0.02 rad/s, gyro 0.01 rad/s, quaternion 0.002."""

    gap_warn: float = 1.8
    """Periods between two rows: from here on a tick is missing. Loggers wander by less than half a period."""
    gap_fatal: float = 5.0
    """Periods: from here on no one knows which commands the robot got in between (0.1 s at 50 Hz)."""
    gap_share_fatal: float = 0.05
    """Share of the file's ticks that may be missing in all before it is not one rollout any more."""
    jitter_warn: float = 0.15
    """Spread of the period over its median (gaps left out): control loops on Linux reach 5 %."""
    jitter_fatal: float = 0.6
    """Spread at which a held command cannot be placed in time."""
    rate_warn: float = 0.02
    """Relative error of the rate: a real arm's logger ran at 49.85 Hz for 50 Hz, 0.3 %."""
    rate_fatal: float = 0.1
    """Relative error of the rate from which the metadata are wrong rather than rounded."""
    drift_warn: float = 0.01
    """Change of the mean period between parts of the file: crystals keep within 0.01 %."""
    drift_fatal: float = 0.2
    """Change from which velocities and delays of one file cannot both be right."""
    freeze_seconds: float = 0.4
    """An exactly constant reading for this long, at least 10 rows, is a dead channel if its command moves."""
    freeze_command: float = 0.15
    """Motion of the target, or way by the velocity within a second [rad], that an unchanged encoder reading leaves
    open. A servo of low gain answers no such target while it sticks (a real one stood for 3.7 s)."""
    freeze_strain: float = 4.0
    """Times the tracking errors at which a joint moves that one may reach while it stands; real sticking servos reach
    1.8, one pressed against its torque limit 1.1."""
    freeze_speed: float = 0.3
    """Mean reported speed [rad/s] during which a position cannot stay the same."""
    freeze_share: float = 0.25
    """Share of the file: a shorter standstill of a coarse encoder that moves again may be a stalled joint (a real
    gripper stood still for 6 s against its torque limit), a longer one is a dead channel."""
    silent_share: float = 0.9
    """Share of the rows in which a joint moves that its torque may be exactly 0: a reading never is twice in a row."""
    step_speed: float = 8.0
    """Speed [rad/s] that may hide between two rows without showing in joint_vel (impacts in falls)."""
    step_floor: float = 0.08
    """Smallest jump [rad] that is called one, whatever the rate."""
    speed_limit: float = 60.0
    """No joint of a legged robot or arm turns faster [rad/s]; the fastest G1 motor is rated at 37."""
    range_brief: float = 0.2
    """Beyond the range [rad] at any moment: falls press simulated soft stops in by up to 0.17."""
    range_held: float = 0.05
    """Beyond the range [rad] throughout half a second: no stop gives way so long, a zero off by 3 degrees shows."""
    range_fatal: float = 0.35
    """Beyond the range [rad]: no calibration error, a wrong column, unit or zero."""
    moving_speed: float = 0.15
    """Mean speed over 40 ms [rad/s, rms] from which velocity and derivative can be compared."""
    velocity_correlation_warn: float = 0.7
    """Correlation of displacement and integrated velocity; a real servo with 0.077 rad/s steps gives above it."""
    velocity_correlation_fatal: float = 0.3
    """Below it the velocity belongs to another joint or to nothing."""
    velocity_correlation_unit: float = 0.9
    """Correlation from which a wrong size is a wrong unit; below it the joint may stick and slip between samples."""
    travel_speed: float = 0.5
    """Mean speed over the window [rad/s, rms] of a joint that travels, which velocity must show."""
    velocity_scale_warn: float = 1.5
    """Factor between displacement and integrated velocity, either way: filters and coarse steps stay within."""
    velocity_scale_fatal: float = 2.5
    """Factor from which the unit is wrong."""
    response_z: float = 4.0
    """Standard errors by which a joint's response must oppose its command to be called reversed; with the whole state
    beside the command honest joints in contact reach 3."""
    response_late: float = 1.0
    """Standard errors for the mean command of the last 60 ms; a drive that answers 30 ms late reaches 0.6."""
    response_effect: float = 0.02
    """Share of the declared servo's effect on the free joint that the opposing effect must have: damping, a sampled
    servo and weak motors leave more, a slow reference that is tracked without error a twentieth of it."""
    response_correlation: float = 0.3
    """Correlation of command and position changes over 0.1 s from which a joint is seen to follow its command."""
    response_model: float = 0.5
    """Share of short stretches that the declared model predicts better with the command reversed, below which it speaks
    for the command as logged: joints that swing with their neighbours give 0, reversed ones 0.68 to 1; the waist of a
    robot that balances by it gives up to 0.32, reversed 0.68 and more."""
    follow_gain: float = 0.45
    """Share of the tracking error that may remain under the negative target, to call a joint reversed by it."""
    follow_error: float = 0.08
    """Tracking error [rad] below which nothing is said about following."""
    scale_slope: float = 3.0
    """Times the positions from which targets are of another scale; gears of servos begin about there."""
    scale_correlation: float = 0.95
    """Correlation of positions and such targets: a servo follows either as well."""
    scale_through_zero: float = 0.2
    """Relative difference of the slope with and without an offset: a gear has none."""
    scale_motion: float = 0.03
    """Share of the joint's range, as a standard deviation, by which it must move."""
    scale_within: float = 0.1
    """Share of the range by which positions may lie beyond it, and targets must to be outside."""
    scale_outside: float = 0.2
    """Share of the rows in which the targets must be outside."""
    scale_model: float = 0.8
    """Share of short stretches that the declared model must predict better with the targets divided by the slope."""
    scale_torque: float = 3.0
    """Where the model cannot tell (a floating base): times its torque limit that the declared servo would have to give
    in half of the rows."""
    order_motion: float = 0.05
    """Changes over 0.2 s [rad, std] of position and target from which a joint is compared with other joints."""
    order_fit: float = 0.7
    """Correlation with another joint's target. Over 9870 pairs of moving joints of 305 genuine rollouts
    (feed-forward targets, weak motors, friction, delay, offsets, falls) those that reach 0.5 crosswise have a margin
    under 0.17."""
    order_margin: float = 0.35
    """By how much that must exceed the correlation of either joint with its own target."""
    order_seconds: float = 2.0
    """A shorter file has too few independent changes for more than a warning."""
    norm_warn: float = 0.02
    """Deviation of a quaternion's norm from 1; noise of 0.002 stays ten times below."""
    norm_fatal: float = 0.1
    """Norm error of a vector that is no unit quaternion."""
    frame_apart: float = 0.25
    """Share of the motion by which base-frame and world-frame readings must differ (15 degrees) for a verdict: a base
    that heads along x and is nearly upright gives one reading, and a tilted IMU decides between them."""
    frame_gain: float = 0.4
    """Share of the squared mismatch that must remain under another reading (frame, order) for it to be called so."""
    turn_wanted: float = 0.1
    """Rotation [rad, rms] to compare gyro and quaternion over: the shortest time that has it, 0.2 to 1 s."""
    turn_floor: float = 0.03
    """Rotation [rad, rms] below which quaternion noise (0.01 rad in a difference) hides frames and order."""
    drift_floor: float = 0.05
    """Mismatch of velocities [m/s, rms] below which frames are not told apart."""
    gains_relative: float = 0.02
    """Relative difference of gains: rounding in a file is smaller, a changed gain larger."""
    gains_factor: float = 100.0
    """Factor between stated and declared gains from which they are of another unit: people vary gains by ten or so,
    a servo's own numbers (100 to 800 for 0.2 to 1.6 N m/rad) are 500 times as large."""
