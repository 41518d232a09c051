"""A random robot as MJCF: trees of slides and hinges with any drives, fixed or floating, the same for the same seed.

What the diagnosis refuses (a drive on a tendon, an actuator that integrates) is drawn now and then: it must be refused
in one line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
DRIVES = ("position", "motor", "velocity", "general", "dcmotor")
CUBE = " ".join(f"{x} {y} {z}" for x in (-0.05, 0.05) for y in (-0.04, 0.04) for z in (-0.1, 0.1))


@dataclass(frozen=True)
class Size:
    """How large a case may be."""

    joints: int = 30
    seconds: float = 60.0
    rows: int = 60_000
    """Rows of all rollouts together, times the joints a tenth."""
    rollouts: int = 6


SMALL = Size(joints=3, seconds=4.0, rows=900, rollouts=3)


@dataclass
class Robot:
    """A declared model and what is known of how it was drawn."""

    xml: str
    joints: tuple[str, ...]
    drive: str
    """Drive of all driven joints."""
    driven: tuple[bool, ...]
    floating: bool
    motor_gains: tuple[float, float] | None
    """kp, kd of position targets for motors, which the rollouts' metadata then say."""
    about: list[str] = field(default_factory=list)


@dataclass
class _Draft:
    rng: np.random.Generator
    bodies: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    slides: list[bool] = field(default_factory=list)
    about: list[str] = field(default_factory=list)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)


def make_robot(rng: np.random.Generator, size: Size) -> Robot:
    """A robot of 1 to `size.joints` joints."""
    draft = _Draft(rng)
    most = int(rng.choice([2, 4, 8, 16, 30], p=[0.25, 0.3, 0.25, 0.12, 0.08]))
    count = int(rng.integers(1, min(size.joints, most) + 1))
    floating = draft.chance(0.2)
    look = str(rng.choice(["none", "geoms", "mesh"], p=[0.5, 0.35, 0.15]))
    if floating:
        draft.bodies.append(_body(draft, "base", "0 0 0.6", "<freejoint/>", look))
        draft.parents.append(-1)
    while len(draft.joints) < count:
        _add_body(draft, floating, look, count)
    drive = str(rng.choice(DRIVES, p=[0.4, 0.35, 0.08, 0.12, 0.05]))
    driven = tuple(not (draft.chance(0.1) and k) for k in range(count))
    gains = (float(10 ** rng.uniform(0, 1.5)), float(10 ** rng.uniform(-1.5, 0))) if drive == "motor" else None
    gains = gains if draft.chance(0.3) else None
    joined, actuators = _joined(draft), _actuators(draft, drive, driven)
    text = _document(draft, floating, look, joined, actuators)
    about = [f"{count} joints", "floating" if floating else "fixed", drive, look, *draft.about]
    return Robot(text, tuple(draft.joints), drive, driven, floating, gains, about)


def _add_body(draft: _Draft, floating: bool, look: str, count: int) -> None:
    """One more body: mostly on one joint, else welded or on two."""
    rng, k = draft.rng, len(draft.bodies)
    known = len(draft.parents)
    parent = -1 if not known or (not floating and draft.chance(0.12)) else int(rng.integers(max(0, known - 2), known))
    joints, more = "", 0 if draft.chance(0.07) else 2 if draft.chance(0.06) else 1
    for _ in range(min(more, count - len(draft.joints))):
        joints += _joint(draft)
    if more == 0:
        draft.about.append("weld")
    centred = draft.chance(0.2)
    place = "0 0 0" if k == 0 else " ".join(f"{x:.3f}" for x in rng.uniform(-0.25, 0.25, 3))
    draft.bodies.append(_body(draft, f"link{k}", place, joints, look, centred))
    draft.parents.append(parent)


def _joint(draft: _Draft) -> str:
    rng, name = draft.rng, f"joint{len(draft.joints)}"
    slide = draft.chance(0.25)
    draft.joints.append(name)
    draft.slides.append(slide)
    axis = ("1 0 0", "0 1 0", "0 0 1")[int(rng.integers(3))]
    most = 0.4 if slide else 2.5
    limits = f'range="{-most} {most}"' if draft.chance(0.4) else ""
    parts = [f'damping="{10 ** rng.uniform(-2, 0):.4g}"', f'armature="{10 ** rng.uniform(-3, -1):.4g}"']
    parts += [f'frictionloss="{10 ** rng.uniform(-2, -0.5):.4g}"'] * draft.chance(0.3)
    parts += [f'stiffness="{10 ** rng.uniform(-1, 1):.4g}"'] * draft.chance(0.15)
    return f'<joint name="{name}" type="{"slide" if slide else "hinge"}" axis="{axis}" {limits} {" ".join(parts)}/>'


