"""A declared model in another folder: its includes and assets lie where it came from."""

import math
import re
import shutil
from pathlib import Path

import mujoco

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.robot.drives import explicit_drives

LARGEST = 64 << 20  # bytes of the XML itself; the largest public robot models have 1 MB
MEMORY = 8 << 30  # bytes that a model may ask for its arena
_MULTIPLIERS = (
    ("replicate", ("count",), 1e5),
    ("composite", ("count",), 1e6),
    ("flexcomp", ("count",), 1e6),
    ("texture", ("width", "height"), 1e8),
    ("hfield", ("nrow", "ncol"), 1e8),
)


def load_model(path: Path) -> mujoco.MjModel:
    """The compiled model of an MJCF file, its drives in one form (`robot.drives`); `BadInput` as for `load_spec`."""
    return explicit_drives(load_spec(path))[0].compile()


def load_spec(path: Path) -> mujoco.MjSpec:
    """Read an MJCF file as an editable spec that compiles; `BadInput` with MuJoCo's own words where it does not."""
    path = Path(path)
    text = read_text(path, LARGEST)
    if "\0" in text or "<" not in text:
        raise BadInput(path, "an MJCF model that loads", "a file that is no XML")
    _refuse_multiplied(path, text)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compile()
    except Exception as error:  # ValueError mostly; FatalError and MemoryError from its allocations
        raise BadInput(path, "an MJCF model that loads", str(error)[:300]) from None
    return spec


def _refuse_multiplied(path: Path, text: str) -> None:
    """Refuse numbers in a model that make a few bytes into gigabytes before MuJoCo looks at them."""
    for tag, keys, most in _MULTIPLIERS:
        for element in re.findall(rf"<{tag}\b[^>]*>", text):
            found = [re.findall(rf"\b{key}\s*=\s*[\"']([^\"']*)", element) for key in keys]
            numbers = [float(n) for words in found for n in re.findall(r"\d+(?:\.\d+)?", " ".join(words))]
            size = math.prod(numbers) if numbers else 0.0
            if not size <= most:
                raise BadInput(path, f"a {tag} of at most {most:g} ({' x '.join(keys)})", f"{size:.3g}")
    for size, unit in re.findall(r"\bmemory\s*=\s*[\"']\s*(\d+)\s*([KMGTPE]?)", text):
        if float(size) * 1024 ** " KMGTPE".index(unit or " ") > MEMORY:
            raise BadInput(path, f"memory of at most {MEMORY:,} bytes", f"{size[:40]}{unit}")


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
