"""A robot or a clip that does not fit is refused before anything moves, in one line that says what to do."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.wire.clock import Clock
from bumblebee.wire.links.lcm_codec import Codec, encode_card
from bumblebee.wire.links.link import Link, open_link
from bumblebee.wire.messages import CARD, ORDER, STATE, Card, State, layout_of
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot
from bumblebee.wire.safety.intake import numbers_for
from bumblebee.wire.safety.limits import Limits, drives_of, read_limits
from bumblebee.wire.safety.preflight import Wanted, check, meet
from tests.policy.conftest import nod


@pytest.fixture(scope="module")
def there() -> tuple[Card, State]:
    """A robot as it says of itself."""
    robot = WireRobot([], RobotSettings(noise=0.0), 0)
    states = [message for channel, message in robot.advance(10_000_000, []) if channel == STATE]
    return robot.card, Codec(23).state(states[-1])


@pytest.fixture
def wanted(shipped: ExportedPolicy) -> Wanted:
    drives = drives_of(shipped.contract)
    return Wanted(
        shipped.contract,
        drives,
        drives.kp,
        drives.kd,
        nod(),
        nod().joint_pos[0],
        numbers_for(shipped.sensors),
        Limits(),
        True,
    )


def swapped(names: tuple[str, ...]) -> tuple[str, ...]:
    return (*names[:3], names[4], names[3], *names[5:])


def turned(wanted: Wanted) -> Wanted:
    clip = nod()
    return replace(wanted, clip=replace(clip, root_quat=np.tile([0.7, 0.0, 0.7, 0.0], (clip.frames, 1))))


def lifted(wanted: Wanted) -> Wanted:
    clip = nod()
    return replace(wanted, clip=replace(clip, root_pos=clip.root_pos + np.float32([0, 0, 0.4])))


def bent(wanted: Wanted) -> Wanted:
    clip = nod()
    return replace(wanted, clip=replace(clip, joint_pos=clip.joint_pos + 3.0))


CARDS: dict[str, tuple[dict[str, Any], str]] = {
    "another robot": ({"name": "h1"}, "robot: expected 'g1_23dof', the policy's, came 'h1'"),
    "joints in another order": ({"joints": swapped}, r"joints\[3\]: expected left_knee_joint, came left_ankle_pitch"),
    "a joint too few": ({"joints": lambda names: names[:-1]}, r"joints\[22\]: .* came nothing"),
    "gains that it refuses": ({"kp_most": lambda most: most * 0.1}, "kp of left_hip_pitch_joint: expected at most"),
    "damping that it refuses": ({"kd_most": lambda most: most * 0.1}, "kd of left_hip_pitch_joint"),
    "states too seldom": ({"state_hz": 50.0}, "states a second"),
    "nobody holds a key of a real robot": ({"simulated": False}, "--unattended: expected a simulated robot"),
}
STATES: dict[str, tuple[dict[str, Any], str]] = {
    "joints of another order than its card's": ({"layout": 4}, "layout"),
    "another robot on the wire": ({"robot": 4}, "another robot is on this wire"),
    "a second controller": ({"controller": 77}, "listens to nobody, came controller 77"),
    "no numbers": ({"base_quat": np.full(4, np.nan)}, "base_quat: expected numbers"),
    "no odometry": ({"base_pos": np.full(3, np.nan)}, "base_pos: expected numbers.*as `imu`"),
    "a drive with an error": (
        {"error": np.arange(23)},
        "motor of left_hip_roll_joint: expected no error, came error 1",
    ),
    "a joint out of its range": ({"joint_pos": np.full(23, 2.8)}, "left_ankle_pitch_joint from"),
    "a robot that lies": (
        {"base_quat": np.array([0.7, 0.7, 0, 0])},
        "first frame: expected a pelvis within 45 degrees",
    ),
}
CLIPS = {"turned": (turned, "pelvis within"), "in the air": (lifted, "soles within"), "bent": (bent, "Choose another")}


def test_the_robot_as_it_is_is_not_refused(there: tuple[Card, State], wanted: Wanted) -> None:
    check(*there, wanted)


def test_a_policy_that_needs_no_odometry_takes_a_robot_without(there: tuple[Card, State], wanted: Wanted) -> None:
    card, state = there
    lost = {"base_lin_vel": np.full(3, np.nan), "base_pos": np.full(3, np.nan), "joint_torque": np.full(23, np.nan)}
    blind = replace(wanted, numbers=numbers_for(("imu", "heading", "encoders")))
    check(card, replace(state, **lost), blind)
    with pytest.raises(BadInput, match="joint_vel: expected numbers"):
        check(card, replace(state, joint_vel=np.full(23, np.nan)), blind)


@pytest.mark.parametrize("what", CARDS)
def test_a_card_that_does_not_fit(what: str, there: tuple[Card, State], wanted: Wanted) -> None:
    fields, said = CARDS[what]
    card, state = there
    changed = {name: make(getattr(card, name)) if callable(make) else make for name, make in fields.items()}
    with pytest.raises(BadInput, match=said):
        check(replace(card, **changed), state, wanted)


@pytest.mark.parametrize("what", STATES)
def test_a_state_that_does_not_fit(what: str, there: tuple[Card, State], wanted: Wanted) -> None:
    fields, said = STATES[what]
    with pytest.raises(BadInput, match=said):
        check(there[0], replace(there[1], **fields), wanted)


@pytest.mark.parametrize("what", CLIPS)
def test_a_clip_whose_first_frame_is_far_from_where_the_robot_stands(
    what: str, there: tuple[Card, State], wanted: Wanted
) -> None:
    change, said = CLIPS[what]
    with pytest.raises(BadInput, match=said):
        check(*there, change(wanted))


@pytest.fixture
def links(tmp_path: Path) -> Iterator[tuple[Link, Link]]:
    ours, theirs = open_link("sim", [STATE, CARD], str(tmp_path / "w")), open_link("sim", [ORDER], str(tmp_path / "w"))
    yield ours, theirs
    ours.close()
    theirs.close()


def test_nobody_two_robots_or_another_version_on_the_wire(
    links: tuple[Link, Link], there: tuple[Card, State], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bumblebee.wire.safety.preflight._PATIENCE", 0.05)
    (ours, theirs), (card, state) = links, there
    with pytest.raises(BadInput, match=r"card and states, came nothing. Start the robot.*bumblebee deploy robot"):
        meet(ours, Clock())
    theirs.send(CARD, encode_card(card))
    with pytest.raises(BadInput, match="a card alone"):
        meet(ours, Clock())
    message = Codec(23).encode_state(state)
    for other, said in ((encode_card(replace(card, robot=9)), "one robot"), (b"\0" * 40, "another type")):
        theirs.send(CARD, encode_card(card))
        theirs.send(CARD, other)
        theirs.send(STATE, message)
        with pytest.raises(BadInput, match=said):
            meet(ours, Clock())
    theirs.send(CARD, encode_card(card))
    theirs.send(STATE, message)
    met, seen = meet(ours, Clock())
    assert met.joints == card.joints and seen.layout == layout_of(card.joints)


def test_limits_come_from_a_file_and_what_is_none_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "limits.yaml"
    path.write_text("tilt_deg: 20\nspeed: 0.5\n")
    assert read_limits(path) == Limits(tilt_deg=20.0, speed=0.5)
    for text, said in (
        ("tild: 3", "tild: expected one of .*tilt_deg"),
        ("- 3", "keys and values"),
        ("speed: fast", "Limits.speed: expected a number"),
        ("hot: 50", "warm: expected a number below hot"),
    ):
        path.write_text(text)
        with pytest.raises(BadInput, match=said):
            read_limits(path)
