"""Every kind of effect in the lottery: how a size becomes a law, what the contract calls it, how far it may go.

A file of this folder with `KINDS`, a law beside its rows, is found by itself: that is how a new one comes in.
"""

import pkgutil
from collections.abc import Callable, Iterator
from importlib import import_module

import numpy as np

from bumblebee.stand_in.undeclared import bodies, drives, friction, gears, outside, setpoints, signals
from bumblebee.stand_in.undeclared.kind import Kind, Made, Place, fits, places
from bumblebee.stand_in.undeclared.law import Law
from bumblebee.stand_in.undeclared.ringing import softest

__all__ = ["CATALOGUE", "KINDS", "LATER", "OUTSIDE", "Kind", "Place", "fits", "places"]


def _scaled(field_name: str, share: float) -> Callable[[Place], float]:
    return lambda p: share * p.of(getattr(p.robot, field_name))


def _read(p: Place) -> float:
    """Place of the encoder of play and shafts, as the contract has it: 0 the motor, 1 the joint."""
    return float(p.draw["sign"] < 0)


def _softest(p: Place) -> float:
    """The largest compliance of a shaft: as soft as the servo, and with the encoder on the joint no self-made swing."""
    soft = 1.0 / p.of(p.robot.kp)
    return min(soft, softest(p.robot, p.name)) if _read(p) else soft


def _fixed(value: float) -> Callable[[Place], float]:
    return lambda p: value


def _gain(kp: bool, kd: bool) -> Callable[[Place, float], Made]:
    def make(p: Place, s: float) -> Made:
        factor = 1 + p.draw["sign"] * s
        return drives.Gains(p.j, factor if kp else 1.0, factor if kd else 1.0), {"factor": factor}

    return make


def _mass(p: Place, s: float) -> Made:
    mass = p.robot.mass[p.name] * (1 + s)
    return bodies.Mass(p.name, mass), {"mass": mass}


def _wrench(p: Place, s: float) -> Made:
    force = np.zeros(3)
    force[p.draw["axis"]] = p.draw["sign"] * s
    body = int(p.robot.spec.compile().body(p.name).id)
    return bodies.Wrench(body, force), dict.fromkeys(_WRENCH, 0.0) | {f"f{'xyz'[p.draw['axis']]}": p.draw["sign"] * s}


_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


def _two(one: str, other: str, which: int, value: float) -> dict[str, float]:
    return {one: value * (which == 0), other: value * (which == 1)}


def _turned(axis: int, angle: float) -> dict[str, float]:
    """Gravity's turn about the world's x and y for a floor that rises by `angle` ahead (axis 0) or to the left (1)."""
    return {"x": -angle, "y": 0.0} if axis else {"y": angle, "x": 0.0}


def _shifted(p: Place, s: float) -> dict[str, float]:
    com = p.robot.spec.compile().body(p.name).ipos.copy()
    com[p.draw["axis"]] += p.draw["sign"] * s
    return dict(zip("xyz", com.tolist(), strict=True))


def _moments(p: Place, factor: float) -> dict[str, float]:
    moments = p.robot.spec.compile().body(p.name).inertia * factor
    return dict(zip(("xx", "yy", "zz"), moments.tolist(), strict=True))


def _signed(law: Callable[[Place, float], Law], parameter: str) -> Callable[[Place, float], Made]:
    return lambda p, s: (law(p, p.draw["sign"] * s), {parameter: p.draw["sign"] * s})


def _plain(law: Callable[[Place, float], Law], parameter: str) -> Callable[[Place, float], Made]:
    return lambda p, s: (law(p, s), {parameter: s})


def _plain_of(
    size: Callable[[Place, float], float], law: Callable[[str, float], Law], parameter: str, **others: float
) -> Callable[[Place, float], Made]:
    return lambda p, s: (law(p.name, size(p, s)), {parameter: size(p, s), **others})


_L, _KP, _KD = (lambda x: _scaled("limit", x)), (lambda x: _scaled("kp", x)), (lambda x: _scaled("kd", x))

