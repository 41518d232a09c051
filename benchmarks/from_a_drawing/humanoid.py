"""The G1 from a drawing: it stands and moves its arms, or follows motions under an exported policy.

The declared model lacks the rotors, or has them as its maker says; it never has friction. Gains are the same in both
and drawn about the maker's, which are made from its rotors. The truth is the sealed benchmark's robot: 1 ms, a servo
loop of its own, 50 Hz logs with that benchmark's noise.
"""

import math
from pathlib import Path

import mujoco
import numpy as np

from benchmarks.from_a_drawing.case import MORE, Case
from benchmarks.undeclared.excite import make_plan
from benchmarks.undeclared.flight import fly, rollouts
from bumblebee.diagnosis.dataset import make_session
from bumblebee.robot.model import build_spec
from bumblebee.stand_in.undeclared.declared import describe
from bumblebee.stand_in.undeclared.signals import CommandDelay

ROBOTS = ("stand", "track")
_COUNT, _SECONDS = 8, 6.0
_ROTOR, _DRY, _VISCOUS = (0.5, 2.0), (0.005, 0.03), (0.0, 0.1)
"""Factors on the maker's rotors, dry friction as a share of the torque limit, viscous as one of the servo's kd."""
_STIFF, _DAMPED = (0.8, 1.25), (0.6, 1.4)
"""Factors on the maker's kp and kd."""
_LATE, _LOAD, _CARRIER = (0.005, 0.02), (1.0, 4.0), "torso_link"
"""Delays [s]; loads [kg], and the link that they are on."""


def case(seed: int, robot: str, policy: Path | None) -> Case:
    """One G1 with its logs; `policy` is needed where it tracks motions."""
    rng = np.random.default_rng([21, seed])
    true, drawn, maker = build_spec(), build_spec(), describe(robot, build_spec())
    rotors = bool(rng.random() < 0.5)
    sizes: dict[str, dict[str, float]] = {"armature": {}, "coulomb_friction": {}}
    for j, name in enumerate(maker.joints):
        ours, theirs = true.joint(name), drawn.joint(name)
        ours.armature = maker.armature[j] * math.exp(rng.uniform(*np.log(_ROTOR)))
        ours.frictionloss = rng.uniform(*_DRY) * maker.limit[j]
        ours.damping[0] = rng.uniform(*_VISCOUS) * maker.kd[j]
        theirs.armature, theirs.frictionloss = maker.armature[j] if rotors else 0.0, 0.0
        _set_gains((true, drawn), name, rng.uniform(*_STIFF), rng.uniform(*_DAMPED))
        sizes["armature"][name], sizes["coulomb_friction"][name] = float(ours.armature), float(ours.frictionloss)
    more = str(rng.choice([MORE[0], MORE[0], MORE[1], MORE[3]]))
    late = float(rng.uniform(*_LATE)) if more == MORE[1] else 0.0
    if more == MORE[3]:
        true.body(_CARRIER).mass += float(rng.uniform(*_LOAD))
    laws = [CommandDelay(name, late) for name in maker.joints] if late else []
    plan = make_plan(maker, _COUNT, _SECONDS, np.random.default_rng([22, seed]), policy)
    flight = fly(describe(robot, true), laws, plan, np.random.default_rng([23, seed]))
    made = rollouts(describe(robot, drawn), flight, 1.0, np.random.default_rng([24, seed]), "run")
    row = {"robot": robot, "joints": len(maker.joints), "servo": True, "hz": 50.0, "rotors": rotors, "more": more}
    return Case(make_session(drawn, made, robot, "drawing"), sizes, row)


def _set_gains(specs: tuple[mujoco.MjSpec, ...], joint: str, stiff: float, damped: float) -> None:
    """Multiply the kp and kd of a joint's position servo in each model."""
    for spec in specs:
        servo = next(a for a in spec.actuators if a.target == joint)
        servo.gainprm[0] *= stiff
        servo.biasprm[1] *= stiff
        servo.biasprm[2] *= damped
