"""Content of a robot.yaml, checked key by key."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bumblebee.errors import BadInput

SIDES = ("left", "right")
ROLES = (
    "pelvis",
    *(f"{side}_{part}" for side in SIDES for part in ("hip", "knee", "foot")),
    "torso",
    *(f"{side}_{part}" for side in SIDES for part in ("shoulder", "elbow", "hand")),
)
"""The 14 bodies whose positions are tracked ("keypoints"), by role, in the order of every array of them."""
CORNERS = 4
EVERY = "every"
"""In `motors`: what is said of all joints, in the place of the model's, but for those with a line of their own."""
MOTOR = ("kp", "kd", "effort_limit", "velocity_limit", "armature", "damping", "frictionloss")
"""Keys that `motors` may say of a joint: N m/rad, N m s/rad, N m, rad/s, kg m^2, N m s/rad, N m."""
_MAY_BE_0 = ("kd", "damping", "frictionloss")
_LEAST = 1e-6  # of a torque, a speed, a rotor or a stiffness, all of which something is divided by
_LONGEST = 100
_FAR = 10.0  # m

Vector = tuple[float, float, float]
Point = tuple[str, Vector | None]


@dataclass(frozen=True)
class Written:
    """A robot.yaml. Places [m] are in the named body's frame, which for the feet has the sole's normal as z."""

    robot: str
    key_bodies: Mapping[str, Point]
    head: tuple[str, Vector]
    neck: tuple[str, Vector]
    soles: Mapping[str, tuple[Vector, ...]]
    """Corners of both soles, as centres of spheres of `sole_radius`."""
    sole_radius: float
    model: str = ""
    bodies: str = ""
    held: tuple[str, ...] = ()
    motors: Mapping[str, Mapping[str, float]] = ()  # type: ignore[assignment]
    stand: Mapping[str, float] = ()  # type: ignore[assignment]
    layouts: Mapping[str, tuple[str, ...]] = ()  # type: ignore[assignment]
    """Joints that files of a known layout leave out, by the layout's name."""
    reach: Mapping[str, tuple[Vector, ...]] = ()  # type: ignore[assignment]
    """Corners that retargeting puts on the floor, heel left, heel right, toe left, toe right, where they are others."""


def require(where: object, said: Any) -> Written:
    """The file's content, or one line on what it lacks.

    Raises:
        BadInput: unknown or missing keys, a role without a body, no number where one belongs.
    """
    needed = ("robot", "key_bodies", "head", "neck", "soles", "sole_radius")
    known = (*needed, "model", "bodies", "held", "motors", "stand", "layouts", "reach")
    if not isinstance(said, Mapping):
        raise BadInput(where, f"a table of {', '.join(known)}", f"a {type(said).__name__}")
    unknown, lacks = [str(key) for key in said if key not in known], [key for key in needed if key not in said]
    if unknown or lacks:
        raise BadInput(where, ", ".join(known), f"unknown {unknown[0][:40]!r}" if unknown else f"no {lacks[0]}")
    if bool(said.get("model")) == bool(said.get("bodies")):
        raise BadInput(where, "`model`, the maker's MJCF, or `bodies`, a table of facts", "both or neither")
    source = said.get("model") or said["bodies"]
    if not isinstance(source, str) or "/" in source or source.startswith("."):
        raise BadInput(where, "the name of a file beside it", repr(source)[:60])
    return Written(
        robot=_name(f"{where}: robot", said["robot"]),
        key_bodies=_key_bodies(f"{where}: key_bodies", said["key_bodies"]),
        head=_placed(f"{where}: head", said["head"]),
        neck=_placed(f"{where}: neck", said["neck"]),
        soles=_soles(f"{where}: soles", said["soles"]),
        sole_radius=_number(f"{where}: sole_radius", said["sole_radius"], 1e-4, 0.1, "m"),
        model=source if said.get("model") else "",
        bodies=source if said.get("bodies") else "",
        held=_names(f"{where}: held", said.get("held", [])),
        motors=_motors(f"{where}: motors", said.get("motors", {})),
        stand={
            _name(f"{where}: stand", name): _number(f"{where}: stand.{name}", angle, -7.0, 7.0, "rad")
            for name, angle in _table(f"{where}: stand", said.get("stand", {})).items()
        },
        layouts={
            _name(f"{where}: layouts", name): _names(f"{where}: layouts.{name}", left_out)
            for name, left_out in _table(f"{where}: layouts", said.get("layouts", {})).items()
        },
        reach=_soles(f"{where}: reach", said["reach"]) if "reach" in said else {},
    )


