"""Section `rollouts` of params.yaml, in a file of its own: other stages ask it whose robot is measured."""

from dataclasses import dataclass
from typing import Annotated, Literal

from bumblebee.ranges import Count, Few, Place, Range, Ranged, Seed


@dataclass(frozen=True)
class RolloutsConfig(Ranged):
    """Settings of what is run on the robot in a round."""

    motions: Count = 6
    """Motions of the cluster (paper: 20)."""
    repeats: Few = 2
    """Rollouts of each motion (paper: 8)."""
    seed: Seed = 11
    """Seed of the choice of motions, the start states and the sensor noise."""
    source: Place | None = None
    """Folder of the user's own measured rollouts; nothing: the stand-in robot runs. New files in data/incoming are seen
    by themselves; with another folder, run `dvc repro -f` for this stage."""
    threads: Few = 2
    """CPU threads of the stand-in."""
    base: Literal["mocap", "odometry", "none"] = "mocap"
    """Source of the base's place for the stand-in: motion capture of 1 mm; odometry that drifts, as on a robot in the
    field; none: the policy gets the odometry and the log no base_pos."""
    wire: Literal["none", "lcm"] = "none"
    """lcm: the stand-in runs behind the guard of `bumblebee deploy run`, with LCM's bytes and in the time of its
    messages, and the rollouts are made of the guard's journal. It knows IMU and odometry then, whatever `base` says,
    and the log has no base_pos; one core works."""
    max_seconds: Annotated[float, Range(least=0.1, most=3600)] = 10.0
    """Longer clips are cut to their beginning [s]."""
    stop_tilt: Annotated[float, Range(above=0, most=180)] = 25.0
    """The operator stops the stand-in where its pelvis leans so far away from its reference [degrees]: what comes after
    is a fall, of which the drives' logs say nothing that a model could be fitted to."""
    stop_drop: Annotated[float, Range(above=0, most=2)] = 0.2
    """Height below the reference at which a robot is stopped [m]."""
