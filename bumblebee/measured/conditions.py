"""Conditions of a rollout's recording: the metadata's `conditions`, and the gains beside them.

Known names have a meaning and a unit; any other name is a label of the user's, a text or a number. Labels group
rollouts and change no model.

| name | value | unit |
|---|---|---|
| added_mass | a list of {body, kg, position}; a point mass | body of the model; kg; m in the body's frame |
| supply_voltage | a number above 0 | V |
| temperature | a number | degrees C |
| heading | a number | rad, about the world's z axis |
| surface | a text | |
| targets | positions: targets that are readings of the positions were sent to the drives all the same | |
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

MOST = 64  # conditions of a rollout: a person writes them
LONGEST = 200  # characters of a name or a text
LARGEST = 1e9  # of any number
HEAVIEST = 1e4  # [kg]
FARTHEST = 100.0  # [m] from a body's frame
HOTTEST, COLDEST = 1000.0, -273.15  # [degrees C]
VOLTS = 1e4
INSISTED = ("targets", "positions")
"""Condition of rollouts whose targets are commands although they repeat the measured positions."""

Value = float | str
Refuse = Callable[[str, str, str], Exception]
"""(name, expected, came) -> the error that is raised."""


@dataclass(frozen=True)
class AddedMass:
    """A point mass fixed to a body."""

    body: str
    kg: float
    position: tuple[float, float, float]
    """[m] in the body's frame."""


def check_conditions(table: object, refuse: Refuse) -> None:
    """Raise what `refuse` makes of the first entry that does not keep the contract."""
    if not isinstance(table, Mapping):
        raise refuse("conditions", "names and values", type(table).__name__)
    if len(table) > MOST:
        raise refuse("conditions", f"at most {MOST} names", str(len(table)))
    for name, value in table.items():
        if not _is_text(name) or set("=,[]") & set(name) or name in ("kp", "kd"):
            raise refuse("conditions", "names without =, comma or brackets, and other than kp and kd", repr(name)[:80])
        expected = _expected(name, value)
        if expected:
            raise refuse(f"conditions: {name}", expected, repr(value)[:80])


def _expected(name: str, value: object) -> str:
    """Expected form of `value`; "" where it is right."""
    ranges = {
        "supply_voltage": (1e-6, VOLTS, "a number of volts above 0"),
        "temperature": (COLDEST, HOTTEST, f"degrees C from {COLDEST} to {HOTTEST:g}"),
        "heading": (-LARGEST, LARGEST, "a number of radians"),
    }
    if name == "added_mass":
        loads = value if isinstance(value, list) else [value]
        right = 0 < len(loads) <= MOST and all(map(_is_added_mass, loads))
        return "" if right else f"a list of {{body, kg from 0 to {HEAVIEST:g}, position: [x, y, z] in m}}"
    if name in ranges:
        low, high, expected = ranges[name]
        return "" if _is_number(value) and low <= value <= high else expected
    if name == INSISTED[0]:
        return "" if value == INSISTED[1] else f"the text {INSISTED[1]}"
    if name == "surface":
        return "" if _is_text(value) else f"a text of at most {LONGEST} characters"
    return "" if _is_text(value) or _is_number(value) else f"a number, or a text of at most {LONGEST} characters"


def _is_added_mass(load: object) -> bool:
    if not isinstance(load, Mapping) or set(load) != {"body", "kg", "position"} or not _is_text(load["body"]):
        return False
    place = load["position"]
    near = isinstance(place, list) and len(place) == 3 and all(_is_number(x) and abs(x) <= FARTHEST for x in place)
    return near and _is_number(load["kg"]) and 0 <= load["kg"] <= HEAVIEST


def _added_mass(load: Mapping[str, Any]) -> AddedMass:
    x, y, z = map(float, load["position"])
    return AddedMass(load["body"], float(load["kg"]), (x, y, z))


def added_masses(meta: Mapping[str, Any]) -> list[AddedMass]:
    """The point masses that a rollout's metadata state."""
    stated = (meta.get("conditions") or {}).get("added_mass", [])
    loads = stated if isinstance(stated, list) else [stated]
    return [_added_mass(load) for load in loads]


def stated_conditions(meta: Mapping[str, Any], joints: Sequence[str]) -> dict[str, Value]:
    """Name -> value of all that the metadata state of the conditions, as one number or text each.

    Gains are `kp` and `kd` where they are the same on all joints, and `kp[joint]` else; an added mass is its kg, all
    together and, where there are several bodies, as `added_mass[body]`.
    """
    out: dict[str, Value] = {}
    for key in ("kp", "kd"):
        values = meta.get(key)
        if values is not None and len({*values}) == 1:
            out[key] = float(values[0])
        elif values is not None:
            out |= {f"{key}[{joint}]": float(value) for joint, value in zip(joints, values, strict=True)}
    for name, value in (meta.get("conditions") or {}).items():
        if name == "added_mass":
            loads = added_masses(meta)
            out[name] = sum(load.kg for load in loads)
            bodies = {load.body for load in loads}
            if len(bodies) > 1:
                out |= {f"{name}[{b}]": sum(x.kg for x in loads if x.body == b) for b in sorted(bodies)}
        else:
            out[name] = value if isinstance(value, str) else float(value)
    return out


def _is_text(value: object) -> bool:
    return (
        isinstance(value, str)
        and 0 < len(value.strip()) <= len(value) <= LONGEST
        and all(ord(sign) >= 32 for sign in value)
    )


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST
