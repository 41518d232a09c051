"""ROS 2 recordings (rosbag2 in MCAP or SQLite): joint states, commands, Unitree's low-level messages, by a map."""

from bumblebee.measured.importers.ros.importer import import_rosbag

__all__ = ["import_rosbag"]
