"""Check of sign: a joint whose acceleration opposes its command has one of the two columns reversed.

By the servo's law, torque = kp (target - position) - kd velocity, a step of the target is an acceleration the same way.
What else moves the joint moves the target too, though: gravity as a squat deepens, other joints, the base and, through
it, the floor, and a policy answers all of them. A waist that sags under a load which its target leans against shows
target and acceleration in opposite phase for a whole rollout, and no sign is wrong. So the change of velocity is
regressed on the command that was held meanwhile with the whole state beside it: every joint's command, position and
velocity, the base's direction of gravity and velocities. What is left of the command is what nothing else explains. A
drive that answers late shows an echo of the present command at most, so the mean of the last 60 ms must oppose the
motion, too.

The rows are a series: residuals of one tick are like those of the next where contact lasts, so the standard error
counts their products over 0.1 s (Newey and West 1987), and is never taken smaller than that of independent rows.
"""

import numpy as np

from bumblebee.measured.checks.reversed_command import share_for_reversed
from bumblebee.measured.checks.sign import correlation
from bumblebee.measured.checks.units import servo_gains
from bumblebee.measured.checks.view import View
from bumblebee.quaternions import conjugate, rotate_by_cross

MIRRORED = -0.9  # correlation of the changes of a position that follows its target's negative
NOT_ALONG = 2.0  # standard errors: from here on a joint's acceleration is seen to go along with its command
ROWS_EACH = 1.5  # rows for every column of the regression: with fewer it explains anything
TICK, LASTING = 0.02, 0.1  # s between rows, s over which residuals are taken to hang together
LATE = 3  # rows by which a drive may answer late
RIDGE = 1e-7  # of columns of length 1: keeps collinear ones apart, as a resting joint's position and the constant


def check_response(view: View) -> None:
    """A joint that moves against its command: the sign of one of the two columns is wrong.

    Fatal where the whole state could be taken into account and the declared model agrees, which moves so by itself
    where neighbours drive the joint; where that cannot tell, the changes of position and target must clearly oppose
    each other. Of a floating base, whose contacts no log has, the model is asked of limbs that touch nothing. In a file
    too short for the whole state a person is told, as where a position merely follows the negative target, or where the
    model alone says so: a hand that presses on a table goes against what its limb asks, too.
    """
    rollout, limits = view.rollout, view.limits
    by_target = rollout.joint_target is not None
    name = "joint_target" if by_target else "joint_torque_cmd"
    command = view.values(name)
    exchanged = any(finding.rule == "joint-order" and finding.fatal for finding in view.findings)
    if view.found("velocity-sign") or exchanged or view.found("degrees"):
        return
    effects, rows = _declared_effects(view, by_target), _Rows(view, command)
    for joint in range(len(rollout.joints)):
        still = command[:, joint].std() < (0.02 if by_target else 1e-3)
        if still or view.found("frozen", view.label("joint_pos", joint)):
            continue
        place, given = rollout.joint_pos[:, joint], command[:, joint]
        window = view.window(0.1)
        together = correlation(place[window:] - place[:-window], given[window:] - given[:-window])
        z, late, effect, whole = rows.response(joint)
        strong = effect < -limits.response_effect * effects[joint]
        opposed = z < -limits.response_z and late < -limits.response_late
        against = strong and opposed and (not by_target or together < limits.response_correlation)
        mirrored = by_target and z < NOT_ALONG and together < MIRRORED and _follows_negative(view, place, given)
        share = share_for_reversed(view, joint, by_target) if against or (by_target and view.floating) else None
        turned = not against and share is not None and share >= limits.response_model
        if against or mirrored or turned:
            opposes = by_target and together < -limits.response_correlation
            sure = against and (opposes or view.floating if share is None else share >= limits.response_model)
            came = f"motion against it ({-z:.0f} standard errors, correlation of the changes {together:.2f})"
            if turned:
                came = f"one that the declared model takes for its negative in {share:.0%} of short stretches"
            column = view.label(name, joint)
            view.add(
                column,
                None,
                "response-sign",
                "a joint that follows its command",
                came,
                fatal=sure and whole,
            )


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
    return own > limits.follow_error and other < limits.follow_gain * own and correlation(place, target) < -0.7


