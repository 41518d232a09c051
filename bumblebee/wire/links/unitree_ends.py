"""Both ends of Unitree's messages: our orders and states as LowCmd_ and LowState_, and back.

LowState_ does not say who is listened to, nor which order is in force. The controller's end says what can be known:
whether another one speaks on rt/lowcmd, and whether anybody listens to us.
"""

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.facts import ROBOT, joint_names
from bumblebee.wire.clock import SECOND
from bumblebee.wire.links.lcm_codec import Codec, encode_card
from bumblebee.wire.links.unitree_hg import HELD, LOW_STATE, OURS, SERIES, checksum, command, require_served
from bumblebee.wire.messages import Card, Mode, Order, State, layout_of
from bumblebee.wire.robot_end.hearing import RELEASE

MACHINE = 5
"""mode_machine of the G1 whose facts are ours: 29 motors, waist not locked. Others have other joints or motors."""
_SIMULATED = 0x42554D42  # in a state's reserve[0]: our simulated robot, which is told who holds its rope
_SOMEBODY = -1
_STATE_HZ = 500.0  # of rt/lowstate, as the vendor says


class ControllerEnd:
    """States that come, and orders that go.

    Args:
        kp: of the six wrists, which no policy of ours moves [N m/rad].
        kd: of the wrists [N m s/rad].
    """

    def __init__(self, kp: float, kd: float) -> None:
        require_served()
        self._kp, self._kd, self._codec = kp, kd, Codec(len(joint_names()))
        self._writers: list[int] = []
        self._before: np.ndarray | None = None
        """The newest state before orders began to carry the joints."""
        self._sent: Order | None = None
        self._other = -SECOND

    def another(self, now: int) -> None:
        """Note an order at `now` [ns] that is not ours."""
        self._other = now

    def order(self, message: bytes) -> np.ndarray | None:
        """LowCmd_ of an order; None before a state has told where the wrists are."""
        if self._before is None:
            return None
        self._sent = order = self._codec.order(message)
        wrists = self._before["motor_state"]["q"][HELD]
        sent = command(order, int(self._before["mode_machine"]), wrists, self._kp, self._kd)
        if _simulated(self._before) and order.mode is Mode.RUN:
            sent["reserve"][0] = _SIMULATED
            sent["crc"] = checksum(sent)
        return sent

    def state(self, record: np.ndarray, writer: int, now: int, listened: bool) -> tuple[bytes, bytes]:
        """Message of a state, and of the robot's card.

        Args:
            record: () LowState_.
            writer: whose it is.
            now: when it came [ns].
            listened: whether anybody on the wire takes our orders.

        Raises:
            BadInput: a G1 with other joints than ours, or with its ankles' motors in parallel.
        """
        for name, expected in (("mode_machine", MACHINE), ("mode_pr", SERIES)):
            if record[name] != expected:
                do = "Run it on the G1 with 29 motors; others have other joints."
                raise BadInput(f"unitree: LowState_: {name}", str(expected), str(record[name]), do)
        if writer not in self._writers:
            self._writers.append(writer)
        if self._sent is None or self._sent.mode in (Mode.OFF, Mode.DAMP):
            self._before = record
        robot, sent = 1 + self._writers.index(writer), self._sent if listened else None
        other, motors = now - self._other < RELEASE * SECOND, record["motor_state"][OURS]
        imu, unknown = record["imu_state"], np.full(3, np.nan)
        state = State(
            robot,
            layout_of(joint_names()),
            int(record["tick"]),
            int(record["tick"]) * 1_000_000,
            motors["q"],
            motors["dq"],
            motors["tau_est"],
            imu["quaternion"],
            imu["gyroscope"],
            unknown,
            unknown,
            unknown[:2],
            motors["temperature"].max(axis=1),
            motors["motorstate"],
            sent.mode if sent else Mode.OFF,
            _SOMEBODY if other else sent.controller if sent else 0,
            sent.sequence if sent else -1,
            -1,
        )
        most = np.full(len(OURS), np.inf)
        card = Card(robot, _simulated(record), ROBOT, joint_names(), _STATE_HZ, most, most)
        return self._codec.encode_state(state), encode_card(card)


class RobotEnd:
    """Orders that come to a simulated robot, and states that go."""

    def __init__(self) -> None:
        require_served()
        self._codec, self._count = Codec(len(joint_names())), 0

    def order(self, record: np.ndarray, writer: int) -> bytes:
        """Message of the order in a LowCmd_ () of a `writer`; orders count up as they come."""
        motors, self._count = record["motor_cmd"][OURS], self._count + 1
        mode = Mode.RUN if record["reserve"][0] == _SIMULATED else Mode.HOLD
        if not motors["mode"].any():
            mode = Mode.OFF
        elif not motors["kp"].any():
            mode = Mode.DAMP
        values = (motors["q"], motors["kp"], motors["kd"], motors["tau"])
        controller = 1 + writer % (1 << 62)
        order = Order(controller, layout_of(joint_names()), self._count, -1, 0, mode, *values)
        return self._codec.encode_order(order)

    def state(self, message: bytes) -> np.ndarray:
        """LowState_ () of a state's message."""
        state, record = self._codec.state(message), np.zeros((), LOW_STATE)
        record["mode_pr"], record["mode_machine"], record["tick"] = SERIES, MACHINE, state.stamp_ns // 1_000_000 % 2**32
        record["imu_state"]["quaternion"], record["imu_state"]["gyroscope"] = state.base_quat, state.base_ang_vel
        motors = record["motor_state"]
        motors["q"][OURS], motors["dq"][OURS] = state.joint_pos, state.joint_vel
        motors["tau_est"][OURS], motors["motorstate"][OURS] = state.joint_torque, state.error
        record["reserve"][0] = _SIMULATED
        record["crc"] = checksum(record)
        return record


def _simulated(state: np.ndarray) -> bool:
    return bool(state["reserve"][0] == _SIMULATED)
