"""A humanoid that nobody sells: other names and proportions, 20 joints, no wrists, a waist of one joint, a neck."""

SIDES = (("l", 1), ("r", -1))


def mjcf(**changed: str) -> str:
    """Its MJCF; `changed` replaces parts of the text: a key's value by another, for what goes wrong."""
    legs = "".join(_leg(side, sign) for side, sign in SIDES)
    arms = "".join(_arm(side, sign) for side, sign in SIDES)
    joints = [f"{side}_{name}" for side, _ in SIDES for name in ("yaw", "roll", "pitch", "bend", "tip", "tilt")]
    joints += ["spin", "nod", *(f"{side}_{name}" for side, _ in SIDES for name in ("swing", "lift", "curl"))]
    torque = {"bend": 120, "pitch": 100, "roll": 100, "yaw": 80, "tip": 60, "tilt": 40, "spin": 80}
    motors = "".join(
        f'<motor joint="{name}" ctrlrange="-{torque.get(name[2:] or name, 25)} {torque.get(name[2:] or name, 25)}"/>'
        if name not in ("spin", "nod")
        else f'<motor joint="{name}" ctrlrange="-{torque.get(name, 10)} {torque.get(name, 10)}"/>'
        for name in joints
    )
    text = f"""<mujoco model="made-up"><compiler angle="radian" autolimits="true"/>
<default><joint armature="0.02"/></default>
<worldbody><body name="hips" pos="0 0 0.95"><freejoint/>{_mass(6, 0.12)}
<geom type="sphere" size="0.09"/>{legs}
<body name="chest" pos="0 0 0.12"><joint name="spin" axis="0 0 1" range="-1.5 1.5"/>{_mass(11, 0.15, "0 0 0.16")}
<geom type="capsule" size="0.1" fromto="0 0 0.05 0 0 0.3"/>
<body name="skull" pos="0 0 0.48"><joint name="nod" axis="0 1 0" range="-0.5 0.5"/>{_mass(1.5, 0.08)}</body>{arms}
</body></body></worldbody><actuator>{motors}</actuator></mujoco>"""
    for old, new in changed.items():
        assert old in text, old
        text = text.replace(old, new)
    return text


def _mass(mass: float, size: float, at: str = "0 0 0") -> str:
    moment = mass * size**2
    return f'<inertial pos="{at}" mass="{mass}" diaginertia="{moment:.5f} {moment:.5f} {moment:.5f}"/>'


def _leg(side: str, sign: int) -> str:
    return f"""<body name="{side}_rotor" pos="0 {sign * 0.1} -0.05">
<joint name="{side}_yaw" axis="0 0 1" range="-1 1"/>{_mass(1, 0.05)}<body name="{side}_joint">
<joint name="{side}_roll" axis="1 0 0" range="-0.6 0.6"/>{_mass(1, 0.05)}<body name="{side}_thigh">
<joint name="{side}_pitch" axis="0 1 0" range="-2 1"/>{_mass(4, 0.12, "0 0 -0.2")}
<geom type="capsule" size="0.06" fromto="0 0 -0.05 0 0 -0.35"/><body name="{side}_shin" pos="0 0 -0.42">
<joint name="{side}_bend" axis="0 1 0" range="0 2.3"/>{_mass(2.5, 0.1, "0 0 -0.18")}
<geom type="capsule" size="0.05" fromto="0 0 -0.05 0 0 -0.3"/><body name="{side}_cross" pos="0 0 -0.4">
<joint name="{side}_tip" axis="0 1 0" range="-0.9 0.6"/>{_mass(0.2, 0.02)}<body name="{side}_shoe">
<joint name="{side}_tilt" axis="1 0 0" range="-0.4 0.4"/><inertial pos="0.04 0 -0.05" mass="0.8"
diaginertia="0.0006 0.0026 0.003"/><geom type="box" size="0.11 0.045 0.015" pos="0.04 0 -0.055"/>
</body></body></body></body></body></body>"""


def _arm(side: str, sign: int) -> str:
    low, high = (-0.2, 2.5) if sign > 0 else (-2.5, 0.2)
    return f"""<body name="{side}_hub" pos="0 {sign * 0.2} 0.34">
<joint name="{side}_swing" axis="0 1 0" range="-2.5 2.5"/>
{_mass(0.8, 0.04)}<body name="{side}_upper"><joint name="{side}_lift" axis="1 0 0" range="{low} {high}"/>
{_mass(1.2, 0.07, "0 0 -0.13")}<body name="{side}_lower" pos="0 0 -0.27">
<joint name="{side}_curl" axis="0 1 0" range="-2.2 0.3"/>{_mass(0.9, 0.06, "0 0 -0.12")}
<geom type="capsule" size="0.035" fromto="0 0 0 0 0 -0.22"/></body></body></body>"""
