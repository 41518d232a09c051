"""The compensation at work: readings put right before the policy sees them, commands before the drives get them."""

from dataclasses import replace

import numpy as np

from bumblebee import quaternions
from bumblebee.compensation.numbers import Compensation
from bumblebee.compensation.reference import ReferenceTable
from bumblebee.errors import BadInput
from bumblebee.measured.rollout import Rollout
from bumblebee.robot.facts import joints
from bumblebee.robot.model import gains
from bumblebee.robot.sensors import Sensors
from bumblebee.robot.servo_command import ServoCommand
from bumblebee.sim.effects import read_term
from bumblebee.tracking.sampling.library import MotionLibrary


class Compensator:
    """A compensation for robots that each follow a clip.

    Args:
        compensation: what is undone.
        library: the reference motions.
        clips: (B,) index of each robot's clip in it.
        dt: control period [s].
    """

    def __init__(self, compensation: Compensation, library: MotionLibrary, clips: np.ndarray, dt: float) -> None:
        self.compensation, self._clips, self._dt = compensation, np.asarray(clips), dt
        self._table = ReferenceTable(compensation, library)
        self._fps, self._frame = library.fps, dt * library.fps  # frames a second, a control period
        self._correction = np.zeros((len(self._clips), len(compensation.joints)))
        self._begun = np.zeros(len(self._clips), dtype=bool)
        table = joints()
        self._declared = np.array([gains(joint) for joint in table])
        self._limit = compensation.limits.torque_share * np.array([joint.effort_limit for joint in table])
        self._ranges = np.array([joint.range for joint in table])
        self._fastest = np.array([joint.velocity_limit for joint in table])
        self._terms = [(column, value, read_term(text)) for column, value, text in compensation.terms]
        c = compensation
        arrays = (c.damping, c.dry, c.stiction, c.load_friction, c.bias, c.spring, c.armature)
        listed = c.cogging or c.hysteresis or c.terms or c.loads
        self._pushes = bool(listed or any(array.any() for array in arrays))
        same = np.allclose(c.kp, self._declared[:, 0], 1e-9) and np.allclose(c.kd, self._declared[:, 1], 1e-9)
        self._gains = (None, None) if same else (c.kp, c.kd)

    def hold(self, targets: np.ndarray) -> np.ndarray:
        """Targets (B, J) [rad] that the drives must be told to stand at targets (B, J) [rad] before the start."""
        return targets + self.compensation.encoder_offset

    def seen(self, sensors: Sensors) -> Sensors:
        """The readings as the policy may take them."""
        return put_right(self.compensation, sensors)

    def command(self, robots: np.ndarray, tick: int, seen: Sensors, target: np.ndarray) -> ServoCommand:
        """Command to the drives of `robots` (n,) in place of the policy's target (n, J) [rad].

        Args:
            robots: which.
            tick: of control.
            seen: their readings, put right.
            target: what the policy wants.
        """
        c, clips = self.compensation, self._clips[robots]
        wanted = self._early(robots, tick, target) if c.lead_time.any() else target
        sent = wanted + c.encoder_offset
        torque = self._torque(clips, tick, seen, target, sent) if self._pushes else None
        return ServoCommand(sent, torque, *self._gains)

    def _early(self, robots: np.ndarray, tick: int, target: np.ndarray) -> np.ndarray:
        """Targets (n, J) with the reference as far ahead as commands are late, corrections carried on part of the way.

        A correction answers to readings, and nobody reads ahead: its present rate is all there is to go by.
        """
        c, clips = self.compensation, self._clips[robots]
        then = (tick + 1) * self._frame + np.zeros_like(c.lead_time)
        now = self._table.at("hold", clips, then)
        correction = target - now
        before = np.where(self._begun[robots, None], self._correction[robots], correction)
        self._correction[robots], self._begun[robots] = correction, True
        command_delay = c.lead_time + c.encoder_delay
        ahead = c.limits.correction_share * command_delay / self._dt * (correction - before)
        wanted = self._table.at("hold", clips, then + c.lead_time * self._fps) + correction + ahead
        # A target that lies within the range stays there; one that the policy itself put beyond goes no further.
        low, high = np.minimum(self._ranges[:, 0], target), np.maximum(self._ranges[:, 1], target)
        return np.clip(wanted, low, high)

    def _torque(self, clips: np.ndarray, tick: int, seen: Sensors, target: np.ndarray, sent: np.ndarray) -> np.ndarray:
        """Feed-forward torque (n, J) [N m] as it is sent."""
        c, share, table = self.compensation, self.compensation.limits.friction_share, self._table
        frame = (tick + 0.5) * self._frame + c.torque_lead * self._fps  # the middle of the period in which it acts
        v = self._slow_enough(table.at("speed", clips, frame))
        drawn = self._slow_enough(self._drawn(clips, tick, seen, target))
        q = seen.joint_pos + (0.5 * self._dt + c.torque_lead) * seen.joint_vel
        dry = c.dry + c.stiction * np.exp(-((drawn / c.stiction_speed) ** 2))
        dry = dry + c.load_friction * np.abs(seen.joint_torque) + self._discovered(q, drawn, sent, True)
        torque = share * dry * np.tanh(drawn / c.limits.still_speed) + c.damping * v
        torque += c.bias + c.spring * q + table.at("weight", clips, frame)
        torque += c.armature * table.at("acceleration", clips, frame) + share * table.at("bent", clips, frame)
        torque -= self._cogging(q, seen.joint_vel) + self._discovered(q, v, sent, False)
        torque = np.nan_to_num(torque / c.strength, nan=0.0, posinf=0.0, neginf=0.0)
        return np.clip(torque, -self._limit, self._limit)

    def _drawn(self, clips: np.ndarray, tick: int, seen: Sensors, target: np.ndarray) -> np.ndarray:
        """Velocity (n, J) [rad/s] to which the drive draws a joint: where kp (target - reading) and kd balance.

        The target less what carries the weight. Better than the reference's own velocity, as a policy's corrections
        break away from friction too: with 20 % of the effort limit on eight joints the key bodies' distance falls from
        39 to 12.5 mm, with the reference's to 15.5 mm (10.1 mm without friction). It is only pushed with a share of the
        friction that is there, so that it cannot feed itself.
        """
        then = (tick + 1) * self._frame + np.zeros_like(self._limit)
        rate = self._declared[:, 0] / self._declared[:, 1]
        return rate * (target - self._table.at("lead", clips, then) - seen.joint_pos)

    def _slow_enough(self, velocity: np.ndarray) -> np.ndarray:
        """Velocities (n, J), 0 where beyond the joints' limits: nothing is fed forward there."""
        return np.where(np.abs(velocity) <= self._fastest, velocity, 0.0)

    def _cogging(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Mean cogging torque (n, J) of the coming period at angles q in its middle: it fades as teeth fly past."""
        out = np.zeros_like(q)
        for column, sine, cosine, periods in self.compensation.cogging:
            angle = periods * q[:, column]
            fade = np.sinc(periods * v[:, column] * self._dt / (2 * np.pi))
            out[:, column] += fade * (sine * np.sin(angle) + cosine * np.cos(angle))
        return out

    def _discovered(self, q: np.ndarray, v: np.ndarray, u: np.ndarray, rubs: bool) -> np.ndarray:
        """Sum (n, J) of the discovered terms that are losses, or of the others."""
        out, names = np.zeros_like(q), self.compensation.joints
        for column, coefficient, term in self._terms:
            if term.rubs != rubs:
                continue
            values = {"q": q[:, column], "v": v[:, column], "u": u[:, column]}
            for other in term.others:
                k = names.index(other)
                values |= {f"q[{other}]": q[:, k], f"v[{other}]": v[:, k]}
            with np.errstate(all="ignore"):
                out[:, column] += coefficient * term(values)
        return np.maximum(out, 0.0) if rubs else out


def put_right(compensation: Compensation, sensors: Sensors) -> Sensors:
    """Readings without the offsets of encoders and IMU, carried on where they come late."""
    place, quat = _put_right(compensation, sensors.joint_pos, sensors.joint_vel, sensors.base_quat)
    return replace(sensors, joint_pos=place, base_quat=quat)


def put_right_rollout(compensation: Compensation, rollout: Rollout) -> Rollout:
    """The log of a robot with its readings put right: where its bodies were, as far as anybody knows.

    A log keeps what the sensors said. Whoever measures how well a motion was followed needs this on both sides, with
    and without the compensation: an encoder that is off makes one robot look better and the other look worse.
    """
    if rollout.base_quat is None:
        raise BadInput(rollout.rollout_id, "a rollout with the column base_quat", "none")
    place, quat = _put_right(compensation, rollout.joint_pos, rollout.joint_vel, rollout.base_quat)
    return replace(rollout, joint_pos=place, base_quat=quat)


def _put_right(c: Compensation, place: np.ndarray, speed: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, ...]:
    angle = float(np.linalg.norm(c.imu))
    if angle > 0:
        quat = quaternions.multiply(quat, quaternions.from_axis_angle(c.imu / angle, -angle))
    return place - c.encoder_offset + speed * c.encoder_delay, quat
