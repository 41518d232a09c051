"""The motions of one file, ready for the robot: the same with and without the cache, which knows all that decides."""

import os
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.describe.describer import DescribeConfig
from bumblebee.motion.kinematics import lowest
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.reading import ready
from bumblebee.motion.reading.file import File
from bumblebee.motion.reading.ready import make_ready
from bumblebee.motion.reading.settings import ReadConfig
from bumblebee.motion.retarget.config import RetargetConfig
from tests.motion.human.people import bvh, npz, smpl

CONFIG = ReadConfig(processes=1)
FILES = {"walk.bvh": bvh(60).encode(), "walk.npz": npz(smpl(60))}


@pytest.fixture(autouse=True)
def no_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SMPL_MODEL_DIR", raising=False)


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the motions that were retargeted and not taken from the cache."""
    names: list[str] = []
    before = ready.retarget

    def counted(motion, *rest):
        names.append(motion.name)
        return before(motion, *rest)

    monkeypatch.setattr(ready, "retarget", counted)
    return names


def file(name: str, data: bytes | None = None, folder: str = "m") -> File:
    data = FILES[name] if data is None else data
    return File(Path(folder) / name, data=data, sha256=sha256(data).hexdigest())


def same(one: RawMotion, other: RawMotion) -> bool:
    arrays = ("root_pos", "root_quat", "joint_pos")
    facts = ("name", "fps", "file", "first_row", "part", "notes", "rate_from", "amass_fps")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in arrays) and all(
        getattr(one, name) == getattr(other, name) for name in facts
    )


@pytest.mark.parametrize("name", FILES)
def test_a_person_becomes_the_robot_at_the_rate_of_the_clips_standing_on_the_floor(name):
    (one,) = make_ready(file(name), CONFIG, None)
    assert (one.name, one.fps, one.joint_pos.shape) == ("walk", 50.0, (25, 23))
    assert np.abs(lowest(one.root_pos, one.root_quat, one.joint_pos)).max() < 0.005
    assert one.amass_fps == (120.0 if name == "walk.npz" else None)


@pytest.mark.parametrize("name", FILES)
def test_the_result_does_not_depend_on_the_cache(tmp_path, made, name):
    without, first, second = (make_ready(file(name), CONFIG, cache) for cache in (None, tmp_path, tmp_path))
    assert made == ["walk", "walk"]
    assert len(without) == 1 and same(without[0], first[0]) and same(without[0], second[0])


def test_an_entry_serves_a_file_of_the_same_name_and_bytes_elsewhere_which_keeps_its_own_path(tmp_path, made):
    make_ready(file("walk.bvh"), CONFIG, tmp_path)
    (moved,) = make_ready(file("walk.bvh", folder="elsewhere"), CONFIG, tmp_path)
    assert made == ["walk"] and moved.file == Path("elsewhere/walk.bvh")


@pytest.mark.parametrize(
    "changed",
    [{"fps": 30.0}, {"retarget": RetargetConfig(cutoff=6.0)}, {"unit": "cm"}, {"up": "y"}],
    ids=lambda changed: next(iter(changed)),
)
def test_a_setting_that_decides_the_result_makes_it_anew(tmp_path, made, changed):
    make_ready(file("walk.bvh"), CONFIG, tmp_path)
    make_ready(file("walk.bvh"), replace(CONFIG, **changed), tmp_path)
    assert made == ["walk", "walk"]


@pytest.mark.parametrize(
    "changed",
    [{"processes": 2}, {"max_seconds": 1.0}, {"describe": DescribeConfig(name_words=True)}],
    ids=lambda changed: next(iter(changed)),
)
def test_a_setting_that_does_not_makes_nothing_anew(tmp_path, made, changed):
    make_ready(file("walk.bvh"), CONFIG, tmp_path)
    make_ready(file("walk.bvh"), replace(CONFIG, **changed), tmp_path)
    assert made == ["walk"]


def test_a_body_model_that_comes_or_changes_makes_smpl_motions_anew_and_no_others(tmp_path, made, monkeypatch):
    cache, models = tmp_path / "cache", tmp_path / "models"
    models.mkdir()
    monkeypatch.setenv("SMPL_MODEL_DIR", str(models))
    for name in FILES:
        make_ready(file(name), CONFIG, cache)
    regressor = np.zeros((22, 22)) + np.eye(22)
    body = np.cumsum(np.full((22, 3), 0.03), axis=0)
    np.savez(models / "SMPL_NEUTRAL.npz", J_regressor=regressor, v_template=body, shapedirs=np.zeros((22, 3, 10)))
    made.clear()
    # What such a body gives does not matter here, only that the old result is not taken.
    monkeypatch.setattr(ready, "read_one", lambda *_: made.append("read") or [])
    for name in FILES:
        make_ready(file(name), CONFIG, cache)
    assert made == ["read"]
    os.utime(models / "SMPL_NEUTRAL.npz", ns=(1, 1))
    make_ready(file("walk.npz"), CONFIG, cache)
    assert made == ["read", "read"]


def test_a_file_that_cannot_be_used_leaves_nothing_in_the_cache(tmp_path):
    with pytest.raises(BadInput):
        make_ready(file("walk.bvh", FILES["walk.bvh"][:-200] + b"x"), CONFIG, tmp_path)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
