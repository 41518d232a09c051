"""A declared model that is copied into a dataset loads there, wherever its includes and meshes lie."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.model_file import copy_model, load_spec

MODEL = """<mujoco><compiler meshdir="meshes"/><asset><mesh name="tip" file="tip.obj"/></asset>
<worldbody><body name="link"><joint name="hinge" axis="0 1 0"/>
<geom type="mesh" mesh="tip" mass="1"/></body></worldbody>
<include file="parts/drive.xml"/></mujoco>"""
DRIVE = '<mujocoinclude><actuator><motor name="drive" joint="hinge" gear="3"/></actuator></mujocoinclude>'
TIP = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_a_model_with_includes_and_meshes_loads_from_another_folder(tmp_path: Path) -> None:
    home, away = tmp_path / "home", tmp_path / "away"
    for folder in (home / "meshes", home / "parts", away):
        folder.mkdir(parents=True)
    (home / "model.xml").write_text(MODEL)
    (home / "parts" / "drive.xml").write_text(DRIVE)
    (home / "meshes" / "tip.obj").write_text(TIP)
    copy_model(home / "model.xml", away / "model.xml")
    there, here = (mujoco.MjModel.from_xml_path(str(folder / "model.xml")) for folder in (home, away))
    assert here.nu == there.nu == 1
    np.testing.assert_allclose(here.actuator_gear, there.actuator_gear)
    np.testing.assert_allclose(here.body_inertia, there.body_inertia, rtol=1e-5)
    np.testing.assert_allclose(here.body_ipos, there.body_ipos, atol=1e-6)


def test_a_model_that_needs_nothing_beside_it_is_copied_as_it_is(tmp_path: Path) -> None:
    text = "<mujoco><!-- mine --><worldbody><body><joint/><geom size='.1'/></body></worldbody></mujoco>"
    (tmp_path / "a.xml").write_text(text)
    copy_model(tmp_path / "a.xml", tmp_path / "b.xml")
    assert (tmp_path / "b.xml").read_text() == text


def test_a_mesh_that_is_not_there_is_named_with_what_to_do(tmp_path: Path) -> None:
    """As where a maker's model was copied without its folder of meshes."""
    model = tmp_path / "arm.xml"
    model.write_text(
        "<mujoco><asset><mesh name='m' file='link.stl'/></asset>"
        "<worldbody><body><joint/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>"
    )
    with pytest.raises(BadInput, match=r"link\.stl.*Put that file where the model names it"):
        load_spec(model)
