"""Definitions of the messages that logs of joints hold, for bags that do not hold them (SQLite before ROS 2 Iron)."""

from bumblebee.measured.importers.unitree import UNITREE_TYPES, definition

_TIME = "int32 sec\nuint32 nanosec"
_HEADER = "builtin_interfaces/Time stamp\nstring frame_id"
_LAYOUT = {
    "std_msgs__MultiArrayLayout": "MultiArrayDimension[] dim\nuint32 data_offset",
    "std_msgs__MultiArrayDimension": "string label\nuint32 size\nuint32 stride",
}
_POINT = (
    "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
    "builtin_interfaces/Duration time_from_start"
)
_STAMPED = {"std_msgs__Header": _HEADER, "builtin_interfaces__Time": _TIME}
_PLANNED = {"trajectory_msgs__JointTrajectoryPoint": _POINT, "builtin_interfaces__Duration": _TIME}
_THREE = "float64 x\nfloat64 y\nfloat64 z"

JOINT_STATE = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"
_IMU = (
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance"
)

TYPES = {
    "sensor_msgs/msg/JointState": definition(JOINT_STATE, **_STAMPED),
    "sensor_msgs/msg/Imu": definition(
        _IMU, **_STAMPED, geometry_msgs__Quaternion=f"{_THREE}\nfloat64 w", geometry_msgs__Vector3=_THREE
    ),
    "std_msgs/msg/Float64": "float64 data",
    "std_msgs/msg/Float64MultiArray": definition("MultiArrayLayout layout\nfloat64[] data", **_LAYOUT),
    "std_msgs/msg/Float32MultiArray": definition("MultiArrayLayout layout\nfloat32[] data", **_LAYOUT),
    "trajectory_msgs/msg/JointTrajectoryPoint": definition(_POINT, builtin_interfaces__Duration=_TIME),
    "trajectory_msgs/msg/JointTrajectory": definition(
        "std_msgs/Header header\nstring[] joint_names\nJointTrajectoryPoint[] points", **_STAMPED, **_PLANNED
    ),
    **UNITREE_TYPES,
}
