"""Joints, tendons and pairs that effects add, with nothing of what a model's defaults give to its own."""

from typing import Any

import mujoco

_JOINT = (
    *("damping", "stiffness", "springref", "springdamper", "springyield", "frictionloss", "armature"),
    *("ref", "limited", "range", "margin", "actfrclimited", "actgravcomp"),
    *("solref_limit", "solimp_limit", "solref_friction", "solimp_friction"),
)
_TENDON = tuple(field for field in _JOINT if field not in ("springref", "springdamper", "ref", "actgravcomp"))
_PAIR = ("margin", "gap", "solref", "solreffriction", "solimp")


def bare_joint(body: Any, **given: Any) -> Any:
    """A joint of `body`."""
    return _as(body.add_joint(), mujoco.MjSpec().worldbody.add_body().add_joint(), _JOINT, given)


def bare_tendon(spec: mujoco.MjSpec, **given: Any) -> Any:
    """A tendon of `spec`."""
    return _as(spec.add_tendon(), mujoco.MjSpec().add_tendon(), (*_TENDON, "springlength"), given)


def bare_pair(spec: mujoco.MjSpec, **given: Any) -> Any:
    """A contact pair of `spec`."""
    return _as(spec.add_pair(), mujoco.MjSpec().add_pair(), _PAIR, given)


def _as(made: Any, fresh: Any, fields: tuple[str, ...], given: dict[str, Any]) -> Any:
    """`made` with the `fields` of an element of an empty model, and with what is given."""
    for field in fields:
        setattr(made, field, getattr(fresh, field))
    for field, value in given.items():
        setattr(made, field, value)
    return made
