"""A declared model in another folder: its includes and assets lie where it came from."""

import shutil
from collections.abc import Sequence
from pathlib import Path

import mujoco

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.io.there import require_there
from bumblebee.robot.drives import ON_JOINT, explicit_drives
from bumblebee.robot.model_size import LARGEST, refuse_multiplied


def load_model(path: Path) -> mujoco.MjModel:
    """The compiled model of an MJCF file, its drives in one form (`robot.drives`); `BadInput` as for `load_spec`."""
    return explicit_drives(load_spec(path))[0].compile()


def load_spec(path: Path) -> mujoco.MjSpec:
    """Read an MJCF file as an editable spec that compiles; `BadInput` with MuJoCo's own words where it does not."""
    path = Path(path)
    require_there(path, "an MJCF file")
    text = read_text(path, LARGEST)
    if "\0" in text or "<" not in text:
        raise BadInput(path, "an MJCF model that loads", "a file that is no XML")
    refuse_multiplied(path, text)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compile()
    except Exception as error:  # ValueError mostly; FatalError and MemoryError from its allocations
        lacks = "opening file" in str(error)  # a mesh or texture that was not copied along
        do = "Put that file where the model names it: makers publish meshes beside their models." if lacks else ""
        raise BadInput(path, "an MJCF model that loads", str(error)[:300], do) from None
    return spec


def name_assets_in_full(spec: mujoco.MjSpec) -> None:
    """Folders of meshes and textures as absolute paths, so that the model loads from anywhere."""
    if spec.meshes or spec.hfields or spec.textures or spec.skins:
        home = Path(spec.modelfiledir or ".").resolve()
        spec.compiler.meshdir = str(home / spec.compiler.meshdir)
        spec.compiler.texturedir = str(home / spec.compiler.texturedir)


def copy_model(source: Path, target: Path, locked: Sequence[str] = ()) -> None:
    """`source` as `target`: the file itself where that loads there, else one with includes in place and full paths.

    Joints that are `locked` are not in the copy, nor is what refers to them: actuators, sensors, equalities.
    """
    shutil.copyfile(source, target)
    try:
        mujoco.MjModel.from_xml_path(str(target))
        loads = True
    except ValueError:
        loads = False
    if locked or not loads:
        spec = mujoco.MjSpec.from_file(str(source))
        name_assets_in_full(spec)
        if locked:
            spec, _ = explicit_drives(spec)  # gains by ratios are those of the whole model
        spec.compile()  # after that keyframes lose what is deleted, too
        for joint in locked:
            _lock(spec, joint)
        try:
            spec.compile()
        except ValueError as error:  # a tendon over it
            raise BadInput(source, f"a model that loads without {', '.join(locked)}", str(error)[:300]) from None
        target.write_text(spec.to_xml(), encoding="utf-8")


def _lock(spec: mujoco.MjSpec, joint: str) -> None:
    """Delete a joint with its actuators and the sensors and equalities of both."""
    actuators = [a for a in spec.actuators if a.target == joint and a.trntype in ON_JOINT]
    names = {(mujoco.mjtObj.mjOBJ_JOINT, joint), *((mujoco.mjtObj.mjOBJ_ACTUATOR, a.name) for a in actuators)}
    ties = [e for e in spec.equalities if e.type == mujoco.mjtEq.mjEQ_JOINT and joint in (e.name1, e.name2)]
    sensors = [s for s in spec.sensors if (s.objtype, s.objname) in names]
    for element in (*sensors, *ties, *actuators, spec.joint(joint)):
        spec.delete(element)
