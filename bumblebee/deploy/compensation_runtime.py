"""The compensation at work: readings put right before the policy sees them, commands before the drives get them."""

from dataclasses import replace

import numpy as np

from bumblebee.deploy.compensation import Compensation
from bumblebee.deploy.compensation_reference import ReferenceTable
from bumblebee.deploy.sensors import Sensors
from bumblebee.deploy.servo_command import ServoCommand
from bumblebee.motion import quaternions
from bumblebee.robot.facts import joints
from bumblebee.robot.model import gains
from bumblebee.sim.effect_terms import read_term
from bumblebee.tracking.library import MotionLibrary


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
        self._tick_frames = dt * library.fps
        self._fps = library.fps
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
        """What the drives must be told (B, J) to stand at targets (B, J) [rad] before the start."""
        return targets + self.compensation.encoder_offset

    def seen(self, sensors: Sensors) -> Sensors:
        """The readings as the policy may take them."""
        c = self.compensation
        tilt = c.imu
        quat = sensors.base_quat
        angle = float(np.linalg.norm(tilt))
        if angle > 0:
            quat = quaternions.multiply(quat, quaternions.from_axis_angle(tilt / angle, -angle))
        place = sensors.joint_pos - c.encoder_offset + sensors.joint_vel * c.encoder_delay
        return replace(sensors, joint_pos=place, base_quat=quat)

    def command(self, robots: np.ndarray, tick: int, seen: Sensors, target: np.ndarray) -> ServoCommand:
        """What the drives of `robots` (n,) get in place of the policy's target (n, J) [rad].

        Args:
            robots: which.
            tick: of control.
            seen: their readings, put right.
            target: what the policy wants.
        """
        c, clips = self.compensation, self._clips[robots]
        wanted = target
        if c.lead_time.any():
            then = (tick + 1) * self._tick_frames + np.zeros_like(c.lead_time)
            hold = lambda frame: self._table.at("hold", clips, frame)  # noqa: E731
            wanted = target + hold(then + c.lead_time * self._fps) - hold(then)
            # A target that lies within the range stays there; one that the policy itself put beyond goes no further.
            low, high = np.minimum(self._ranges[:, 0], target), np.maximum(self._ranges[:, 1], target)
            wanted = np.clip(wanted, low, high)
        sent = wanted + c.encoder_offset
        torque = self._torque(clips, tick, seen, target, sent) if self._pushes else None
        return ServoCommand(sent, torque, *self._gains)

    def _torque(self, clips: np.ndarray, tick: int, seen: Sensors, target: np.ndarray, sent: np.ndarray) -> np.ndarray:
        """Feed-forward torque (n, J) [N m] as it is sent."""
        c, share, table = self.compensation, self.compensation.limits.friction_share, self._table
        late = c.lead_time + c.encoder_delay  # s from sending to acting
        frame = (tick + 0.5) * self._tick_frames + late * self._fps  # the middle of the period in which it acts
        v = self._intended(clips, tick, frame, seen, target)
        q = seen.joint_pos + (0.5 * self._dt + late) * seen.joint_vel
        dry = c.dry + c.stiction * np.exp(-((v / c.stiction_speed) ** 2))
        dry = dry + c.load_friction * np.abs(table.at("static", clips, frame)) + self._discovered(q, v, sent, True)
        torque = share * dry * np.tanh(v / c.limits.still_speed) + c.damping * v
        torque += c.bias + c.spring * q + table.at("weight", clips, frame)
        torque += c.armature * table.at("acceleration", clips, frame) + share * table.at("bent", clips, frame)
        torque -= self._cogging(q, seen.joint_vel) + self._discovered(q, v, sent, False)
        torque = np.nan_to_num(torque / c.strength, nan=0.0, posinf=0.0, neginf=0.0)
        return np.clip(torque, -self._limit, self._limit)

    def _intended(
        self, clips: np.ndarray, tick: int, frame: np.ndarray, seen: Sensors, target: np.ndarray
    ) -> np.ndarray:
        """Velocity (n, J) [rad/s] that the joints shall have: the reference's; 0 beyond the joints' limit."""
        v = self._table.at("speed", clips, frame)
        return np.where(np.abs(v) <= self._fastest, v, 0.0)

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
