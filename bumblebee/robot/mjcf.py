"""A maker's MJCF as the table of facts that every robot of ours is: its tree of hinges, without meshes.

What the table cannot hold is refused in one line, not dropped: joints that are no hinges, two joints of one body, a
base that does not float, equalities and tendons between joints, masses that only a mesh file would tell.
"""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.robot.drives import ON_JOINT, explicit_drives
from bumblebee.robot.model_size import LARGEST, refuse_multiplied
from bumblebee.robot.shapes import Bodies, capsule, floats

_MESH, _PLANE = mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_PLANE
_SIMPLE = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
}
_THINNEST = 0.005  # m of a shape that an inertia stands for


def bodies_of(path: Path) -> Bodies:
    """The table of a model's one floating tree, parents first.

    Args:
        path: MJCF. Meshes are left out: what else can touch stays, as spheres and capsules; a body of which only a mesh
            can touch gets a capsule of its mass and inertia, and one of which nothing can has no shape.

    Raises:
        BadInput: no model that loads without its meshes, or one that the table cannot hold.
    """
    model, meshed = compiled(path)
    bodies: Bodies = {}
    root = base_of(path, model)
    for body in (body for body in range(root, model.nbody) if model.body_rootid[body] == root):
        name = model.body(body).name
        if not name:
            above = model.body(int(model.body_parentid[body])).name
            raise BadInput(f"{path}: a body of {above or 'the world'}", "a name", "none", "Write `name` in it.")
        facts = _frame(model, body)
        facts["parent"] = "world" if body == root else model.body(int(model.body_parentid[body])).name
        if body != root and (joint := _joint(path, model, body)):
            facts["joint"] = joint
        if shapes := _shapes(model, body, name, name in meshed):
            facts["collision"] = shapes
        bodies[name] = facts
    return bodies


def compiled(path: Path) -> tuple[mujoco.MjModel, set[str]]:
    """A maker's model of what can touch, without meshes; and the bodies of which a mesh could.

    Where nothing touches by itself or in a `pair`, everything counts as if it could.

    Raises:
        BadInput: no model in one file that loads without its meshes.
    """
    text = read_text(path, LARGEST)
    if "\0" in text or "<mujoco" not in text:
        raise BadInput(path, "an MJCF model", "another file")
    if "<include" in text:
        raise BadInput(path, "a model in one file", "an `include`", "Write it whole: mujoco.mj_saveLastXML does.")
    refuse_multiplied(path, text)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
        touching = [g for g in spec.geoms if g.contype | g.conaffinity or g.name in paired]
        own = [geom for geom in touching if geom.type != _PLANE] or list(spec.geoms)
        meshed = {geom.parent.name for geom in own if geom.type == _MESH}
        for part in [*spec.pairs, *(geom for geom in spec.geoms if geom not in own or geom.type == _MESH)]:
            spec.delete(part)
        for part in (*spec.geoms, *spec.sites):
            part.material = ""
        for kind in (spec.meshes, spec.skins, spec.textures, spec.materials, spec.hfields):
            for element in list(kind):
                spec.delete(element)
        return explicit_drives(spec)[0].compile(), meshed
    except Exception as error:  # ValueError mostly; FatalError from MuJoCo's allocations
        came = " ".join(str(error).split())[:200]
        do = "Masses and inertias must be written in the model (`inertial`), since meshes are not read."
        raise BadInput(path, "an MJCF that loads without its meshes", came, do) from None