def _body(draft: _Draft, name: str, place: str, joints: str, look: str, centred: bool = False) -> str:
    """The opening of a body; it is closed where its children are known."""
    rng, mass = draft.rng, float(10 ** draft.rng.uniform(-1, 0.7))
    centre = "0 0 0" if centred else " ".join(f"{x:.3f}" for x in rng.uniform(-0.08, 0.08, 3))
    moments = mass * 0.01 * rng.uniform(0.7, 1.0, 3)
    own = f'<inertial pos="{centre}" mass="{mass:.4g}" diaginertia="{" ".join(f"{m:.5g}" for m in moments)}"/>'
    touch = "" if name in ("base", "link1") else 'contype="0" conaffinity="0"'
    if look == "geoms":
        own = f'<geom name="{name}_shape" type="box" size=".06 .05 .08" mass="{mass:.4g}" {touch}/>'
    elif look == "mesh":
        own = f'<geom name="{name}_shape" type="mesh" mesh="cube" mass="{mass:.4g}" {touch}/>'
    return f'<body name="{name}" pos="{place}">{joints}{own}'


def _joined(draft: _Draft) -> str:
    """Tendons and equalities between joints."""
    if len(draft.joints) < 2:
        return ""
    rng, out = draft.rng, ""
    one, other = rng.choice(draft.joints, 2, replace=False)
    if draft.chance(0.12):
        draft.about.append("tendon")
        spring = "stiffness" if draft.chance(0.5) else "damping"
        out += f'<tendon><fixed name="cord" {spring}="{10 ** rng.uniform(-1, 1):.3g}"><joint joint="{one}" coef="1"/>'
        out += f'<joint joint="{other}" coef="-0.5"/></fixed></tendon>'
    if draft.chance(0.1):
        draft.about.append("equality")
        out += f'<equality><joint joint1="{one}" joint2="{other}" polycoef="0 0.7 0 0 0"/></equality>'
    return out


def _actuators(draft: _Draft, drive: str, driven: Sequence[bool]) -> str:
    rng, out = draft.rng, ""
    geared, limited = draft.chance(0.4), draft.chance(0.5)
    for name, has in zip(draft.joints, driven, strict=True):
        if not has:
            continue
        gear = float(rng.choice([-3.0, 0.5, 6.0, 30.0])) if geared else 1.0
        force = f'forcerange="{-40 / abs(gear):.4g} {40 / abs(gear):.4g}"' if limited else ""
        out += _drive(drive, name, gear, force, float(10 ** rng.uniform(0.3, 2)))
        if draft.chance(0.06):
            draft.about.append("two drives on a joint")
            out += f'<velocity joint="{name}" kv="0.3"/>' if draft.chance(0.5) else f'<motor joint="{name}"/>'
    if "cord" in "".join(draft.about) or ("tendon" in draft.about and draft.chance(0.2)):
        draft.about.append("drive on a tendon")
        out += '<motor tendon="cord"/>'
    if draft.chance(0.02):
        draft.about.append("integrating drive")
        out += f'<intvelocity joint="{draft.joints[0]}" kp="5" actrange="-1 1"/>'
    return out


def _drive(kind: str, joint: str, gear: float, force: str, gain: float) -> str:
    """One actuator; `gain` is the stiffness at the joint [N m/rad] of those that have one."""
    at = f'joint="{joint}" gear="{gear:g}"'
    own, damp = gain / gear**2, 0.1 * gain / gear**2
    if kind == "position":
        return f'<position {at} kp="{own:.5g}" kv="{damp:.5g}" {force}/>'
    if kind == "velocity":
        return f'<velocity {at} kv="{damp:.5g}" {force}/>'
    if kind == "general":
        bias = f'gainprm="{own:.5g}" biastype="affine" biasprm="0 {-own:.5g} {-damp:.5g}"'
        return f'<general {at} {bias} dyntype="filterexact" dynprm="0.005" {force}/>'
    if kind == "dcmotor":
        return f'<dcmotor joint="{joint}" motorconst="0.5" resistance="1"/>'
    return f"<motor {at} {force}/>"


def _document(draft: _Draft, floating: bool, look: str, joined: str, actuators: str) -> str:
    rng = draft.rng
    integrator = str(rng.choice(INTEGRATORS))
    draft.about.append(integrator)
    children: dict[int, list[int]] = {}
    for k, parent in enumerate(draft.parents):
        children.setdefault(parent, []).append(k)

    def nested(k: int) -> str:
        return draft.bodies[k] + "".join(nested(c) for c in children.get(k, [])) + "</body>"

    floor = '<geom name="floor" type="plane" size="5 5 .1"/>' if floating else ""
    mesh = f'<asset><mesh name="cube" vertex="{CUBE}"/></asset>' if look == "mesh" else ""
    step = rng.choice([0.001, 0.002, 0.004, 0.005])
    return (
        f'<mujoco model="any"><compiler angle="radian" autolimits="true"/><option timestep="{step}" '
        f'integrator="{integrator}"/>{mesh}<worldbody>{floor}{"".join(nested(k) for k in children.get(-1, []))}'
        f"</worldbody>{joined}<actuator>{actuators}</actuator></mujoco>"
    )
