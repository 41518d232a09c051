"""Which sizes are still a robot with a fault: what its owner might put on the floor without knowing.

A joint may be bad but must not be seized, a load heavy but not a second robot. The benchmark's largest sizes
(`Kind.most`), chosen for what can be told apart, leave the shipped policy on its feet in most kinds: where a real fault
can be larger, its kind says so (`Kind.fault`). What the declared robot does by itself, joint by joint, is in peaks.yaml
(`benchmarks/peaks.py`).
"""

from functools import cache
from importlib.resources import files

import yaml

from bumblebee.stand_in.undeclared.kind import Kind, Place


def largest(kind: Kind, place: Place) -> float:
    """The largest size of a kind there that is still a robot with a fault."""
    held = kind.most(place) if kind.name == "series_elasticity" else float("inf")  # a softer shaft swings by itself
    return max(min((kind.fault or kind.most)(place), held), kind.least(place))


@cache
def peaks() -> dict[str, tuple[float, float, float]]:
    """Joint of the G1 -> usual peaks of torque [N m], speed [rad/s] and change of the target [rad/s]."""
    table = yaml.safe_load(files(__package__).joinpath("peaks.yaml").read_text())
    return {name: (float(torque), float(speed), float(rate)) for name, (torque, speed, rate) in table.items()}
