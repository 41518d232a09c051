"""A compensation in the making: the declared robot's numbers, what has been put together so far, and its bounds."""

from copy import deepcopy
from dataclasses import dataclass, field, fields

import mujoco
import numpy as np

from bumblebee.compensation.limits import CompensationLimits
from bumblebee.compensation.numbers import Compensation, Load, PlannedEffect
from bumblebee.errors import BadInput
from bumblebee.robot.facts import joint_names, joints, robot_bodies
from bumblebee.robot.model import gains
from bumblebee.sim.effects import Effect
from bumblebee.sim.servo import servos_of

_AS_DECLARED = 1e-3  # of a gain: what digits of an XML leave out
ONLY_G1 = (
    "Only policies of the G1 have a runner that compensates; for another robot use the corrected model.xml itself."
)


@dataclass(frozen=True, eq=False)
class DeclaredRobot:
    """Declared robot that effects are measured against; J joints."""

    model: mujoco.MjModel
    dofs: np.ndarray
    """(J,) addresses in qvel."""
    kp: np.ndarray
    kd: np.ndarray
    own_kp: np.ndarray
    """(J,) of the model's servos: other than the declared where it was corrected."""
    own_kd: np.ndarray
    offset: np.ndarray
    """(J,) of the model's encoders [rad]."""
    delay: np.ndarray
    """(J,) of the model's commands [s]."""
    effort: np.ndarray
    """(J,) [N m]."""
    ranges: np.ndarray
    """(J, 2) [rad]."""

    @classmethod
    def of(cls, model: mujoco.MjModel, where: object = "model") -> "DeclaredRobot":
        """From the model that the policy was trained on; one without the G1's joints is a `BadInput`."""
        have = {model.joint(i).name for i in range(model.njnt)} | {model.body(i).name for i in range(model.nbody)}
        if missing := [name for name in (*joint_names(), *robot_bodies()) if name not in have]:
            came = f"one without {missing[0]} ({len(missing)} joints, bodies missing)"
            raise BadInput(where, "a model of the G1", came, ONLY_G1)
        table = joints()
        kp, kd = np.array([gains(joint) for joint in table]).T
        servos = servos_of(model, [int(model.joint(name).id) for name in joint_names()])
        follows, a = servos.bias[:, 1] < 0, np.maximum(servos.actuator, 0)
        return cls(
            model=model,
            dofs=np.array([int(model.joint(name).dofadr[0]) for name in joint_names()]),
            kp=kp,
            kd=kd,
            own_kp=_own(follows, -servos.bias[:, 1], kp),
            own_kd=_own(follows, -servos.bias[:, 2], kd),
            offset=np.where(follows, servos.bias[:, 0] / np.where(follows, servos.bias[:, 1], 1.0), 0.0),
            delay=np.where(servos.actuator >= 0, model.actuator_delay[a], 0.0) if model.nu else np.zeros(len(kp)),
            effort=np.array([joint.effort_limit for joint in table]),
            ranges=np.array([joint.range for joint in table]),
        )


