"""Unitree's `unitree_hg` messages of a G1 as NumPy records: layout, checksum, and which of the 29 motors are ours.

Facts of the vendor's IDL (LowCmd_ on rt/lowcmd, LowState_ on rt/lowstate), as its checksum lays them out:
little-endian, four-byte aligned, 35 motor slots. `unitree_link` carries them.
"""

import zlib

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.robot.facts import ROBOT, joint_names
from bumblebee.wire.messages import Mode, Order

_LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
_WRIST = ("wrist_roll", "wrist_pitch", "wrist_yaw")
_ARM = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", *_WRIST)
_PARTS = (("left_", _LEG), ("right_", _LEG), ("waist_", ("yaw", "roll", "pitch")), ("left_", _ARM), ("right_", _ARM))
MOTORS = tuple(f"{side}{name}_joint" for side, names in _PARTS for name in names)
"""Joints of a G1 with 29 motors, in the order of its slots; the ankles and the waist in series (mode_pr 0)."""
OURS = np.array([MOTORS.index(name) for name in joint_names() if name in MOTORS])
"""(23,) slot of each of our joints; of another robot no end of this link is made (`require_served`)."""
HELD = np.setdiff1d(np.arange(len(MOTORS)), OURS)
"""(6,) slots of the wrists."""
SERVED = "g1_23dof"
"""The robot that this link was tried with."""
SERIES = 0
"""mode_pr: ankles by pitch and roll, not by their two motors."""

_PAD = "V3"
_MOTOR_CMD = [("mode", "u1"), ("pad", _PAD), *((name, "<f4") for name in ("q", "dq", "tau", "kp", "kd"))]
_MOTOR_STATE = [("mode", "u1"), ("pad", _PAD), *((name, "<f4") for name in ("q", "dq", "ddq", "tau_est"))]
_TAIL = [("temperature", "<i2", (2,)), ("vol", "<f4"), ("sensor", "<u4", (2,)), ("motorstate", "<u4")]
_IMU = [("quaternion", "<f4", (4,)), ("gyroscope", "<f4", (3,)), ("accelerometer", "<f4", (3,)), ("rpy", "<f4", (3,))]
_RESERVE = ("reserve", "<u4", (4,))
_MODES = [("mode_pr", "u1"), ("mode_machine", "u1"), ("pad", "V2")]
_MOTOR_CMDS = ("motor_cmd", [*_MOTOR_CMD, ("reserve", "<u4")], (35,))
_MOTOR_STATES = ("motor_state", [*_MOTOR_STATE, *_TAIL, _RESERVE], (35,))
_IMU_STATE = ("imu_state", [*_IMU, ("temperature", "<i2"), ("pad", "V2")])
_REMOTE = ("wireless_remote", "u1", (40,))
_CRC = ("crc", "<u4")
LOW_CMD = np.dtype([*_MODES, _MOTOR_CMDS, _RESERVE, _CRC])
"""LowCmd_, 1,004 bytes."""
LOW_STATE = np.dtype(
    [("version", "<u4", (2,)), *_MODES, ("tick", "<u4"), _IMU_STATE, _MOTOR_STATES, _REMOTE, _RESERVE, _CRC]
)
"""LowState_, 2,092 bytes; quaternion wxyz, gyroscope [rad/s] in the base frame."""
_NAMES = {LOW_CMD: "LowCmd_", LOW_STATE: "LowState_"}
_BREAKS = {LOW_CMD: 2, LOW_STATE: 70}  # where the first motor begins in DDS; two bytes later in a record
_MIRRORED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def require_served() -> None:
    """Refuse the link for a robot that it was not tried with: what holds its other motors still is for these alone.

    Raises:
        BadInput: another robot than the G1 with its wrists held.
    """
    if ROBOT != SERVED:
        raise BadInput("wire unitree", SERVED, ROBOT, "Use --wire lcm with a bridge of your robot.")


def checksum(record: np.ndarray) -> int:
    """Checksum over all words of a LowCmd_ or LowState_ but its last.

    It is CRC-32 with polynomial 0x04C11DB7 and begin 0xFFFFFFFF, each little-endian word taken from its highest bit,
    and nothing turned at the end. zlib's takes bits from the lowest, so bits are mirrored before and after.
    """
    words = np.frombuffer(record.tobytes()[:-4], "<u4").astype(">u4").tobytes()
    mirrored = zlib.crc32(words.translate(_MIRRORED)) ^ 0xFFFFFFFF
    return int(f"{mirrored:032b}"[::-1], 2)


def command(order: Order, mode_machine: int, wrists: np.ndarray, kp: float, kd: float) -> np.ndarray:
    """LowCmd_ of an order for our 23 joints.

    Args:
        order: of joints in our order.
        mode_machine: as the robot's newest LowState_ has it.
        wrists: (6,) where `HELD` were measured when control began [rad].
        kp: of the wrists [N m/rad].
        kd: of the wrists [N m s/rad].

    Returns:
        () `LOW_CMD` with its checksum; motors are disabled for `Mode.OFF`, and have kd alone for `Mode.DAMP`.
    """
    sent, on = np.zeros((), LOW_CMD), order.mode is not Mode.OFF
    carried = float(order.mode in (Mode.HOLD, Mode.RUN))
    sent["mode_pr"], sent["mode_machine"] = SERIES, mode_machine
    motors = sent["motor_cmd"]
    motors["mode"][: len(MOTORS)] = on
    motors["q"][OURS], motors["q"][HELD] = order.target, wrists
    motors["kp"][OURS], motors["kp"][HELD] = carried * order.kp, carried * kp
    motors["kd"][OURS], motors["kd"][HELD] = on * order.kd, on * kd
    motors["tau"][OURS] = carried * order.torque
    sent["crc"] = checksum(sent)
    return sent


def as_cdr(record: np.ndarray) -> bytes:
    """Body of a message as DDS sends it: a struct begins where its first member may, so four pad bytes less."""
    data, at = record.tobytes(), _BREAKS[record.dtype]
    return data[:at] + data[at + 2 : at + 4] + data[at + 6 :]


def from_cdr(body: bytes, layout: np.dtype) -> np.ndarray:
    """Message from its body; a checksum is the only thing that is refused beside a length.

    Args:
        body: as from `as_cdr`.
        layout: `LOW_CMD` or `LOW_STATE`.

    Returns:
        () of that layout.

    Raises:
        BadInput: another length, or a checksum that is not that of the bytes.
    """
    at, name = _BREAKS[layout], _NAMES[layout]
    if len(body) != layout.itemsize - 4:
        raise BadInput(f"unitree: {name}", f"{layout.itemsize - 4} bytes", str(len(body)))
    record = np.frombuffer(body[:at] + bytes(2) + body[at : at + 2] + bytes(2) + body[at + 2 :], layout)[0]
    if int(record["crc"]) != checksum(record):
        raise BadInput(f"unitree: {name}: crc", f"{checksum(record):#010x}", f"{int(record['crc']):#010x}")
    return record
