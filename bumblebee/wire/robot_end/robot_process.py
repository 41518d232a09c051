"""The stand-in robot's process: a `WireRobot` in real time on a wire."""

from collections.abc import Callable, Sequence

from bumblebee.errors import BadInput
from bumblebee.stand_in.sealed import Json
from bumblebee.wire.clock import SECOND, Clock
from bumblebee.wire.links.link import open_link
from bumblebee.wire.messages import ORDER, STATE, Mode
from bumblebee.wire.robot_end.robot import RobotSettings, WireRobot

_LISTEN = 0.5  # s in which another robot of this wire would have told its state


def require_alone(wire: str, at: str) -> None:
    """Refuse a wire on which a robot tells its state already; of `unitree` that is not looked for.

    Raises:
        BadInput: one does.
    """
    if wire == "unitree":  # whose states reach no one but a controller
        return
    link = open_link(wire, [STATE], at)
    try:
        link.wait(_LISTEN)
        if link.received():
            do = "End that one, or give each its own --at."
            raise BadInput(f"wire {wire}", "no robot on it yet", "states of one", do)
    finally:
        link.close()


def run_robot(
    wire: str,
    at: str,
    effects: Sequence[Json],
    settings: RobotSettings,
    slow: float = 1.0,
    seconds: float | None = None,
    say: Callable[[str], None] = lambda line: None,
    make: Callable[[Sequence[Json], RobotSettings, int], WireRobot] = WireRobot,
) -> WireRobot:
    """Let the robot live on a wire.

    Args:
        wire: as for `open_link`.
        at: address of the wire.
        effects: entries of the sealed file, empty for none.
        settings: of the robot and its line.
        slow: how much slower than real time.
        seconds: when to end, in the robot's time; None for no end.
        say: told when the mode changes.
        make: makes the robot from its effects, settings and the time of its boot [ns].
    """
    clock, link = Clock(slow), open_link(wire, [ORDER], at)
    begun = clock.now()
    robot, mode = make(effects, settings, begun), None
    try:
        while seconds is None or clock.now() - begun < seconds * SECOND:
            now = clock.now()
            for channel, message in robot.advance(now, [message for _, message in link.received()]):
                link.send(channel, message)
            if (new := robot.hearing.mode(now)) is not mode:
                mode = new
                say(f"[{(now - begun) / SECOND:8.2f} s] {_WORDS[mode]}")
            clock.sleep_until(robot.next_period)
    except KeyboardInterrupt:
        pass
    finally:
        link.close()
    return robot


_WORDS = {
    Mode.OFF: "off: hangs in the gantry",
    Mode.DAMP: "damps: the gantry holds it",
    Mode.HOLD: "holds targets: the gantry lowers it to the floor",
    Mode.RUN: "carries itself",
}
