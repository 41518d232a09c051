"""The embedded library: every clip is something that the robot can do. The library is made once for all tests."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import FAMILIES, EmbeddedConfig, checks, make_library
from bumblebee.motion.embedded.captions import caption_line
from bumblebee.motion.embedded.kinds import kinds
from bumblebee.motion.embedded.solver import derivatives, floor_wrench, zmp
from bumblebee.motion.embedded.vary import Vary
from bumblebee.robot.facts import joint_names, joints, stand_pose

SOLE_LENGTH = 0.167  # m
QUASI_STATIC = ("stand", "squat", "balance")
STEPPING = ("walk", "turn", "sidestep")


@dataclass
class Made:
    """A clip and which feet its plan has on the floor."""

    clip: Clip
    contact: np.ndarray

    @cached_property
    def soles(self) -> np.ndarray:
        return checks.soles(self.clip)

    @cached_property
    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        return derivatives(checks.qpos_of(self.clip))

    def runs(self, carrying: bool) -> list[tuple[int, np.ndarray]]:
        """(foot, frames) of every time that a foot is on or off the floor."""
        found = []
        for foot in (0, 1):
            frames = np.flatnonzero(self.contact[:, foot] == carrying)
            runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
            found += [(foot, run) for run in runs if len(run)]
        return found


@pytest.fixture(scope="module")
def library() -> dict[str, Made]:
    config = EmbeddedConfig()
    plans = {kind.name: kind.build(Vary(config.seed, 0, kind.name, config.variation)) for kind in kinds()}
    return {clip.name: Made(clip, plans[clip.name].contact) for clip in make_library(config)}


def of(library: dict[str, Made], *families: str) -> list[Made]:
    return [made for made in library.values() if made.clip.family in families]


def test_the_library_has_the_families_that_were_promised(library: dict[str, Made]) -> None:
    families = [made.clip.family for made in library.values()]
    assert set(families) == set(FAMILIES)
    assert families.count("stand") + families.count("squat") >= 20
    assert families.count("walk") >= 4
    assert families.count("turn") + families.count("sidestep") >= 8
    for made in library.values():
        assert made.clip.fps == 50.0
        assert 3.0 <= made.clip.duration <= 8.0, made.clip.name
        assert len(made.clip.captions) >= 2
        assert made.clip.licence == "Apache-2.0"
        assert len(made.clip.sha256) == 64


def test_a_foot_in_stance_lies_flat_on_the_floor_and_does_not_slide(library: dict[str, Made]) -> None:
    for made in library.values():
        for foot, run in made.runs(carrying=True):
            corners = made.soles[run, foot]
            heights = corners[..., 2]
            assert np.abs(heights.min(axis=1)).max() < 0.003, made.clip.name
            assert np.degrees(np.ptp(heights, axis=1).max() / SOLE_LENGTH) < 1.0, made.clip.name
            slide = np.linalg.norm(np.diff(corners[..., :2], axis=0), axis=-1) * made.clip.fps
            assert slide.max(initial=0.0) < 0.02, made.clip.name


def test_a_foot_in_swing_clears_the_floor_and_never_dips_below(library: dict[str, Made]) -> None:
    for made in library.values():
        assert made.soles[..., 2].min() > -0.001, made.clip.name
        for foot, run in made.runs(carrying=False):
            assert made.soles[run, foot, :, 2].min(axis=1).max() > 0.02, made.clip.name


def test_a_foot_near_the_floor_hardly_moves_over_it(library: dict[str, Made]) -> None:
    for made in of(library, *STEPPING, "balance"):
        speed = np.linalg.norm(np.diff(made.soles[..., :2], axis=0), axis=-1) * made.clip.fps
        low = made.soles[1:, ..., 2] < 0.001
        assert speed[low].max() < 0.05, made.clip.name


def test_joints_stay_within_range_and_are_smooth(library: dict[str, Made]) -> None:
    low, high = np.array([joint.range for joint in joints()]).T
    fastest = np.array([joint.velocity_limit for joint in joints()])
    for made in library.values():
        margin = np.minimum(made.clip.joint_pos - low, high - made.clip.joint_pos)
        assert margin.min() > 0.01, made.clip.name
        speed, acceleration = (np.abs(rate[:, 6:]) for rate in made.rates)
        jumps = made.clip.family == "jump"
        assert (speed < fastest).all(), made.clip.name
        assert jumps or speed.max() < 10.0, made.clip.name
        assert acceleration.max() < (400.0 if jumps else 200.0), made.clip.name


def test_every_clip_starts_and_ends_at_rest_in_the_stand_pose(library: dict[str, Made]) -> None:
    for made in library.values():
        for end in (0, -1):
            assert np.abs(made.clip.joint_pos[end] - stand_pose()).max() < 0.01, made.clip.name
            assert np.abs(made.rates[0][end]).max() < 0.02, made.clip.name
        assert np.abs(made.clip.root_pos[0] - [0, 0, 0.7842]).max() < 0.001


def test_the_centre_of_mass_stays_over_the_feet_that_stand(library: dict[str, Made]) -> None:
    for made in of(library, *QUASI_STATIC):
        com = checks.com(made.clip)[:, :2]
        assert checks.support_margin(com, made.soles, made.contact).min() > 0.005, made.clip.name


def test_the_zero_moment_point_stays_inside_the_support(library: dict[str, Made]) -> None:
    for made in of(library, *QUASI_STATIC, *STEPPING):
        margin = checks.support_margin(zmp(floor_wrench(checks.qpos_of(made.clip))[0]), made.soles, made.contact)
        assert margin.min() > -0.01, made.clip.name


def test_floor_and_motors_can_supply_the_forces(library: dict[str, Made]) -> None:
    for made in library.values():
        if made.clip.family != "jump":
            loads = checks.loads(made.clip, made.contact, every=5)
            assert np.abs(loads.torque).max() < 0.8, made.clip.name
            assert np.abs(loads.missing[:, :3]).max() < 5.0, made.clip.name
            assert np.abs(loads.missing[:, 3:]).max() < 10.0, made.clip.name


def test_a_jump_falls_freely_while_it_is_in_the_air(library: dict[str, Made]) -> None:
    for made in of(library, "jump"):
        acceleration = np.diff(checks.com(made.clip), n=2, axis=0) * made.clip.fps**2
        for _, run in made.runs(carrying=False):
            assert 0.1 <= (len(run) + 1) / made.clip.fps <= 0.3
            assert np.abs(acceleration[run[1:-1] - 1] - [0, 0, -9.81]).max() < 0.5, made.clip.name
        loads = checks.loads(made.clip, made.contact)
        assert np.abs(loads.torque).max() < 0.9, made.clip.name
        assert np.abs(loads.missing[:, :3]).max() < 20.0, made.clip.name
        assert np.abs(loads.missing[:, 3:]).max() < 30.0, made.clip.name


def test_arms_and_legs_do_not_meet_the_body(library: dict[str, Made]) -> None:
    neighbours = {(f"{side}_hip_collision", "pelvis_collision") for side in ("left", "right")}
    neighbours |= {tuple(sorted(pair)) for pair in neighbours}
    for made in library.values():
        meeting = {pair: depth for pair, depth in checks.self_collisions(made.clip).items() if pair not in neighbours}
        assert max(meeting.values(), default=0.0) < 0.01, (made.clip.name, meeting)


def test_walks_and_turns_go_where_their_names_say(library: dict[str, Made]) -> None:
    def moved(name: str) -> np.ndarray:
        root = library[name].clip.root_pos
        return root[-1] - root[0]

    def turned(name: str) -> float:
        w, _, _, z = library[name].clip.root_quat[-1]
        return float(2 * np.arctan2(z, w))

    assert moved("walk_fast")[0] > moved("walk_slow")[0] > 0.7
    assert moved("walk_backward")[0] < -0.5
    assert moved("sidestep_left")[1] > 0.2 > -0.2 > moved("sidestep_right")[1]
    assert turned("turn_left") > 1.3
    assert turned("turn_right") < -1.3
    assert moved("walk_curve_left")[1] > 0.2 > -0.2 > moved("walk_curve_right")[1]
    assert moved("jump_forward")[0] > 0.08


def test_left_and_right_are_the_robots_own(library: dict[str, Made]) -> None:
    for side, other in (("left", "right"), ("right", "left")):
        moves = np.ptp(library[f"wave_{side}"].clip.joint_pos, axis=0)
        elbow = {s: moves[joint_names().index(f"{s}_shoulder_pitch_joint")] for s in (side, other)}
        assert elbow[side] > 1.0 > 0.1 > elbow[other]
        lifted = np.ptp(library[f"knee_lift_{side}"].soles[:, 0 if side == "left" else 1, :, 2])
        assert lifted > 0.1


def test_the_same_seed_makes_the_same_bytes_and_another_variant_others() -> None:
    def digests(**changed: object) -> list[str]:
        return [clip.sha256 for clip in make_library(EmbeddedConfig(limit=1, families=("stand",), **changed))]

    assert digests() == digests()
    assert digests() != digests(variants=(1,))
    assert digests() != digests(seed=1)


def test_a_limit_spans_the_families() -> None:
    clips = make_library(EmbeddedConfig(limit=4, families=("stand", "squat", "balance")))
    assert [clip.family for clip in clips] == ["stand", "stand", "squat", "balance"]


def test_a_caption_is_tagged_with_base_forms() -> None:
    line = caption_line("a person waves with the left hand")
    assert line == (
        "a person waves with the left hand#a/DET person/NOUN wave/VERB with/ADP the/DET left/ADJ hand/NOUN#0.0#0.0"
    )
    assert "step/NOUN" in caption_line("a person takes slow steps forward")
    assert "step/VERB" in caption_line("a person steps to the left")


def test_unknown_words_and_families_are_refused() -> None:
    with pytest.raises(BadInput, match="'gallops'"):
        caption_line("a person gallops")
    with pytest.raises(BadInput, match="swim"):
        make_library(EmbeddedConfig(families=("swim",)))