CATALOGUE: tuple[Kind, ...] = (
    Kind("coulomb_friction", "joint",
         lambda p, s: (friction.Coulomb(p.name, p.of(p.robot.friction) + s),
                       {"frictionloss": p.of(p.robot.friction) + s}), _L(0.01), _L(0.2),
         fault=_L(0.2), unit="N m"),  # a gear without grease: 28 N m at the knee, 5 at the elbow
    Kind("viscous_friction", "joint",
         lambda p, s: (friction.Viscous(p.name, s), {"damping": p.of(p.robot.damping) + s}), _KD(0.03), _KD(1.0),
         fault=_KD(2.0), unit="N m s/rad"),
    Kind("stribeck_friction", "joint",
         lambda p, s: (friction.Stribeck(p.name, s), {"stiction": 0.6 * s, "velocity": friction.STRIBECK_SPEED}),
         _L(0.01), _L(0.2), parts=("coulomb_friction",),
         fault=_L(0.2), unit="N m, rad/s"),
    Kind("load_dependent_friction", "joint", _plain(lambda p, s: friction.LoadFriction(p.name, s), "coefficient"),
         _fixed(0.05), _fixed(0.6),
         fault=_fixed(0.6)),  # share of what the drive gives that is lost
    Kind("asymmetric_friction", "joint",
         lambda p, s: (friction.AsymmetricFriction(p.name, s, 0.25 * s) if p.draw["sign"] > 0
                       else friction.AsymmetricFriction(p.name, 0.25 * s, s),
                       {"difference": 0.75 * s * p.draw["sign"]}), _L(0.01), _L(0.2), parts=("coulomb_friction",),
         fault=_L(0.2), unit="N m"),
    Kind("armature", "joint",
         lambda p, s: (friction.Armature(p.name, p.of(p.robot.armature) * (1 + s)),
                       {"armature": p.of(p.robot.armature) * (1 + s)}), _fixed(0.2), _fixed(4.0),
         fault=_fixed(4.0), unit="kg m^2"),  # five times the declared rotor
    Kind("motor_strength", "joint", lambda p, s: (drives.Strength(p.j, 1 - s), {"factor": 1 - s}),
         _fixed(0.03), _fixed(0.6),
         fault=_fixed(0.8)),  # a fifth is left
    Kind("kp", "joint", _gain(True, False), _fixed(0.03), _fixed(0.5),
         fault=_fixed(0.7)),
    Kind("kd", "joint", _gain(False, True), _fixed(0.05), _fixed(0.6),
         fault=_fixed(0.8)),
    Kind("torque_limit", "joint",
         lambda p, s: (drives.TorqueLimit(p.name, 1.05 * p.peak_torque / (1 + s)),
                       {"limit": 1.05 * p.peak_torque / (1 + s)}),
         _fixed(0.3), _fixed(4.0),
         fault=_fixed(4.0), unit="N m"),  # 21 % of what half of the motions ask for: a drive that protects itself
    Kind("torque_speed_limit", "joint",
         lambda p, s: (drives.TorqueSpeed(p.name, p.of(p.robot.limit), p.peak_speed * (0.7 + 1 / s)),
                       {"speed": p.peak_speed * (0.7 + 1 / s)}), _fixed(2.0), _fixed(60.0),
         fault=_fixed(60.0), unit="rad/s"),  # no torque left at 72 % of the usual peak speed
    Kind("command_delay", "joint", _plain(lambda p, s: signals.CommandDelay(p.name, s), "delay"),
         _fixed(0.002), _fixed(0.04),
         fault=_fixed(0.06), unit="s"),  # three control periods
    Kind("torque_lag", "joint", _plain(lambda p, s: drives.TorqueLag(p.name, s), "time"),
         _fixed(0.002), _fixed(0.03),
         fault=_fixed(0.05), unit="s"),
    Kind("encoder_delay", "joint", _plain(lambda p, s: signals.EncoderDelay(p.name, s), "delay"),
         _fixed(0.002), _fixed(0.03), group="sensor",
         fault=_fixed(0.03), unit="s"),
    Kind("dropped_commands", "whole", _plain(lambda p, s: signals.DroppedCommands(s), "share"),
         _fixed(0.05), _fixed(0.5), events=1.6,
         fault=_fixed(0.6)),
    Kind("encoder_offset", "joint", _signed(lambda p, s: signals.EncoderOffset(p.name, s), "offset"),
         _fixed(0.01), _fixed(0.12), group="sensor",
         fault=_fixed(0.25), unit="rad"),  # 14 degrees: a joint calibrated by eye, or a tooth further
    Kind("imu_offset", "base", lambda p, s: (signals.ImuOffset(p.draw["axis"] % 2, p.draw["sign"] * s),
                       _two("roll", "pitch", p.draw["axis"] % 2, p.draw["sign"] * s)),
         _fixed(0.01), _fixed(0.12), robots="g1", group="sensor",
         fault=_fixed(0.12), unit="rad"),
    Kind("encoder_quantisation", "joint", _plain(lambda p, s: signals.EncoderQuantisation(p.name, s), "step"),
         _fixed(0.003), _fixed(0.05), group="sensor",
         fault=_fixed(0.10), unit="rad"),  # 63 steps a turn
    Kind("backlash", "joint",
         lambda p, s: (gears.Backlash(p.name, s, p.draw["sign"] > 0), {"gap": s, "encoder": _read(p)}),
         _fixed(0.01), _fixed(0.12),
         fault=_fixed(0.15), unit="rad"),
    Kind("series_elasticity", "joint",
         lambda p, s: (gears.Elastic(p.name, 1 / s, p.draw["sign"] > 0),
                       {"stiffness": 1 / s, "encoder": _read(p),
                        "loss": gears.LOSS * np.sqrt(gears.ROTOR * p.of(p.robot.armature) * s),
                        "share": 1 - gears.ROTOR}),
         lambda p: 0.1 / p.of(p.robot.kp), _softest,
         least=lambda p: 0.02 / p.of(p.robot.kp),
         fault=lambda p: 0.5 / p.of(p.robot.kp), unit="N m/rad"),  # a shaft twice as stiff as the servo
    Kind("cogging", "joint", lambda p, s: (friction.Cogging(p.name, s, p.draw["number"]),
                       {"sine": s, "cosine": 0.0, "periods": float(p.draw["number"])}),
         _L(0.01), _L(0.15),
         fault=_L(0.15), unit="N m"),
    Kind("joint_spring", "joint",
         lambda p, s: (friction.Spring(p.name, s), {"stiffness": s, "preload": 0.0}), _KP(0.03), _KP(0.6),
         fault=_KP(1.0), unit="N m/rad"),
    Kind("hysteresis", "joint",
         lambda p, s: (friction.Hysteresis(p.name, s), {"amplitude": s, "width": friction.REACH, "dahl": 1.0}),
         _L(0.01), _L(0.15),
         fault=_L(0.15), unit="N m, rad"),
    Kind("link_mass", "body", _mass, _fixed(0.1), _fixed(1.5), group="mass",
         fault=lambda p: min(max(1.5 * p.robot.mass[p.name], 3.0), 10.0) / p.robot.mass[p.name],
         unit="kg"),  # 3 kg in a hand, 10 on the back
    Kind("link_com", "body",
         lambda p, s: (bodies.Com(p.name, p.draw["axis"], p.draw["sign"] * s),
                       _shifted(p, s)), _fixed(0.01), _fixed(0.08), group="mass",
         fault=_fixed(0.08), unit="m"),
    Kind("link_inertia", "body", lambda p, s: (bodies.Inertia(p.name, 1 + s), _moments(p, 1 + s)),
         _fixed(0.3), _fixed(4.0), group="mass",
         fault=_fixed(4.0), unit="kg m^2"),
    Kind("ground_friction", "whole",
         lambda p, s: (bodies.GroundFriction(1 / (1 + s)), {"friction": 1 / (1 + s)}),
         _fixed(1.0), _fixed(6.0), robots="g1", group="contact",
         fault=_fixed(6.0)),  # a coefficient of 0.14: ice
    Kind("ground_compliance", "whole",
         lambda p, s: (bodies.GroundCompliance(0.02 * (1 + s)), {"time": 0.02 * (1 + s)}),
         _fixed(0.3), _fixed(4.0), robots="g1", group="contact",
         fault=_fixed(4.0), unit="s"),
    Kind("ground_slope", "whole", lambda p, s: (bodies.Slope(p.draw["axis"] % 2, p.draw["sign"] * s),
                       _turned(p.draw["axis"] % 2, p.draw["sign"] * s)),
         _fixed(0.01), _fixed(0.08), robots="g1", group="contact",
         fault=_fixed(0.10), unit="rad"),
    Kind("thermal_fade", "joint", _plain(lambda p, s: drives.Fade(p.name, p.of(p.robot.limit), s), "rate"),
         _fixed(0.3), _fixed(1.0),
         fault=_fixed(5.0), unit="1/s"),
    Kind("strength_drift", "joint", _plain(lambda p, s: drives.Drift(p.name, s), "rate"), _fixed(0.01), _fixed(0.1),
         fault=_fixed(0.10), unit="1/s"),
    Kind("external_wrench", "body", _wrench, _fixed(0.5), lambda p: 0.25 * 9.81 * sum(p.robot.mass.values()),
         group="contact",
         fault=lambda p: 0.12 * 9.81 * sum(p.robot.mass.values()), unit="N, N m"),  # 39 N: a cable that pulls
)  # fmt: skip

