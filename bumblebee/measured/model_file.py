"""A declared model in another folder: its includes and assets lie where it came from."""

import shutil
from pathlib import Path

import mujoco

from bumblebee.errors import BadInput


def load_model(path: Path) -> mujoco.MjModel:
    """The compiled model of an MJCF file; `BadInput` with MuJoCo's own words where it does not load."""
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise BadInput(path, "an MJCF model that loads", str(error)) from None


def name_assets_in_full(spec: mujoco.MjSpec) -> None:
    """Folders of meshes and textures as absolute paths, so that the model loads from anywhere."""
    if spec.meshes or spec.hfields or spec.textures or spec.skins:
        home = Path(spec.modelfiledir or ".").resolve()
        spec.compiler.meshdir = str(home / spec.compiler.meshdir)
        spec.compiler.texturedir = str(home / spec.compiler.texturedir)


def copy_model(source: Path, target: Path) -> None:
    """`source` as `target`: the file itself where that loads there, else one with includes in place and full paths."""
    shutil.copyfile(source, target)
    try:
        mujoco.MjModel.from_xml_path(str(target))
    except ValueError:
        spec = mujoco.MjSpec.from_file(str(source))
        name_assets_in_full(spec)
        spec.compile()
        target.write_text(spec.to_xml(), encoding="utf-8")