class _Rows:
    """The rows of the regression, every 20 ms: what all joints share."""

    def __init__(self, view: View, command: np.ndarray) -> None:
        rollout = view.rollout
        window = view.window(TICK)
        self.change = (rollout.joint_vel[window:] - rollout.joint_vel[:-window])[::window]
        # Held from row to row: the command of the row at the end was chosen after the motion, and answers it.
        total = np.concatenate([np.zeros_like(command[:1]), np.cumsum(command, axis=0)])
        self.given = ((total[window:] - total[:-window]) / window)[:-1][::window]
        self.place = rollout.joint_pos[:-window][::window]
        self.speed = rollout.joint_vel[:-window][::window]
        self.base = _base(view)[:-window][::window]
        self.seconds = window * view.period

    def response(self, joint: int) -> tuple[float, float, float, bool]:
        """The command's effect on the next change of velocity.

        In standard errors, the same for the mean of the last commands, as acceleration per unit, and whether the whole
        state stood beside it; 0 where there are too few rows even for the joint alone.
        """
        now = slice(LATE, None)
        place, speed = self.place[now], self.speed[now]
        own = [place[:, joint], speed[:, joint], np.sin(place[:, joint]), np.ones(len(place))]
        others = [i for i in range(place.shape[1]) if i != joint]
        table = np.column_stack(
            [*own, *(values[:, others] for values in (self.given[now], place, speed)), self.base[now]]
        )
        whole = len(table) >= ROWS_EACH * (table.shape[1] + 1)
        if not whole:
            table = np.column_stack(own)
        if len(table) < 3 * (len(own) + 1):
            return 0.0, 0.0, 0.0, False
        lags = max(1, round(LASTING / self.seconds))
        given = [self.given[LATE - late : len(self.given) - late, joint] for late in range(LATE + 1)]
        fits = [
            _first_weight(np.column_stack([command, table]), self.change[now, joint], lags)
            for command in (given[0], np.mean(given, axis=0))
        ]
        (weight, error), (late, doubt) = fits
        return weight / error, late / doubt, weight / self.seconds, whole


def _base(view: View) -> np.ndarray:
    """(T, 0 to 9) the direction of gravity in the base's frame and the base's velocities, those that were logged."""
    rollout, columns = view.rollout, [np.zeros((view.rollout.frames, 0))]
    if rollout.base_quat is not None:
        norm = np.linalg.norm(rollout.base_quat, axis=1, keepdims=True)
        to_base = conjugate(rollout.base_quat / np.maximum(norm, 1e-9))
        columns.append(rotate_by_cross(to_base, np.array([0.0, 0.0, 1.0])))
    columns += [values for values in (rollout.base_ang_vel, rollout.base_lin_vel) if values is not None]
    return np.concatenate(columns, axis=1)


def _first_weight(table: np.ndarray, change: np.ndarray, lags: int) -> tuple[float, float]:
    """Least squares of `change` (N,) on `table` (N, K): the first column's weight and its standard error."""
    rows, columns = table.shape
    sizes = np.linalg.norm(table, axis=0) + 1e-12
    table = table / sizes
    inverse = np.linalg.inv(table.T @ table + RIDGE * np.eye(columns))
    weights = inverse @ (table.T @ change)
    error = change - table @ weights
    part = (table @ inverse[0]) * error  # how much each row moves the first weight
    hanging = part @ part
    hanging += 2 * sum((1 - lag / (lags + 1)) * (part[lag:] @ part[:-lag]) for lag in range(1, min(lags, rows - 1) + 1))
    alone = max(inverse[0, 0], 0.0) * (error @ error)
    spread = np.sqrt(max(rows * hanging, rows * (part @ part), alone) / (rows - columns))
    return float(weights[0] / sizes[0]), float(spread / sizes[0] + 1e-300)