def _key_bodies(where: str, said: Any) -> dict[str, Point]:
    table = _table(where, said)
    lacks, unknown = [role for role in ROLES if role not in table], [str(key) for key in table if key not in ROLES]
    if lacks or unknown:
        raise BadInput(where, ", ".join(ROLES), f"no {lacks[0]}" if lacks else f"unknown {unknown[0][:40]!r}")
    found: dict[str, Point] = {}
    for role in ROLES:
        value = table[role]
        found[role] = (value, None) if isinstance(value, str) else _placed(f"{where}.{role}", value)
    for role in ("pelvis", "left_foot", "right_foot"):
        if found[role][1] is not None:
            raise BadInput(f"{where}.{role}", "the name of a body", "a point of one")
    return found


def _soles(where: str, said: Any) -> dict[str, tuple[Vector, ...]]:
    table = _table(where, said)
    if sorted(map(str, table)) != sorted(SIDES):
        raise BadInput(where, "left and right", ", ".join(map(str, table))[:80])
    found = {}
    for side in SIDES:
        corners = table[side]
        if not isinstance(corners, list) or len(corners) != CORNERS:
            raise BadInput(f"{where}.{side}", f"{CORNERS} corners [x, y, z]", repr(corners)[:60])
        found[side] = tuple(_vector(f"{where}.{side}", corner) for corner in corners)
    return found


def _motors(where: str, said: Any) -> dict[str, dict[str, float]]:
    found = {}
    for name, table in _table(where, said).items():
        own = _table(f"{where}.{name}", table)
        if unknown := [str(key) for key in own if key not in MOTOR]:
            raise BadInput(f"{where}.{name}", ", ".join(MOTOR), f"unknown {unknown[0][:40]!r}")
        found[str(name)] = {
            key: _number(f"{where}.{name}.{key}", own[key], 0.0 if key in _MAY_BE_0 else _LEAST, 1e5, "") for key in own
        }
    return found


def _placed(where: str, said: Any) -> tuple[str, Vector]:
    if not isinstance(said, list) or len(said) != 2:
        raise BadInput(where, "[body, [x, y, z]]", repr(said)[:60])
    return _name(where, said[0]), _vector(where, said[1])


def _vector(where: str, said: Any) -> Vector:
    if not isinstance(said, list) or len(said) != 3:
        raise BadInput(where, "[x, y, z] [m]", repr(said)[:60])
    x, y, z = (_number(where, value, -_FAR, _FAR, "m") for value in said)
    return x, y, z


def _number(where: str, said: Any, least: float, most: float, unit: str) -> float:
    if isinstance(said, bool) or not isinstance(said, int | float) or not least <= said <= most:
        raise BadInput(where, f"a number from {least:g} to {most:g} {unit}".strip(), repr(said)[:40])
    return float(said)


def _names(where: str, said: Any) -> tuple[str, ...]:
    if not isinstance(said, list):
        raise BadInput(where, "a list of joints", repr(said)[:60])
    return tuple(_name(where, name) for name in said)


def _name(where: str, said: Any) -> str:
    if not isinstance(said, str) or not said.strip() or len(said) > _LONGEST:
        raise BadInput(where, f"a name of at most {_LONGEST} signs", repr(said)[:60])
    return said


def _table(where: str, said: Any) -> Mapping[str, Any]:
    if not isinstance(said, Mapping):
        raise BadInput(where, "a table", repr(said)[:60])
    return said
