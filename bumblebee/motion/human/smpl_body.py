"""Where the joints of an SMPL body lie at rest: from the licensed model where it is there, else from public figures.

The model is looked for under the folder that the environment's `SMPL_MODEL_DIR` names. With it the joints follow from
the person's shape: `J_regressor @ (v_template + shapedirs @ betas)`. Without it they are those of the mean body; a
shape that the file states cannot be applied then, and the notes say so.
"""

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes, require_real
from bumblebee.motion.formats import safe_pickle
from bumblebee.motion.human.npz import npz_chosen

PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
"""Parents of the 22 joints that SMPL, SMPL-H and SMPL-X have in common, in their order: pelvis, left and right hip,
spine 1, knees, spine 2, ankles, spine 3, feet, neck, collars, head, shoulders, elbows, wrists."""
FOLDER = "SMPL_MODEL_DIR"
GENDERS = ("neutral", "male", "female")

# Places in the model's frame [m]: x to the person's left, y up, z ahead; first the pelvis, then each joint from its
# parent. Both are the bodies' `pos` in public models of the neutral body. SMPL: ZhengyiLuo/PHC,
# phc/data/assets/mjcf/smpl_humanoid.xml @557d6c0. SMPL-X: NVlabs/ProtoMotions,
# protomotions/data/assets/mjcf/smplx_humanoid.xml @1faa3be (there x ahead, y left, z up, but for the pelvis).
# SMPL-H's body is taken as SMPL's, with other hands.
_SMPL = (
    (-0.0018, -0.2233, 0.0282),
    (0.0695, -0.0914, -0.0068),
    (-0.0677, -0.0905, -0.0043),
    (-0.0025, 0.1090, -0.0267),
    (0.0343, -0.3752, -0.0045),
    (-0.0383, -0.3826, -0.0089),
    (0.0055, 0.1352, 0.0011),
    (-0.0136, -0.3980, -0.0437),
    (0.0158, -0.3984, -0.0423),
    (0.0015, 0.0529, 0.0254),
    (0.0264, -0.0558, 0.1193),
    (-0.0254, -0.0481, 0.1233),
    (-0.0028, 0.2139, -0.0429),
    (0.0788, 0.1217, -0.0341),
    (-0.0818, 0.1188, -0.0386),
    (0.0052, 0.0650, 0.0513),
    (0.0910, 0.0305, -0.0089),
    (-0.0960, 0.0326, -0.0091),
    (0.2596, -0.0128, -0.0275),
    (-0.2537, -0.0133, -0.0214),
    (0.2492, 0.0090, -0.0012),
    (-0.2553, 0.0078, -0.0056),
)
_SMPLX = (
    (0.0031, -0.3514, 0.0120),
    (0.0582, -0.0928, -0.0260),
    (-0.0633, -0.1039, -0.0213),
    (-0.0028, 0.1099, -0.0276),
    (0.0547, -0.3788, -0.0094),
    (-0.0442, -0.3624, -0.0168),
    (0.0094, 0.1319, -0.0059),
    (-0.0435, -0.4031, -0.0319),
    (0.0154, -0.4107, -0.0202),
    (-0.0113, 0.0522, 0.0284),
    (0.0473, -0.0580, 0.1182),
    (-0.0388, -0.0583, 0.1190),
    (-0.0122, 0.1652, -0.0316),
    (0.0464, 0.0849, -0.0072),
    (-0.0477, 0.0843, -0.0134),
    (0.0248, 0.1605, 0.0207),
    (0.1192, 0.0577, -0.0155),
    (-0.1026, 0.0535, -0.0127),
    (0.2541, -0.0722, -0.0425),
    (-0.2711, -0.0365, -0.0265),
    (0.2520, 0.0232, -0.0025),
    (-0.2493, -0.0045, -0.0153),
)
_MEAN = {"smpl": (_SMPL, "PHC's smpl_humanoid.xml"), "smplh": (_SMPL, "PHC's smpl_humanoid.xml"),
         "smplx": (_SMPLX, "ProtoMotions' smplx_humanoid.xml")}  # fmt: skip
_ARRAYS = ("J_regressor", "v_template", "shapedirs")


@dataclass(frozen=True, eq=False)
class Body:
    """The 22 joints at rest: `offsets` (22, 3) [m], the pelvis' place first, then each joint from its parent."""

    offsets: np.ndarray
    notes: tuple[str, ...]


