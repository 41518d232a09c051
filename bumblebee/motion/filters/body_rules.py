"""Rules about the body itself: joints, speeds, jumps from frame to frame, links that lie in each other."""

import numpy as np
from scipy import ndimage

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.config import FilterConfig
from bumblebee.motion.filters.self_collision import self_penetration
from bumblebee.motion.filters.worst import Worst, largest, longest_run, steps
from bumblebee.robot.facts import KEY_BODIES, joint_names, joints


def joint_limits(clip: Clip, config: FilterConfig) -> Worst:
    """The farthest that a joint goes beyond its range."""
    ranges = np.array([joint.range for joint in joints()])
    excess = np.maximum(ranges[:, 0] - clip.joint_pos, clip.joint_pos - ranges[:, 1])
    frame, joint = largest(excess)
    value, name = max(0.0, float(excess[frame, joint])), joint_names()[joint]
    said = f"{name} at {clip.joint_pos[frame, joint]:.3f} rad, range {ranges[joint, 0]:.3f} to {ranges[joint, 1]:.3f}"
    return Worst(value, config.joint_excess, "rad", frame, said)


def body_speed(clip: Clip, config: FilterConfig) -> Worst:
    """The fastest keypoint."""
    speed = np.linalg.norm(steps(clip.key_pos, clip.fps), axis=-1)
    frame, body = largest(speed)
    value = float(speed[frame, body])
    return Worst(value, config.body_speed, "m/s", frame, f"{KEY_BODIES[body]} moves at {value:.1f} m/s")


def joint_speed(clip: Clip, config: FilterConfig) -> Worst:
    """The fastest joint."""
    speed = np.abs(steps(clip.joint_pos, clip.fps))
    frame, joint = largest(speed)
    value = float(speed[frame, joint])
    return Worst(value, config.joint_speed, "rad/s", frame, f"{joint_names()[joint]} turns at {value:.1f} rad/s")


def root_jump(clip: Clip, config: FilterConfig) -> Worst:
    """The largest step of the pelvis between frames."""
    speed = np.linalg.norm(steps(clip.root_pos, clip.fps), axis=-1)
    frame = int(np.argmax(speed))
    value = float(speed[frame])
    said = f"the pelvis moves {value / clip.fps:.3f} m in one frame, {value:.1f} m/s"
    return Worst(value, config.root_speed, "m/s", frame, said)


def root_turn(clip: Clip, config: FilterConfig) -> Worst:
    """The largest turn of the pelvis between frames."""
    if clip.frames < 2:
        return Worst(0.0, config.root_turn, "rad/s", 0, "a single frame")
    quat = quaternions.normalised(clip.root_quat.astype(np.float64))
    turn = quaternions.rotation_vector(quaternions.multiply(quaternions.conjugate(quat[:-1]), quat[1:]))
    speed = np.linalg.norm(turn, axis=-1) * clip.fps
    frame = int(np.argmax(speed))
    value = float(speed[frame])
    said = f"the pelvis turns {value / clip.fps:.2f} rad in one frame, {value:.1f} rad/s"
    return Worst(value, config.root_turn, "rad/s", frame, said)


def root_dip(clip: Clip, config: FilterConfig) -> Worst:
    """The deepest that the pelvis sinks below where it is before and after within a second."""
    height = clip.root_pos[:, 2].astype(np.float64)
    depth = ndimage.grey_closing(height, min(round(clip.fps), clip.frames), mode="nearest") - height
    frame = int(np.argmax(depth))
    said = f"the pelvis sinks by {depth[frame]:.2f} m and rises again within a second"
    return Worst(float(depth[frame]), config.root_dip, "m", frame, said)


def spike(clip: Clip, config: FilterConfig) -> Worst:
    """The largest acceleration of a keypoint over three frames in a row."""
    if clip.frames < 3:
        return Worst(0.0, config.spike, "m/s^2", 0, "fewer than three frames")
    bend = np.linalg.norm(np.diff(clip.key_pos.astype(np.float64), 2, axis=0), axis=-1)
    frame, body = largest(bend)
    value = float(bend[frame, body]) * clip.fps**2
    said = f"{KEY_BODIES[body]} lies {bend[frame, body] / 2:.3f} m beside its neighbouring frames, {value:.0f} m/s^2"
    return Worst(value, config.spike, "m/s^2", frame + 1, said)


def self_collision(clip: Clip, config: FilterConfig) -> Worst:
    """The longest time that links lie deep in each other."""
    depth, bodies = self_penetration(clip.root_pos, clip.root_quat, clip.joint_pos)
    start, length = longest_run(depth > config.self_collision_depth)
    seconds = length / clip.fps
    deepest = start + int(np.argmax(depth[start : start + max(length, 1)]))
    pair = " and ".join(bodies[deepest])
    said = f"{pair} lie up to {depth[deepest]:.3f} m in each other for {seconds:.2f} s" if length else "never deep"
    return Worst(seconds, config.self_collision_seconds, "s", start, said)