OUTSIDE: tuple[Kind, ...] = (
    Kind("position_friction", "joint", lambda p, s: (outside.PositionFriction(p.name, s), {"level": s}),
         _L(0.01), _L(0.15), depends=("position",),
         fault=_L(0.15), unit="N m"),
    Kind("odd_cogging", "joint", lambda p, s: (outside.OddCogging(p.name, s), {"amplitude": s}),
         _L(0.01), _L(0.12), depends=("position",),
         fault=_L(0.12), unit="N m"),
    Kind("gain_cycle", "joint", lambda p, s: (outside.GainCycle(p.name, s), {"share": s}),
         _fixed(0.03), _fixed(0.5), depends=("time",),
         fault=_fixed(0.8)),
    Kind("cross_coupling", "joint",
         lambda p, s: (outside.CrossCoupling(p.name, p.draw["other"], s), {"stiffness": s}),
         _KP(0.03), _KP(0.3), depends=("another joint", "other"),
         fault=_KP(0.6), unit="N m/rad"),
    Kind("tendon", "joint", lambda p, s: (outside.Tendon(p.name, s, 0.1), {"stiffness": s}),
         _KP(0.03), _KP(0.5), depends=("position",),
         fault=_KP(1.0), unit="N m/rad"),
    Kind("dwell_friction", "joint", lambda p, s: (outside.DwellFriction(p.name, s), {"level": s}),
         _L(0.01), _L(0.2), depends=("history", "velocity", "time"),
         fault=_L(0.2), unit="N m"),
    Kind("rate_limit", "joint", lambda p, s: (outside.RateLimit(p.name, p.peak_rate / (1 + s)),
                                              {"rate": p.peak_rate / (1 + s)}),
         _fixed(0.2), _fixed(5.0), parts=("command_rate_limit",),
         depends=("command", "history", "velocity", "target"),
         fault=_fixed(5.0), unit="rad/s"),  # a sixth of the usual peak rate
    Kind("quantised_command", "joint", lambda p, s: (outside.QuantisedCommand(p.name, s), {"step": s}),
         _fixed(0.01), _fixed(0.2), depends=("command", "target"),
         fault=_fixed(0.20), unit="rad"),
    Kind("loose_mount", "base", lambda p, s: (outside.LooseMount(1 / s), {"stiffness": 1 / s}),
         _fixed(1e-4), _fixed(1 / 300), least=_fixed(1e-5), robots="arm",
         depends=("another joint", "other", "history", "torque"),
         unit="N m/rad"),
    Kind("drag", "joint", lambda p, s: (outside.Drag(p.name, s), {"drag": s}),
         _KD(0.01), _KD(0.5), parts=("quadratic_friction",), depends=("velocity",),
         fault=_KD(0.5), unit="N m s^2/rad^2"),  # more is not stable at 1 ms in a fall
    Kind("dead_band", "joint", lambda p, s: (outside.DeadBand(p.name, s), {"band": s}),
         _fixed(0.005), _fixed(0.08), depends=("torque", "command", "target", "error"),
         fault=_fixed(0.10), unit="rad"),
    Kind("ripple", "joint", lambda p, s: (outside.Ripple(p.name, s), {"amplitude": s}),
         _L(0.01), _L(0.15), depends=("time",),
         fault=_L(0.15), unit="N m"),
)  # fmt: skip