def find_body(model: str, gender: str, betas: np.ndarray) -> Body:
    """The body of a person.

    Args:
        model: `smpl`, `smplh` or `smplx`.
        gender: `neutral`, `male` or `female`; "" where it is not known.
        betas: shape, (n,); all zero for the mean body.

    Raises:
        BadInput: a model file that cannot be used.
    """
    file = _model_file(model, gender)
    if file is not None:
        return _shaped(file, betas)
    figures, source = _MEAN[model]
    notes = [f"joints of the mean {model.upper()} body, from {source}"]
    if np.abs(betas).max(initial=0) > 0:
        lacks = f"no {model.upper()} model of gender {gender or 'unknown'} in {FOLDER}"
        reason = lacks if os.environ.get(FOLDER) else f"{FOLDER} is not set"
        notes.append(f"the person's shape (betas) is not applied: {reason}")
    return Body(np.array(figures), tuple(notes))


def model_files() -> list[list[object]]:
    """Name, size and time [ns] of each model that would be found now: what was read with others is out of date."""
    found = {_model_file(model, gender) for model in _MEAN for gender in GENDERS} - {None}
    facts = [(str(file), file.stat()) for file in found if file]
    return sorted([name, stat.st_size, stat.st_mtime_ns] for name, stat in facts)


def _model_file(model: str, gender: str) -> Path | None:
    """The model's file, by the names under which it is published."""
    folder = os.environ.get(FOLDER, "")
    if not folder or gender not in GENDERS:
        return None
    stem = f"{model.upper()}_{gender.upper()}"
    for place in (Path(folder), Path(folder) / model, Path(folder) / "models" / model):
        for name in (f"{stem}.npz", f"{stem}.pkl", f"{gender}/model.npz", f"{gender}/model.pkl"):
            if (place / name).is_file() and (place.name == model or name.startswith(stem)):
                return place / name
    return None


def _shaped(file: Path, betas: np.ndarray) -> Body:
    joints, directions = _joint_shapes(file, file.stat().st_mtime_ns)
    used = min(len(betas), directions.shape[2])
    places = joints + directions[:, :, :used] @ betas[:used]
    offsets = places.copy()
    offsets[1:] -= places[list(PARENTS[1:])]
    cut = (f"only {used} of {len(betas)} betas are known to it",) if np.abs(betas[used:]).max(initial=0) > 0 else ()
    return Body(offsets, (f"joints from {file.name} and the person's betas", *cut))


@lru_cache(maxsize=16)
def _joint_shapes(file: Path, changed: int) -> tuple[np.ndarray, np.ndarray]:
    """The 22 joints of the mean body (22, 3), and how each beta moves them (22, 3, n) [m].

    Args:
        file: the model.
        changed: when the file was changed, so that a new one is read anew.
    """
    data = read_bytes(file)
    arrays = npz_chosen(file, data, _ARRAYS) if file.suffix == ".npz" else _pickled(file, data)
    regressor, template, shapes = (_array(file, arrays, name) for name in _ARRAYS)
    count = template.shape[0]
    fits = template.shape == (count, 3) and shapes.ndim == 3 and shapes.shape[:2] == (count, 3)
    if not fits or regressor.ndim != 2 or regressor.shape[1] != count or len(regressor) < len(PARENTS):
        came = f"{regressor.shape}, {template.shape} and {shapes.shape}"
        raise BadInput(file, "J_regressor (J, V), v_template (V, 3), shapedirs (V, 3, n)", came)
    regressor = regressor[: len(PARENTS)]
    return regressor @ template, np.einsum("jv,vdn->jdn", regressor, shapes)


def _pickled(file: Path, data: bytes) -> dict[str, object]:
    """The content of a pickle of plain arrays; the official release's holds objects of chumpy and SciPy."""
    try:
        content = safe_pickle.load(file, data)
    except BadInput as error:
        do = "Nothing of it was executed. Convert it to .npz with J_regressor, v_template, shapedirs as plain arrays."
        raise BadInput(file, "a model of plain arrays", error.came, do) from None
    return content if isinstance(content, dict) else {}


def _array(file: Path, arrays: dict, name: str) -> np.ndarray:
    values = arrays.get(name)
    if not isinstance(values, np.ndarray) or not values.ndim:
        raise BadInput(file, f"an array {name}", "none", "Is it an SMPL model?")
    return require_real(f"{file}: {name}", values)
