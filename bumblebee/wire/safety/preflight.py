"""Refusals before anything moves: each a line that names what was expected, what came and what to do."""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import sole_points
from bumblebee.robot.facts import ROBOT
from bumblebee.wire.clock import Clock
from bumblebee.wire.links.lcm_codec import Codec, decode_card
from bumblebee.wire.links.link import Link
from bumblebee.wire.messages import CARD, STATE, Card, State, layout_of
from bumblebee.wire.safety.intake import without_numbers
from bumblebee.wire.safety.limits import Drives, Limits
from bumblebee.wire.safety.rules import lean

_PATIENCE = 5.0  # s for a card, which comes once a second, and a state
MAX_LIFT = 0.10
"""Soles of a clip's first frame may be so far off the floor [m], as in the simulation's trials."""


@dataclass(frozen=True)
class Wanted:
    """Needs of a run that its robot must meet."""

    contract: Mapping[str, Any]
    drives: Drives
    kp: np.ndarray
    """(J,) largest gains that will be sent [N m/rad]."""
    kd: np.ndarray
    """(J,) [N m s/rad]."""
    clip: Clip
    hold: np.ndarray
    """(J,) targets that carry its first frame [rad]."""
    numbers: tuple[str, ...]
    """Fields of a state that must be numbers."""
    limits: Limits
    unattended: bool


def new_controller() -> int:
    """A number for this run, never 0."""
    return 1 + secrets.randbits(62)


def meet(link: Link, clock: Clock) -> tuple[Card, State]:
    """Wait for a robot's card and state.

    Raises:
        BadInput: nobody is there, two are, or one that speaks another version.
    """
    cards, states, end = dict[int, Card](), dict[int, bytes](), clock.now() + round(_PATIENCE * 1e9)
    while clock.now() < end and not (cards and states):
        link.wait(0.1)
        for channel, message in link.received():
            if channel == CARD:
                card = decode_card(message)
                cards[card.robot] = card
            elif channel == STATE:
                states[0] = message
    if not states or not cards:
        came = "a card alone" if cards else "states without a card" if states else "nothing"
        do = "Start the robot, or a simulated one: bumblebee deploy robot"
        raise BadInput(f"wire: {_PATIENCE:g} s", "a robot's card and states", came, do)
    if len(cards) > 1:
        raise BadInput("wire", "one robot", f"{len(cards)} of them", "Give each its own --at.")
    (card,) = cards.values()
    return card, Codec(len(card.joints)).state(states[0])


def check(card: Card, state: State, wanted: Wanted) -> None:
    """Refuse a robot, or a start, that does not fit.

    Raises:
        BadInput: the first thing that is wrong.
    """
    _check_card(card, wanted)
    _check_state(card, state, wanted)
    _check_start(state, wanted)


def _check_card(card: Card, wanted: Wanted) -> None:
    expected = str(wanted.contract.get("robot", ROBOT))
    if card.name != expected:
        do = "Deploy a policy that was made for this robot."
        raise BadInput("wire: card: robot", f"{expected!r}, the policy's", repr(card.name)[:60], do)
    _check_joints(card.joints, wanted.drives.joints)
    for name, most, sent in (("kp", card.kp_most, wanted.kp), ("kd", card.kd_most, wanted.kd)):
        if (over := np.flatnonzero(sent > most)).size:
            joint, worst = wanted.drives.joints[over[0]], over[0]
            came = f"{sent[worst]:g} in the policy's contract or compensation"
            raise BadInput(f"wire: {name} of {joint}", f"at most {most[worst]:g}, the robot's", came)
    if 1.0 / card.state_hz >= wanted.limits.state_hold:
        least = f"more than {1 / wanted.limits.state_hold:g} states a second (state_hold)"
        raise BadInput("wire: card: state_hz", least, f"{card.state_hz:g}")
    if wanted.unattended and not card.simulated:
        do = "Leave out --unattended and hold the key."
        raise BadInput("--unattended", "a simulated robot", "one that can fall on people", do)


def _check_joints(came: Sequence[str], expected: Sequence[str]) -> None:
    for index in range(max(len(came), len(expected))):
        one, other = (names[index] if index < len(names) else "nothing" for names in (expected, came))
        if one != other:
            do = "Send joints in the contract's order."
            raise BadInput(f"wire: card: joints[{index}]", one, other[:60], do)


def _check_state(card: Card, state: State, wanted: Wanted) -> None:
    if state.layout != layout_of(wanted.drives.joints) or state.robot != card.robot:
        do = "Its joints have another order than its card says, or another robot is on this wire."
        raise BadInput("wire: state", f"layout {layout_of(wanted.drives.joints)}", str(state.layout), do)
    if state.controller:
        do = "End it first; a robot forgets a controller half a second after its last order."
        raise BadInput("wire: controller", "a robot that listens to nobody", f"controller {state.controller}", do)
    if name := without_numbers(state, wanted.numbers):
        do = "Check the robot's sensors."
        if name in ("base_lin_vel", "base_pos"):
            do = "Deploy a policy that needs no odometry, as `imu`."
        raise BadInput(f"wire: state: {name}", "numbers, which the policy needs", "NaN or infinity", do)
    if (bad := np.flatnonzero(state.error)).size:
        joint, code = wanted.drives.joints[bad[0]], int(state.error[bad[0]])
        raise BadInput(f"wire: motor of {joint}", "no error", f"error {code}", "Clear it at the robot.")


def _check_start(state: State, wanted: Wanted) -> None:
    """Whether the first frame can be reached from where the robot hangs or stands."""
    clip, drives, name = wanted.clip, wanted.drives, f"clip {wanted.clip.name}: first frame"
    for what, angles, do in (
        ("wire: state", state.joint_pos, "Bring the joint within its range, or calibrate it."),
        (name, wanted.clip.joint_pos[0], "Choose another clip."),
    ):
        margin = wanted.limits.beyond * (drives.high - drives.low)
        out = np.flatnonzero((angles < drives.low - margin) | (angles > drives.high + margin))
        if out.size:
            j = out[0]
            expected = f"{drives.joints[j]} from {drives.low[j]:g} to {drives.high[j]:g} rad"
            raise BadInput(what, expected, f"{angles[j]:.3g} rad", do)
    quat = clip.root_quat[0].astype(np.float64)
    if (angle := lean(quat, state.base_quat)) >= wanted.limits.tilt_deg:
        expected = f"a pelvis within {wanted.limits.tilt_deg:g} degrees of the robot's"
        raise BadInput(name, expected, f"{angle:.0f} degrees", "Hang the robot as the clip begins, or choose another.")
    place = clip.root_pos[:1].astype(np.float64)
    lift = float(sole_points(place, quat[None], clip.joint_pos[:1].astype(np.float64))[..., 2].min())
    if abs(lift) > MAX_LIFT:
        expected = f"soles within {MAX_LIFT:g} m of the floor"
        raise BadInput(name, expected, f"{lift:.2f} m", "Choose a clip that begins on the feet.")
