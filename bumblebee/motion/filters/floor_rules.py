"""Rules about the floor: what lies in it, hangs over it, slides or lies on it."""

from functools import lru_cache

import numpy as np

from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.config import FilterConfig
from bumblebee.motion.filters.quality import sole_speed
from bumblebee.motion.filters.worst import Worst, longest_run
from bumblebee.motion.kinematics import lowest_heights
from bumblebee.motion.stance import robot_contacts
from bumblebee.robot.facts import FEET


def floor_penetration(clip: Clip, config: FilterConfig) -> Worst:
    """Depth of the robot's lowest point under the floor."""
    heights = _heights(clip)
    body = min(heights, key=lambda name: heights[name].min())
    frame = int(np.argmin(heights[body]))
    depth = max(0.0, -float(heights[body][frame]))
    return Worst(depth, config.penetration, "m", frame, f"{body} lies {depth:.3f} m under the floor")


def floating(clip: Clip, config: FilterConfig) -> Worst:
    """The smallest distance from the floor in the whole motion: one that never comes down is wrong in height."""
    low = np.min(list(_heights(clip).values()), axis=0)
    frame = int(np.argmin(low))
    height = max(0.0, float(low[frame]))
    return Worst(height, config.floating, "m", frame, f"never nearer to the floor than {height:.3f} m")


def airborne(clip: Clip, config: FilterConfig) -> Worst:
    """The longest time without any contact possible."""
    high = np.min(list(_heights(clip).values()), axis=0) > config.airborne_height
    start, length = longest_run(high)
    seconds = length / clip.fps
    said = f"{seconds:.2f} s more than {config.airborne_height} m above the floor"
    return Worst(seconds, config.airborne_seconds, "s", start, said)


def skate(clip: Clip, config: FilterConfig) -> Worst:
    """Mean speed of the soles over the floor, where they are on it (`stance.robot_contacts`)."""
    contacts = robot_contacts(clip)
    speed = np.where(contacts[1:] & contacts[:-1], sole_speed(clip), np.nan)
    if not np.isfinite(speed).any():
        return Worst(0.0, config.skate, "m/s", 0, "no sole is on the floor")
    mean = float(np.nanmean(speed))
    frame = int(np.nanargmax(np.nanmax(np.nan_to_num(speed, nan=-1.0), axis=1)))
    return Worst(mean, config.skate, "m/s", frame, f"soles on the floor slide at {mean:.2f} m/s, here the fastest")


def other_contact(clip: Clip, config: FilterConfig) -> Worst:
    """The longest time that a body which is no foot is on the floor."""
    on_floor = {
        body: longest_run(height < config.other_contact_height)
        for body, height in _heights(clip).items()
        if body not in FEET
    }
    body = max(on_floor, key=lambda name: on_floor[name][1])
    start, length = on_floor[body]
    seconds = length / clip.fps
    return Worst(seconds, config.other_contact_seconds, "s", start, f"{body} is on the floor for {seconds:.2f} s")


@lru_cache(maxsize=1)
def _heights(clip: Clip) -> dict[str, np.ndarray]:
    """Height of each body's lowest point, (T,) [m]; four rules ask for it in turn."""
    return lowest_heights(clip.root_pos, clip.root_quat, clip.joint_pos)
