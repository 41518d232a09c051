"""Settings of the tracking task, a section of params.yaml each."""

from dataclasses import dataclass, field
from typing import Literal

from bumblebee.sim.engines import Name
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.library import AHEAD


@dataclass(frozen=True)
class RewardConfig:
    """Which weights and kernels the reward has; docs/decisions/rewards.md says why there are two sets."""

    preset: Literal["demo", "paper"] = "demo"
    """`paper`: the table's weights and sharpness; `demo`: the same terms, tuned for minutes on a CPU."""
    weights: dict[str, float] = field(default_factory=dict)
    """Weights that replace the preset's, by term."""
    sharpness: dict[str, float] = field(default_factory=dict)
    """Factors in exp(-factor * error) that replace the preset's, by term."""
    soft_limit: float = 0.95
    """Share of a torque, position or velocity limit beyond which it counts as exceeded."""


@dataclass(frozen=True)
class Randomisation:
    """How much the worlds differ from the declared model (paper, table of domain randomisation); zeros: not at all."""

    friction: tuple[float, float] = (0.6, 1.25)
    """Range of the factor on ground friction."""
    gains: float = 0.1
    """Largest relative change of each servo's P and D gain."""
    strength: float = 0.0
    """Largest relative loss of torque limit and gain of a motor."""
    mass: float = 0.05
    """Largest relative change of each link's mass."""
    frictionloss: float = 0.0
    """Largest dry friction added to a joint [N m]; not zero costs about 15 % of the speed."""
    push: float = 0.3
    """Largest change of the root's horizontal velocity by a push [m/s]."""
    push_interval: float = 5.0
    """Mean time between pushes [s]."""
    push_regular: bool = False
    """Push each world exactly every `push_interval` with exactly `push`, its heading drawn, instead of by chance."""
    base_com: float = 0.0
    """Largest shift of the torso's centre of mass along each of its axes [m]."""
    delay: tuple[float, float] = (0.0, 0.0)
    """Range of the delay [s] of all of a world's commands, on top of the model's own; the model needs room for it
    (`tracking.model.task_model`)."""


@dataclass(frozen=True)
class Terrain:
    """The ground that policies learn on (paper, table of domain randomisation: flat, rough)."""

    rough: float = 0.0
    """Share of the episodes on rough ground; with 0 the floor is a plane."""
    amplitude: float = 0.025
    """Largest height of rough ground above or below the flat one [m]."""
    cell: float = 0.2
    """Distance of the knots, between which the ground is straight [m]."""
    size: float = 20.0
    """Half the side of the terrain [m]; an episode that comes within 1 m of the edge ends, which is no failure."""
    seed: int = 0
    """Of the heights."""


@dataclass(frozen=True)
class ObservationConfig:
    """What a network sees: terms of `tracking.terms.TERMS`, or names of sets of them, over some control steps."""

    terms: tuple[str, ...] = ("demo",)
    """Names of terms in order; `teacher` and `student` stand for sets of them. Without any: no such group."""
    history: int = 1
    """Control steps that are seen, the oldest first; what was before an episode's start is its first step."""
    now: tuple[str, ...] = ()
    """Terms of which the newest step alone is seen, after all others."""
    noise: float = 1.0
    """Factor on the sensor noise, beside `env.observation_noise`."""


@dataclass(frozen=True)
class EnvConfig:
    """The environment that policies learn in."""

    engine: Name = "mujoco"
    """`mujoco` on CPU threads, or `mujoco_warp` on an NVIDIA GPU (the extra `gpu`), which wants thousands of worlds."""
    buffers: Buffers = field(default_factory=Buffers)
    """Room for contacts on a GPU."""
    compile: bool = False
    """Whether torch compiles observations and rewards, 10 s once: a GPU then steps about 7 % faster; it needs a C
    compiler on the machine."""
    num_worlds: int = 512
    """Copies of the robot."""
    threads: int = 2
    """CPU threads of the physics."""
    physics_hz: float = 100.0
    """Rate of the physics; the policy acts at 50 Hz. At 100 Hz a training is a quarter faster than at 200 Hz, and its
    policies hold at 200 Hz and at 1 kHz."""
    episode_seconds: float = 10.0
    """Longest episode [s]; its end is no failure."""
    start_share: float = 0.2
    """Share of the episodes that start at the clip's first frame; the others start anywhere."""
    ahead: tuple[float, ...] = AHEAD
    """Look-ahead times of the observation [s]."""
    reset_noise: float = 1.0
    """Factor on the noise of the initial state: 0.03 rad, 0.3 rad/s, 0.1 m/s, 0.02 m in the plane."""
    observation_noise: float = 1.0
    """Factor on the sensor noise of the policy's observation."""
    threshold_start: float = 0.8
    """Distance of a key body from the reference that ends an episode, at first [m]."""
    threshold_end: float = 0.3
    """The same at the end of the curriculum [m]."""
    threshold_share: float = 0.5
    """Share of the training over which the threshold shrinks."""
    sampler_floor: float = 0.3
    """A clip is drawn by its length times (this + its failure rate): no clip is ever forgotten."""
    sampler_memory: float = 0.9
    """How much of a clip's failure rate one more episode leaves."""
    sampler_stretch: float = 0.0
    """Length of the stretches of a clip whose own failure rates are followed [s]; 0: whole clips' rates."""
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    """What the policy sees; the critic sees the same without noise, forces, torques and the time left."""
    student: ObservationConfig = field(default_factory=lambda: ObservationConfig(terms=()))
    """What a student of the policy sees, as a group of its own; nothing where nobody is distilled."""
    action: Literal["reference", "default"] = "reference"
    """What an action of zero commands: the reference one step ahead with its gravity lead (ours), or the relaxed stand
    (the paper: actions are joint targets)."""
    reward: RewardConfig = field(default_factory=RewardConfig)
    """The reward."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    """Differences between the worlds."""
    terrain: Terrain = field(default_factory=Terrain)
    """The ground."""
