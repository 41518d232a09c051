"""Copies of motions: other arms, another tempo, what stays as it is, and how often they are drawn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from benchmarks.baselines import relatives, variety
from benchmarks.baselines.variety import ARMS, another, at_tempo, flies, shares, varied, with_arms
from benchmarks.motion_pack import Packed, write_pack
from bumblebee.learning.policy import Policy, Shape, new_actor
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import EmbeddedConfig, make_library
from bumblebee.motion.kinematics import forward_key_positions, make_clip
from bumblebee.quaternions import from_axis_angle
from bumblebee.robot.facts import joint_names
from bumblebee.tracking.observing.observations import layout

CLIPS = make_library(EmbeddedConfig(limit=3))
ARRAYS = ("root_pos", "root_quat", "joint_pos", "key_pos")
LEGS = [i for i in range(len(joint_names())) if i not in ARMS]


def raised(clip: Clip, height: float, frames: int) -> Clip:
    """The clip, lifted by `height` [m] in its first frames."""
    root = clip.root_pos.copy()
    root[:frames, 2] += height
    return make_clip(clip.name, clip.fps, root, clip.root_quat, clip.joint_pos, family=clip.family)


def test_arms_are_those_of_the_other_and_all_else_stays():
    clip, other = CLIPS[0], CLIPS[1]
    made = with_arms(clip, other, 1.0)
    first, count = max(other.frames - clip.frames, 0), min(clip.frames, other.frames)
    assert len(ARMS) == 8
    assert np.array_equal(made.joint_pos[:count, ARMS], other.joint_pos[first : first + count, ARMS])
    assert (made.joint_pos[count:, ARMS] == other.joint_pos[-1, ARMS]).all()
    assert np.array_equal(made.joint_pos[:, LEGS], clip.joint_pos[:, LEGS])
    assert np.array_equal(made.root_pos, clip.root_pos)
    assert np.allclose(made.key_pos, forward_key_positions(made.root_pos, made.root_quat, made.joint_pos), atol=1e-6)


def test_another_is_never_the_motion_itself_and_else_what_is_drawn():
    for own in range(5):
        drawn = [int(k) for k in np.random.default_rng(own).integers(5, size=200)]
        generator = np.random.default_rng(own)
        found = [another(own, 5, generator) for _ in drawn]
        assert found == [(own + 1) % 5 if k == own else k for k in drawn] and own in drawn
    assert another(0, 1, generator) == 0


def test_arms_are_never_the_motions_own(monkeypatch: pytest.MonkeyPatch):
    pairs = []
    for module in (variety, relatives):
        monkeypatch.setattr(module, "with_arms", lambda clip, other, _: pairs.append((clip, other)) or clip)
    clips = [replace(CLIPS[0], name=str(k)) for k in range(3)]
    varied([Packed("real", True, clip) for clip in clips], 3)
    for count in (2, 3):
        relatives.RELATIVES["other arms"](clips[:count])
    assert len(pairs) == 9 + 2 + 3 and all(clip.name != other.name for clip, other in pairs)


def test_arms_that_reach_through_the_floor_are_not_taken():
    prone = from_axis_angle([0.0, 1.0, 0.0], 0.5 * np.pi)
    elbow, pitch = ([i for i in ARMS if part in joint_names()[i]] for part in ("elbow", "shoulder_pitch"))
    joints = np.zeros((5, 23))
    joints[:, elbow] = 0.5 * np.pi  # straight
    along = make_clip("along", 50.0, np.tile([0.0, 0.0, 0.3], (5, 1)), np.tile(prone, (5, 1)), joints)
    joints[3:, pitch] = -0.5 * np.pi  # forwards, which is down
    down = make_clip("down", 50.0, along.root_pos, along.root_quat, joints)
    assert with_arms(along, down, 0.0) is along
    assert np.array_equal(with_arms(down, along, 0.0).joint_pos, along.joint_pos)


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_at_another_tempo_it_goes_through_the_same_places_in_another_time(factor: float):
    clip = CLIPS[0]
    made = at_tempo(clip, factor)
    assert made.fps == clip.fps and made.duration == pytest.approx(clip.duration / factor, abs=1 / clip.fps)
    place = np.arange(made.frames) * factor
    whole = np.isclose(place, np.round(place))
    assert whole.sum() > 10
    index = np.round(place[whole]).astype(int)
    assert np.allclose(made.joint_pos[whole], clip.joint_pos[index], atol=1e-5)
    assert np.allclose(made.root_pos[whole], clip.root_pos[index], atol=1e-5)
    assert np.allclose(np.abs((made.root_quat[whole] * clip.root_quat[index]).sum(1)), 1.0, atol=1e-5)


def test_relatives_of_a_motion_are_tried_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    shape = Shape(sum(size for _, size in layout(23, 2)), 4, 23, (8,), (0.1, 0.3))
    actor = new_actor(shape)
    for parameter in actor.mlp.parameters():
        parameter.data.zero_()
    (tmp_path / "p").mkdir()
    Policy(actor, {}, shape).save(tmp_path / "p")
    short = replace(CLIPS[0], **{name: getattr(CLIPS[0], name)[:20] for name in ARRAYS})
    rows = [Packed("real", True, short), Packed("embedded", True, CLIPS[1])]
    rows.append(Packed("real", True, replace(short, name="held", split="test")))
    write_pack(tmp_path / "m.npz", rows)
    options = ["relatives", str(tmp_path / "p"), "--motions", str(tmp_path / "m.npz"), "--out", str(tmp_path / "r.csv")]
    monkeypatch.setattr("sys.argv", options)
    relatives.main()
    table = pd.read_csv(tmp_path / "r.csv")
    assert set(table["kind"]) == set(relatives.RELATIVES) and set(table["name"]) == {short.name, "held"}
    assert table["success"].all()  # 0.4 s of waving: an action of zero holds it
    monkeypatch.setattr("sys.argv", [*options, "--kinds", "itself", "--robots", "paper"])
    relatives.main()
    other = pd.read_csv(tmp_path / "r.csv")
    assert set(other["kind"]) == {"itself"} and len(other) == 2
    plain = table[table["kind"] == "itself"]["mpkpe_mm"].to_numpy()
    assert (np.abs(other["mpkpe_mm"].to_numpy() - plain) > 0.1).all()  # other robots stand otherwise
    own = table.assign(success=table["kind"] != "mirrored")
    text = relatives.table_of(own)
    assert "| p | 1 of 1, 1.00 [" in text and "0 of 1, 0.00 [" in text
    monkeypatch.setattr("sys.argv", ["relatives", str(tmp_path / "none"), *options[2:]])
    with pytest.raises(SystemExit, match="2"):
        relatives.main()


def test_a_flight_keeps_its_tempo():
    flying, short = raised(CLIPS[0], 0.3, 8), raised(CLIPS[0], 0.3, 7)
    assert flies(flying) and not flies(short)
    copies = varied([Packed("real", True, flying)], 3)
    assert all(copy.clip.frames == flying.frames for copy in copies)
    assert any(copy.clip.frames != short.frames for copy in varied([Packed("real", True, short)], 3))


def test_copies_are_named_alike_each_time_and_weigh_as_much_as_what_they_are_made_of():
    rows = [Packed("real", True, CLIPS[0]), Packed("embedded", True, CLIPS[1])]
    copies = varied(rows, 2)
    assert [row.clip.name for row in copies] == [f"{row.clip.name}~{k}" for k in (1, 2) for row in rows]
    again = varied(rows, 2)
    assert all(np.array_equal(a.clip.joint_pos, b.clip.joint_pos) for a, b in zip(copies, again, strict=True))
    assert varied(rows, 0) == [] and torch.equal(shares(rows, 2.0), torch.tensor([1.0, 2.0]))
    assert shares(rows + copies, 2.0).tolist() == [1.0, 2.0, 0.5, 1.0, 0.5, 1.0]