def base_of(path: Path, model: mujoco.MjModel) -> int:
    """The floating base with the largest tree.

    Raises:
        BadInput: none, or joints that do not move by themselves.
    """
    free = [int(model.jnt_bodyid[j]) for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    if not free:
        raise BadInput(
            path, "a base with a `freejoint`", "a model without one", "A robot that is bolted down cannot fall."
        )
    if model.neq or model.ntendon:
        came = f"{model.neq} equalities and {model.ntendon} tendons between joints or bodies"
        raise BadInput(path, "joints that move by themselves", came)
    return max(free, key=lambda body: int((model.body_rootid == body).sum()))


def _frame(model: mujoco.MjModel, body: int) -> dict[str, Any]:
    """Pose and inertia of a body."""
    return {
        "pos": floats(model.body_pos[body]),
        "quat": floats(model.body_quat[body]),
        "mass": float(model.body_mass[body]),
        "com": floats(model.body_ipos[body]),
        "inertia": floats(model.body_inertia[body]),
        "inertia_quat": floats(model.body_iquat[body]),
    }


def _joint(path: Path, model: mujoco.MjModel, body: int) -> dict[str, Any] | None:
    """The body's hinge with its drive, or None where it has none."""
    count, first = int(model.body_jntnum[body]), int(model.body_jntadr[body])
    if not count:
        return None
    joint = model.joint(first)
    if count > 1 or model.jnt_type[first] != mujoco.mjtJoint.mjJNT_HINGE:
        came = f"{count} joints" if count > 1 else "one that is no hinge"
        raise BadInput(f"{path}: {model.body(body).name}", "one hinge a body", came)
    if np.abs(model.jnt_pos[first]).max() > 1e-6:
        raise BadInput(f"{path}: {joint.name}", "a joint at its body's origin", "one beside it")
    if model.jnt_stiffness[first] or model.qpos0[model.jnt_qposadr[first]]:
        raise BadInput(f"{path}: {joint.name}", "a joint without a spring, at 0 in the model's pose", "another")
    if not model.jnt_limited[first]:
        raise BadInput(f"{path}: {joint.name}", "a range", "none", "Write one: a policy's targets end there.")
    dof = int(model.jnt_dofadr[first])
    told: dict[str, Any] = {
        "name": joint.name,
        "axis": floats(model.jnt_axis[first]),
        "range": floats(model.jnt_range[first]),
        "motor": "as in the model",
    }
    for key, value in (
        ("armature", model.dof_armature[dof] + _of_motors(model, first, model.actuator_armature)),
        ("damping", model.dof_damping[dof] + _of_motors(model, first, model.actuator_damping)),
        ("frictionloss", model.dof_frictionloss[dof]),
    ):
        if value > 0:
            told[key] = float(value)
    return told | _drive(path, model, first)


def _drive(path: Path, model: mujoco.MjModel, joint: int) -> dict[str, float]:
    """Torque limit and servo gains of the actuator on a joint, at the joint, as far as the model says them."""
    own = _motors(model, joint)
    if len(own) > 1:
        raise BadInput(f"{path}: {model.joint(joint).name}", "one drive", f"{len(own)} actuators")
    found: dict[str, float] = {}
    for actuator in own:
        gear = abs(float(model.actuator_gear[actuator, 0]))
        if model.actuator_forcelimited[actuator]:
            found["effort_limit"] = gear * float(np.abs(model.actuator_forcerange[actuator]).min())
        if model.actuator_biasprm[actuator, 1] < 0:
            found["kp"] = -(gear**2) * float(model.actuator_biasprm[actuator, 1])
            found["kd"] = -(gear**2) * float(model.actuator_biasprm[actuator, 2])
    return found


def _motors(model: mujoco.MjModel, joint: int) -> list[int]:
    return [a for a in range(model.nu) if model.actuator_trntype[a] in ON_JOINT and model.actuator_trnid[a, 0] == joint]


def _of_motors(model: mujoco.MjModel, joint: int, each: np.ndarray) -> float:
    """At the joint, an inertia or a damping that motors have (nu,)."""
    return float(sum(model.actuator_gear[a, 0] ** 2 * each[a] for a in _motors(model, joint)))


def _shapes(model: mujoco.MjModel, body: int, name: str, meshed: bool) -> list[dict[str, Any]]:
    geoms = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] == body]
    found = [
        _rounded(f"{name}_{i}_collision", _SIMPLE[kind], model.geom_size[g], model.geom_pos[g], model.geom_quat[g])
        for i, g in enumerate(geoms, 1)
        if (kind := int(model.geom_type[g])) in _SIMPLE
    ]
    if found or not meshed or not model.body_mass[body]:
        return found
    half = half_lengths(model.body_mass[body], model.body_inertia[body])
    return [_rounded(f"{name}_1_collision", "box", half, model.body_ipos[body], model.body_iquat[body])]


def half_lengths(mass: float, inertia: np.ndarray) -> np.ndarray:
    """Half the sides of the box of even density with this mass [kg] and these principal inertias [kg m^2], (3,) [m]."""
    square = 1.5 * (inertia.sum() - 2 * inertia) / mass
    return np.sqrt(np.maximum(square, _THINNEST**2))


def _rounded(name: str, kind: str, size: np.ndarray, pos: np.ndarray, quat: np.ndarray) -> dict[str, Any]:
    """A sphere as it is; any other shape as the capsule along its longest side, as long as the shape."""
    if kind == "sphere":
        return {
            "name": name,
            "type": "sphere",
            "size": [float(size[0])],
            "pos": floats(pos),
            "quat": [1.0, 0.0, 0.0, 0.0],
        }
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.asarray(quat, float))
    axes = turn.reshape(3, 3).T
    if kind in ("capsule", "cylinder"):
        axis, radius, half = axes[2], float(size[0]), float(size[1]) + (float(size[0]) if kind == "capsule" else 0.0)
    else:
        longest = int(np.argmax(size))
        axis, half = axes[longest], float(size[longest])
        radius = min(half, float(np.mean(np.delete(size, longest))))
    reach = axis * max(0.0, half - radius)
    return capsule(name, pos - reach, pos + reach, radius)
