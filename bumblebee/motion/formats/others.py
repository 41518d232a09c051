"""Files of the field that are not read: what they are, and how to make one of them that is read."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import npy_array
from bumblebee.motion.reading.remedy import say
from bumblebee.motion.texts import shown

_AGAIN = "Read the file that it was made from: HumanML3D's index.csv names AMASS's .npz of each."
_SUFFIXES = {
    ".fbx": ("an FBX file", "Export it as BVH."),
    ".c3d": ("markers without a skeleton (C3D)", "Fit one first, as SMPL or BVH."),
    ".7z": ("a 7z archive", "Unpack it, or pack it as zip or tar."),
    ".rar": ("a RAR archive", "Unpack it, or pack it as zip or tar."),
    ".motion": (
        "a motion of ProtoMotions (torch)",
        "Load it with torch and save it as .npz with joint_pos=dof_pos, body_pos_w=rigid_body_pos, "
        "body_quat_w=rigid_body_rot, fps=fps.",
    ),
    ".pt": ("a torch file, which may call anything", "Load it with torch and save its arrays as .npz."),
    ".pth": ("a torch file, which may call anything", "Load it with torch and save its arrays as .npz."),
}
_ARRAYS = {
    (263,): ("HumanML3D's features, which are no poses", _AGAIN),
    (251,): ("HumanML3D's features of KIT, which are no poses", _AGAIN),
    (22, 3): ("HumanML3D's joints without rotations", _AGAIN),
    (21, 3): ("HumanML3D's joints of KIT without rotations", _AGAIN),
}
_FIELDS = (
    (
        {"smpl_poses", "smpl_trans", "smpl_scaling"},
        "a dance of AIST++",
        "Save it as .npz with poses=smpl_poses, trans=smpl_trans/smpl_scaling, mocap_framerate=60; y is up in it: "
        + say({"up": "y"}),
    ),
    (
        {"seq_name", "root_orient", "pose_body", "trans"},
        "people of OMOMO with objects",
        "Save each as .npz with root_orient=root_orient, pose_body=pose_body, trans=trans, betas=betas, "
        "mocap_framerate=30.",
    ),
    (
        {"qpos", "split_points", "joint_names", "frequency"},
        "a trajectory of loco-mujoco",
        "If it is the G1's, save it as .npz with joint_pos=qpos, joint_names=joint_names, fps=frequency.",
    ),
)


def what_it_is(path: Path, data: bytes) -> tuple[str, str]:
    """Name what a file of a suffix that is not read is, and what can be done with it.

    Args:
        path: the file; its suffix is asked first.
        data: its bytes.
    """
    if path.suffix.lower() != ".npy":
        return _SUFFIXES.get(path.suffix.lower(), ("a format that is not known", ""))
    try:
        shape = npy_array(path, data).shape
    except BadInput as error:
        return shown(error.came, 200), ""
    unknown = f"one NumPy array of shape {shape}, which does not say what it holds"[:160]
    return _ARRAYS.get(shape[1:], (unknown, "Save it as .npz under the names that docs/data.md has."))


def refuse_known(path: Path, fields: Mapping[Any, Any]) -> None:
    """Refuse a pickle or an `.npz` file of a data set that is known and not read.

    Args:
        path: the file.
        fields: what it holds by name; a dict of dicts is judged by the first.

    Raises:
        BadInput: what it is, and what can be done.
    """
    first = next(iter(fields.values()), None)
    names = {str(name) for name in (first if isinstance(first, dict) else fields)}
    for needed, kind, do in _FIELDS:
        if needed <= names:
            raise BadInput(path, "a motion that is read", kind, do)
