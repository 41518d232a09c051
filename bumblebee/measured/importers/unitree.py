"""Unitree's low-level messages (unitree_hg, the G1 and H1-2): motors by number, rad, N m, and a quaternion as wxyz."""

from typing import Any

UNITREE: dict[str, Any] = {
    "columns": {
        "joint_pos": "/lowstate:motor_state[].q",
        "joint_vel": "/lowstate:motor_state[].dq",
        "joint_torque": "/lowstate:motor_state[].tau_est",
        "base_quat": "/lowstate:imu_state.quaternion",
        "base_ang_vel": "/lowstate:imu_state.gyroscope",
        "joint_target": "/lowcmd:motor_cmd[].q",
        "target_vel": "/lowcmd:motor_cmd[].dq",
        "feed_forward": "/lowcmd:motor_cmd[].tau",
        "kp": "/lowcmd:motor_cmd[].kp",
        "kd": "/lowcmd:motor_cmd[].kd",
    },
    "angle_unit": "rad",
    "quat_order": "wxyz",
}
"""Entries of a map for the layout `unitree_hg`; which motor is which joint, and the clock, the map must say."""

_IMU = "float32[4] quaternion\nfloat32[3] gyroscope\nfloat32[3] accelerometer\nfloat32[3] rpy\nint16 temperature"
_STATE = (
    "uint8 mode\nfloat32 q\nfloat32 dq\nfloat32 ddq\nfloat32 tau_est\nint16[2] temperature\nfloat32 vol\n"
    "uint32[2] sensor\nuint32 motorstate\nuint32[4] reserve"
)
_COMMAND = "uint8 mode\nfloat32 q\nfloat32 dq\nfloat32 tau\nfloat32 kp\nfloat32 kd\nuint32 reserve"
_LOW_STATE = (
    "uint32[2] version\nuint8 mode_pr\nuint8 mode_machine\nuint32 tick\nIMUState imu_state\n"
    "MotorState[35] motor_state\nuint8[40] wireless_remote\nuint32[4] reserve\nuint32 crc"
)
_LOW_CMD = "uint8 mode_pr\nuint8 mode_machine\nMotorCmd[35] motor_cmd\nuint32[4] reserve\nuint32 crc"

MODE = "mode_pr"
"""Field that is 1 where the ankles' (and waist's) motors are driven apart instead of as pitch and roll."""


def definition(text: str, **parts: str) -> str:
    """A message definition with those that it names, in the form `ros2msg` of rosbag2."""
    line = "\n" + "=" * 80 + "\n"
    return line.join([text, *(f"MSG: {name.replace('__', '/')}\n{part}" for name, part in parts.items())])


UNITREE_TYPES = {
    "unitree_hg/msg/LowState": definition(_LOW_STATE, unitree_hg__IMUState=_IMU, unitree_hg__MotorState=_STATE),
    "unitree_hg/msg/LowCmd": definition(_LOW_CMD, unitree_hg__MotorCmd=_COMMAND),
}
"""Definitions as bags before ROS 2 Iron do not hold them (unitree_ros2's messages)."""
