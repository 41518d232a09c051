"""The library's table of contents: every kind of motion with its family, its plan and its captions."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import radians
from typing import Any

from bumblebee.motion.embedded import balance, gestures, jumps, squats, steps
from bumblebee.motion.embedded.plan import Plan
from bumblebee.motion.embedded.vary import Vary

BOTH = ("left", "right")
FAMILIES = ("stand", "squat", "walk", "turn", "sidestep", "jump", "balance")


@dataclass(frozen=True)
class Kind:
    """One kind of motion."""

    name: str
    family: str
    build: Callable[[Vary], Plan]
    captions: tuple[str, ...]


def kinds() -> tuple[Kind, ...]:
    """All kinds, family by family."""
    return (*_stand(), *_arms(), *_squat(), *_walk(), *_turn(), *_sidestep(), *_jump(), *_balance())


def _stand() -> tuple[Kind, ...]:
    g = gestures
    sided = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        sided += [
            Kind(f"wave_{side}", "stand", partial(g.wave, sides=(side,)),
                 (f"a person waves with the {side} hand", f"a person raises the {side} arm and waves",
                  f"someone stands in place waving the {side} hand")),
            Kind(f"look_{side}", "stand", partial(g.look, sign=sign),
                 (f"a person turns the torso to the {side}",
                  f"a person looks to the {side} and then forward again")),
            Kind(f"point_{side}", "stand", partial(g.pose, sides=(side,), arm=g.AHEAD, seconds=1.2),
                 (f"a person points forward with the {side} arm", f"a person stretches the {side} arm straight ahead")),
        ]  # fmt: skip
    return (
        *sided,
        Kind("bow", "stand", lambda v: g.bow(v, 0.7),
             ("a person bows", "a person slowly bends forward and comes up again")),
        Kind("bow_slight", "stand", lambda v: g.bow(v, 0.4),
             ("a person bows slightly", "a person leans the torso forward and returns")),
        Kind("sway", "stand", lambda v: g.sway(v, 0.06, 2),
             ("a person sways from side to side", "a person shifts the weight from one foot to the other foot")),
        Kind("shift_weight", "stand", lambda v: g.sway(v, 0.085, 1),
             ("a person shifts their weight to the left and then to the right",
              "a person slowly leans from foot to foot")),
        Kind("twist", "stand", g.twist,
             ("a person twists the torso left and right", "a person rotates the body at the waist")),
        Kind("side_bend", "stand", g.side_bend,
             ("a person bends sideways to each side", "a person leans the torso to one side and then the other side")),
    )  # fmt: skip


def _arms() -> tuple[Kind, ...]:
    g = gestures
    return (
        Kind("wave_both", "stand", lambda v: g.wave(v, BOTH),
             ("a person waves with both hands", "a person raises both arms and waves")),
        Kind("hands_up", "stand", lambda v: g.pose(v, BOTH, g.UP),
             ("a person raises both hands", "a person lifts both arms overhead and lowers them",
              "someone puts their hands up in the air")),
        Kind("arms_aside", "stand", lambda v: g.pose(v, BOTH, g.ASIDE),
             ("a person spreads both arms to the sides", "a person lifts their arms out sideways and lowers them")),
        Kind("arms_ahead", "stand", lambda v: g.pose(v, BOTH, g.AHEAD),
             ("a person stretches both arms forward", "a person lifts both arms straight ahead")),
        Kind("elbows_out", "stand", lambda v: g.pose(v, BOTH, g.ELBOWS_OUT),
             ("a person spreads the elbows and holds both hands behind the hips",
              "a person holds their hands low at the sides, elbows out")),
        Kind("clap", "stand", g.clap,
             ("a person claps", "a person claps their hands in front of the chest")),
        Kind("arm_circles", "stand", g.arm_circles,
             ("a person makes circles with both arms", "a person draws small circles with the arms out sideways")),
        Kind("arm_swing", "stand", g.arm_swing,
             ("a person swings the arms", "a person stands and swings their arms forward and backward")),
        Kind("shrug", "stand", g.shrug,
             ("a person shrugs twice", "a person shrugs with both arms")),
        Kind("punch", "stand", g.punch,
             ("a person punches slowly with the left and the right hand", "a person throws slow punches forward",
              "a person boxes slowly in place")),
    )  # fmt: skip


def _squat() -> tuple[Kind, ...]:
    s = squats
    return (
        Kind("squat_shallow", "squat", lambda v: s.squat(v, 0.10, 0.9, times=2),
             ("a person does two shallow squats", "a person bends the knees slightly, two times")),
        Kind("squat", "squat", lambda v: s.squat(v, 0.18, 1.1),
             ("a person squats", "a person squats down and stands up again")),
        Kind("squat_deep", "squat", lambda v: s.squat(v, 0.26, 1.4),
             ("a person squats down deeply", "a person does a deep squat and comes up")),
        Kind("squat_slow", "squat", lambda v: s.squat(v, 0.2, 2.1),
             ("a person slowly squats", "a person slowly sinks down into a squat and slowly comes up")),
        Kind("squat_quick", "squat", lambda v: s.squat(v, 0.15, 0.6, 0.05, times=3),
             ("a person does three quick squats", "a person quickly squats three times")),
        Kind("squat_arms_ahead", "squat", lambda v: s.squat(v, 0.2, 1.2, ahead=True),
             ("a person squats with the arms straight ahead", "a person does a squat and holds both arms forward")),
        Kind("crouch_hold", "squat", lambda v: s.squat(v, 0.22, 1.2, 2.0),
             ("a person crouches and stays low", "a person sinks down, holds a low squat and comes up")),
        Kind("reach_low_left", "squat", lambda v: s.reach_low(v, ("left",), 0.26),
             ("a person reaches low with the left hand", "a person crouches and reaches down with the left arm")),
        Kind("reach_low_right", "squat", lambda v: s.reach_low(v, ("right",), 0.26),
             ("a person reaches low with the right hand", "a person crouches and reaches down with the right arm")),
        Kind("reach_low_both", "squat", lambda v: s.reach_low(v, BOTH, 0.26),
             ("a person reaches toward the floor with both hands",
              "a person crouches and picks something up from the ground")),
    )  # fmt: skip


def _walk() -> tuple[Kind, ...]:
    def walk(name: str, speed: float, period: float, count: int, captions: tuple[str, ...], **path: Any) -> Kind:
        return Kind(name, "walk", lambda v: steps.walk(v(speed), v(period, 0.5), count, **path), captions)

    return (
        walk("walk_slow", 0.25, 0.9, 5,
             ("a person walks forward slowly", "a person takes slow steps forward",
              "someone strolls forward calmly")),
        walk("walk", 0.4, 0.7, 7,
             ("a person walks forward", "a person walks straight ahead at a normal pace")),
        walk("walk_right_first", 0.35, 0.75, 6,
             ("a person walks forward with short steps",
              "a person steps forward with the right foot and walks"), first=1),
        walk("walk_fast", 0.6, 0.55, 9,
             ("a person walks forward quickly", "a person walks ahead at a fast pace")),
        walk("walk_backward", 0.25, 0.75, 6,
             ("a person walks backward", "a person takes steps backward"), sign=-1.0),
        walk("walk_backward_slow", 0.15, 0.9, 5,
             ("a person walks backwards slowly", "a person takes small slow steps backward"), sign=-1.0, first=1),
        walk("walk_curve_left", 0.35, 0.7, 7,
             ("a person walks in a curve to the left", "a person walks forward and turns left"), radius=1.3),
        walk("walk_curve_right", 0.35, 0.7, 7,
             ("a person walks in a curve to the right", "a person walks forward and turns right"),
             radius=-1.3, first=1),
    )  # fmt: skip


def _turn() -> tuple[Kind, ...]:
    sided = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        sided += [
            Kind(f"turn_{side}", "turn", partial(_turn_by, degrees=sign * 90, each=30, period=0.7),
                 (f"a person turns {side} in place", f"a person turns ninety degrees to the {side}")),
            Kind(f"turn_{side}_slow", "turn",
                 partial(_turn_by, degrees=sign * 45, each=22.5, period=0.9),
                 (f"a person slowly turns to the {side}", f"a person turns slightly to the {side} with small steps")),
        ]  # fmt: skip
    march = Kind("march", "turn", lambda v: steps.march(v(0.7, 0.5), 6, v(0.09)),
                 ("a person marches in place", "a person lifts the feet in turn and stays in place"))  # fmt: skip
    return (*sided, march)


def _turn_by(vary: Vary, degrees: float, each: float, period: float) -> Plan:
    return steps.turn(radians(vary(degrees)), radians(each), vary(period, 0.5))


def _sidestep() -> tuple[Kind, ...]:
    def side_steps(name: str, distances: tuple[float, ...], period: float, captions: tuple[str, ...]) -> Kind:
        return Kind(name, "sidestep", lambda v: steps.side_steps([v(d) for d in distances], v(period, 0.5)), captions)

    return (
        side_steps("sidestep_left", (0.09, 0.09, 0.09), 0.6,
                   ("a person steps to the left", "a person takes three steps sideways to the left")),
        side_steps("sidestep_right", (-0.09, -0.09, -0.09), 0.6,
                   ("a person steps to the right", "a person takes three steps sideways to the right")),
        side_steps("sidestep_left_right", (0.08, -0.08, 0.08, -0.08), 0.6,
                   ("a person steps left and right", "a person steps sideways from side to side")),
        side_steps("sidestep_left_slow", (0.06, 0.06), 0.75,
                   ("a person slowly steps to the left", "a person takes small slow steps sideways to the left")),
    )  # fmt: skip


def _jump() -> tuple[Kind, ...]:
    j = jumps
    return (
        Kind("jump", "jump", lambda v: j.jump(v, 0.18),
             ("a person jumps", "a person jumps straight up in place")),
        Kind("jump_small", "jump", lambda v: j.jump(v, 0.14, crouch=0.06),
             ("a person makes a small jump", "a person hops slightly in place")),
        Kind("jump_forward", "jump", lambda v: j.jump(v, 0.2, ahead=0.09, crouch=0.045),
             ("a person jumps forward", "a person makes a small jump ahead")),
        Kind("jump_twice", "jump", lambda v: j.jump(v, 0.16, crouch=0.06, hops=2),
             ("a person jumps two times", "a person makes two small jumps in place")),
    )  # fmt: skip


def _balance() -> tuple[Kind, ...]:
    kinds_ = []
    for side, other in (("left", "right"), ("right", "left")):
        kinds_ += [
            Kind(f"stand_on_{side}", "balance", partial(balance.one_leg, stance=side),
                 (f"a person stands on the {side} leg", f"a person lifts the {other} foot and balances")),
            Kind(f"knee_lift_{other}", "balance",
                 partial(balance.one_leg, stance=side, lift=0.2, ahead=0.12, seconds=0.6, pitch=0.3),
                 (f"a person lifts the {other} knee high",
                  f"a person raises the {other} knee and puts the foot down again")),
            Kind(f"kick_{other}", "balance", partial(balance.kick, stance=side),
                 (f"a person slowly kicks with the {other} leg",
                  f"a person swings the {other} foot forward and returns")),
        ]  # fmt: skip
    return tuple(kinds_)