@dataclass(eq=False)
class Draft:
    """Arrays (J,) as in `Compensation`, but gains as factors."""

    robot: DeclaredRobot
    limits: CompensationLimits
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    kp_factor: np.ndarray = field(default_factory=lambda: np.ones(len(joint_names())))
    kd_factor: np.ndarray = field(default_factory=lambda: np.ones(len(joint_names())))
    viscous: np.ndarray = field(default_factory=lambda: np.zeros(len(joint_names())))
    """(J,) [N m s/rad] of excess damping."""
    imu: np.ndarray = field(default_factory=lambda: np.zeros(3))
    cogging: list[tuple[int, float, float, float]] = field(default_factory=list)
    hysteresis: list[tuple[int, float, float, float]] = field(default_factory=list)
    terms: list[tuple[int, float, str]] = field(default_factory=list)
    loads: dict[str, Load] = field(default_factory=dict)

    def __post_init__(self) -> None:
        zeros = ("encoder_offset", "encoder_delay", "command_delay", "torque_lag", "dry", "stiction", "load_friction")
        for name in (*zeros, "asymmetry", "preload", "spring", "armature"):
            self.arrays.setdefault(name, np.zeros(len(joint_names())))
        for name in ("strength", "stiction_speed"):
            self.arrays.setdefault(name, np.ones(len(joint_names())))

    def copy(self) -> "Draft":
        """Another one that can be changed by itself."""
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("robot", "limits")}
        return Draft(self.robot, self.limits, **deepcopy(own))

    def load(self, body: str) -> Load:
        """Load that a body carries so far."""
        model = self.robot.model
        mass, com = float(model.body(body).mass[0]), tuple(map(float, model.body(body).ipos))
        return self.loads.get(body, Load(body, (mass, mass), (com, com)))

    def carry(self, body: str, mass: float | None = None, com: tuple[float, ...] | None = None) -> None:
        """Note that a body's true mass [kg], or its centre of mass [m], is another."""
        was = self.load(body)
        masses = was.mass if mass is None else (was.mass[0], mass)
        self.loads[body] = Load(body, masses, was.com if com is None else (was.com[0], com))

    @property
    def lead_time(self) -> np.ndarray:
        """(J,) [s] for targets: one that comes late is sent early, a drive that reads late is told where the joint was.

        A lag of the torque counts for nothing: within the drive's loop it hardly delays what follows a target slowly.
        """
        return self.arrays["command_delay"] - self.arrays["encoder_delay"]

    @property
    def torque_lead(self) -> np.ndarray:
        """(J,) [s] for feed-forward torques."""
        return self.arrays["command_delay"] + self.arrays["torque_lag"]

    @property
    def kp(self) -> np.ndarray:
        """(J,) [N m/rad] sent."""
        return self.robot.own_kp / (self.arrays["strength"] * self.kp_factor)

    @property
    def kd_wanted(self) -> np.ndarray:
        """(J,) [N m s/rad] that the drive should give, less what the joint's own excess damping gives."""
        own = self.robot.own_kd
        return np.maximum(own - self.viscous, self.limits.damping_left * own)

    @property
    def kd(self) -> np.ndarray:
        """(J,) [N m s/rad] sent."""
        return self.kd_wanted / (self.arrays["strength"] * np.maximum(self.kd_factor, 1e-9))

    @property
    def constant_torque(self) -> np.ndarray:
        """(J,) [N m] that may be sent at most for effects of a known size."""
        a = self.arrays
        out = self.limits.friction_share * (np.abs(a["dry"]) + a["stiction"])
        reach = np.minimum(np.abs(self.robot.ranges).max(axis=1), self.limits.spring_reach)
        out += np.abs(0.5 * a["asymmetry"] - a["preload"]) + np.abs(a["spring"]) * reach
        for column, sine, cosine, _ in self.cogging:
            out[column] += np.hypot(sine, cosine)
        for column, amplitude, _, _ in self.hysteresis:
            out[column] += self.limits.friction_share * amplitude
        return out / a["strength"]

    def check(self, effect: Effect, where: str) -> None:
        """Refuse what lies beyond a limit; `where` names the effect in its file."""
        limits, robot, a = self.limits, self.robot, self.arrays
        for name, sent, declared in (("kp", self.kp, robot.kp), ("kd", self.kd * robot.kd / self.kd_wanted, robot.kd)):
            low, high = limits.gain_least, limits.gain_most
            _within(where, f"a {name} sent of {low:g} to {high:g} times the declared one", sent / declared, low, high)
        most = limits.gain_most
        _within(where, f"a kd sent of at most {most:g} times the declared one", self.kd / robot.kd, 0.0, most)
        offset, ahead = limits.offset, limits.look_ahead
        _within(where, f"an offset of at most {offset:g} rad", a["encoder_offset"], -offset, offset, "rad")
        for times in (self.lead_time, self.torque_lead, a["encoder_delay"]):
            _within(
                where, f"at most {1000 * ahead:g} ms to look ahead", 1000 * times, -1000 * ahead, 1000 * ahead, "ms"
            )
        tilt = float(np.linalg.norm(self.imu))
        if tilt > limits.imu:
            raise BadInput(where, f"an IMU turned by at most {limits.imu:g} rad", f"{tilt:.3g} rad")
        share = self.constant_torque / robot.effort
        most = limits.torque_share
        _within(where, f"feed-forward torque of at most {most:g} of the effort limit", share, 0.0, most)

    def finished(self, effects_sha256: str, plan: tuple[PlannedEffect, ...]) -> Compensation:
        """The compensation."""
        a = self.arrays
        names = ("encoder_offset", "encoder_delay", "strength", "dry", "stiction", "stiction_speed", "load_friction")
        return Compensation(
            joints=joint_names(),
            kp=self.kp,
            kd=self.kd,
            lead_time=self.lead_time,
            torque_lead=self.torque_lead,
            damping=self.viscous - (self.robot.own_kd - self.kd_wanted),
            bias=0.5 * a["asymmetry"] - a["preload"],
            imu=self.imu,
            cogging=tuple(self.cogging),
            hysteresis=tuple(self.hysteresis),
            terms=tuple(self.terms),
            loads=tuple(self.loads.values()),
            limits=self.limits,
            effects_sha256=effects_sha256,
            plan=plan,
            **{name: a[name] for name in (*names, "spring", "armature")},
        )


def _within(where: str, expected: str, values: np.ndarray, low: float, high: float, unit: str = "") -> None:
    """Every number (J,) from low to high, or a `BadInput` that names the worst joint."""
    beyond = np.maximum(values - high, low - values)
    worst = int(np.argmax(np.where(np.isfinite(beyond), beyond, np.inf)))
    if not beyond[worst] <= 1e-9 * max(1.0, abs(high)):
        raise BadInput(where, expected, f"{values[worst]:.3g} {unit}".strip() + f" on {joint_names()[worst]}")


def _own(follows: np.ndarray, gain: np.ndarray, declared: np.ndarray) -> np.ndarray:
    """Gains (J,) of servos where they are surely others than the declared ones."""
    return np.where(follows & (np.abs(gain / declared - 1.0) > _AS_DECLARED), gain, declared)