LATER: tuple[Kind, ...] = (
    Kind("command_filter", "joint", _plain(lambda p, s: setpoints.CommandFilter(p.name, s), "time"),
         _fixed(0.003), _fixed(0.08),
         fault=_fixed(0.08), unit="s"),  # four control periods
    Kind("command_rate_limit", "joint",
         _plain_of(lambda p, s: p.peak_rate / (0.7 + s), setpoints.CommandRateLimit, "rate"), _fixed(0.2), _fixed(5.0),
         fault=_fixed(5.0), unit="rad/s"),
    Kind("command_profile", "joint",
         _plain_of(lambda p, s: max(p.peak_rate, 0.1) / s, setpoints.CommandProfile, "acceleration", speed=1e3),
         _fixed(0.06), _fixed(0.3), least=_fixed(0.05),
         fault=_fixed(0.3), unit="rad/s^2, rad/s"),  # 0.05: a delay of some milliseconds; 0.3 s to the usual peak rate
    Kind("quadratic_friction", "joint", _plain(lambda p, s: outside.Drag(p.name, s), "coefficient"),
         _KD(0.01), _KD(0.5),
         fault=_KD(0.5), unit="N m s^2/rad^2"),  # more is not stable at 1 ms in a fall
)  # fmt: skip
"""Kinds of the catalogue that came after the first suites: their cases stand behind those of the others, whose numbers
and draws stay as they were."""


def _beside_their_laws() -> Iterator[Kind]:
    package = __name__.rpartition(".")[0]
    for found in pkgutil.iter_modules(import_module(package).__path__, f"{package}."):
        if found.name != __name__:
            yield from getattr(import_module(found.name), "KINDS", ())


LATER += tuple(_beside_their_laws())
KINDS: dict[str, Kind] = {kind.name: kind for kind in (*CATALOGUE, *OUTSIDE, *LATER)}
