"""The G1's visible shape: no physics in it, closed surfaces, meshes where the user has them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.report.films.looks import MESHES, VISUAL, dress, is_g1, loft, meshes_of_user
from bumblebee.robot.model import build_model, build_spec


def test_the_shape_changes_neither_masses_nor_contacts_nor_motion():
    plain, spec = build_model(), build_spec()
    dress(spec)
    shaped = spec.compile()
    assert np.array_equal(plain.body_mass, shaped.body_mass)
    assert np.array_equal(plain.body_inertia, shaped.body_inertia)
    ends = []
    for model in (plain, shaped):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_step(model, data, 40)
        ends.append(data.qpos.copy())
    assert np.array_equal(*ends)
    assert shaped.geom_group.tolist().count(VISUAL) == shaped.nmesh > 40


@pytest.mark.parametrize("along", ["x", "y", "z"])
def test_a_loft_is_closed_and_looks_outwards(along: str):
    points, faces = loft(along, [[-0.1, 0, 0, 0.1, 0.1], [0.1, 0, 0, 0.1, 0.1]])
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = (points[faces[:, i]] for i in range(3))
    volume = (a * np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(np.pi * 0.1**2 * 0.2, rel=0.03)


def test_meshes_of_the_user_are_drawn_in_place_of_primitives(tmp_path: Path):
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], np.float32)
    sides = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    stl = bytes(80) + np.uint32(4).tobytes()
    stl += b"".join(bytes(12) + corners[list(side)].tobytes() + bytes(2) for side in sides)
    for name in ("pelvis", "head_link"):
        (tmp_path / f"{name}.STL").write_bytes(stl)
    spec = build_spec()
    dress(spec, meshes_of_user(tmp_path))
    model = spec.compile()
    assert [model.mesh(i).name for i in range(model.nmesh)] == ["pelvis_look", "head_link_look"]


def test_a_folder_without_meshes_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(BadInput, match=r"--meshes: expected a folder with pelvis\.STL"):
        meshes_of_user(tmp_path)
    monkeypatch.setenv(MESHES, str(tmp_path))
    with pytest.raises(BadInput, match=MESHES):
        meshes_of_user()
    monkeypatch.delenv(MESHES)
    assert meshes_of_user() is None


def test_another_robot_is_not_taken_for_the_g1():
    spec = mujoco.MjSpec.from_string("<mujoco><worldbody><body name='pelvis'/></worldbody></mujoco>")
    assert not is_g1(spec)
    assert is_g1(build_spec())
