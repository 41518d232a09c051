"""Settings of the tracking task, a section of params.yaml each."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from bumblebee.ranges import Factor, Few, Name, PartOf, Range, Ranged, Seconds, Seed, Share, Size, Unfit
from bumblebee.sim.engine_choice import Name as EngineName
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.observing.terms import SETS, TERMS
from bumblebee.tracking.rewards import RewardConfig
from bumblebee.tracking.sampling.library import AHEAD


@dataclass(frozen=True)
class Randomisation(Ranged):
    """How much the worlds differ from the declared model (paper, table of domain randomisation); zeros: not at all."""

    friction: tuple[Annotated[float, Range(above=0, most=10)], Annotated[float, Range(above=0, most=10)]] = (0.6, 1.25)
    """Range of the factor on ground friction."""
    gains: PartOf = 0.1
    """Largest relative change of each servo's P and D gain."""
    strength: PartOf = 0.0
    """Largest relative loss of torque limit and gain of a motor."""
    mass: PartOf = 0.05
    """Largest relative change of each link's mass."""
    frictionloss: Annotated[float, Range(least=0, most=1000)] = 0.0
    """Largest dry friction added to a joint [N m]; not zero costs about 15 % of the speed."""
    push: Annotated[float, Range(least=0, most=100)] = 0.3
    """Largest change of the root's horizontal velocity by a push [m/s]."""
    push_interval: Seconds = 5.0
    """Mean time between pushes [s]."""
    push_regular: bool = False
    """Push each world exactly every `push_interval` with exactly `push`, its heading drawn, instead of by chance."""
    base_com: Annotated[float, Range(least=0, most=1)] = 0.0
    """Largest shift of the torso's centre of mass along each of its axes [m]."""
    delay: tuple[Annotated[float, Range(least=0, most=1)], Annotated[float, Range(least=0, most=1)]] = (0.0, 0.0)
    """Range of the delay [s] of all of a world's commands, on top of the model's own; the model needs room for it
    (`tracking.model.task_model`)."""

    def __post_init__(self) -> None:
        """Refuse ranges that run backwards."""
        super().__post_init__()
        self.require_order("friction")
        self.require_order("delay")


@dataclass(frozen=True)
class SensorConfig(Ranged):
    """Largest errors of a robot's sensors, drawn for each episode and the same through it; zeros: none.

    Odometry drifts within an episode.
    """

    encoder_offset: Annotated[float, Range(least=0, most=0.5)] = 0.0
    """Zero of each joint's encoder [rad]."""
    imu_offset: Annotated[float, Range(least=0, most=0.5)] = 0.0
    """Turn of the IMU in the base, about each axis [rad]: orientation and gyro are turned."""
    gyro_bias: Annotated[float, Range(least=0, most=1)] = 0.0
    """Bias of the gyro about each axis [rad/s]."""
    odometry_scale: Annotated[float, Range(least=0, most=0.5)] = 0.0
    """Standard deviation of the error of scale of the base's place by odometry; the stand-in robot's is 0.01."""
    odometry_heading: Annotated[float, Range(least=0, most=0.5)] = 0.0
    """Deviation after a second of the heading that odometry sums the way up with [rad], growing with the root of time;
    the stand-in robot's is 0.005."""

    @property
    def drifts(self) -> bool:
        """Whether the base's place by odometry drifts from where an episode begins."""
        return bool(self.odometry_scale or self.odometry_heading)

    @property
    def any(self) -> bool:
        """Whether there is any error."""
        return bool(self.encoder_offset or self.imu_offset or self.gyro_bias or self.drifts)


@dataclass(frozen=True)
class Terrain(Ranged):
    """The ground that policies learn on (paper, table of domain randomisation: flat, rough)."""

    rough: Share = 0.0
    """Share of the episodes on rough ground; with 0 the floor is a plane."""
    amplitude: Annotated[float, Range(above=0, most=1)] = 0.025
    """Largest height of rough ground above or below the flat one [m]."""
    cell: Annotated[float, Range(least=0.01, most=10)] = 0.2
    """Distance of the knots, between which the ground is straight [m]."""
    half_side: Annotated[float, Range(least=2, most=1000)] = 20.0
    """Half the side of the terrain [m]; an episode that comes within 1 m of the edge ends, which is no failure."""
    seed: Seed = 0
    """Seed of the heights."""

    def __post_init__(self) -> None:
        """Refuse ground of too few knots to stand on, or too many to hold."""
        super().__post_init__()
        knots = self.half_side / self.cell
        self.require(4 <= knots <= 2000, "cell", "4 to 2,000 cells in `half_side`")


@dataclass(frozen=True)
class ObservationConfig(Ranged):
    """Observation of a network: of `tracking.observing.terms.TERMS`, or names of sets of them, over some steps."""

    terms: tuple[Name, ...] = ("demo",)
    """Names of terms in order; `teacher` and `student` stand for sets of them. Without any: no such group."""
    history: Annotated[int, Range(least=1, most=1000)] = 1
    """Control steps that are seen, the oldest first; what was before an episode's start is its first step."""
    now: tuple[Name, ...] = ()
    """Terms of which the newest step alone is seen, after all others."""
    noise: Factor = 1.0
    """Factor on the sensor noise, beside `env.observation_noise`."""


@dataclass(frozen=True)
class EnvConfig(Ranged):
    """The environment that policies learn in."""

    engine: EngineName = "mujoco"
    """`mujoco` on CPU threads, or `mujoco_warp` on an NVIDIA GPU (the extra `gpu`), which wants thousands of worlds."""
    buffers: Buffers = field(default_factory=Buffers)
    """Room for contacts on a GPU."""
    compile: bool = False
    """Whether torch compiles observations and rewards, 10 s once: a GPU then steps about 7 % faster; it needs a C
    compiler on the machine."""
    num_worlds: Annotated[int, Range(least=1, most=1000000)] = 512
    """Copies of the robot."""
    threads: Few = 2
    """CPU threads of the physics."""
    physics_hz: Annotated[float, Range(least=50, most=10000)] = 100.0
    """Rate of the physics; the policy acts at 50 Hz. At 100 Hz a training is a quarter faster than at 200 Hz, and its
    policies hold at 200 Hz and at 1 kHz."""
    episode_seconds: Annotated[float, Range(least=0.02, most=3600)] = 10.0
    """Longest episode [s]; its end is no failure."""
    start_share: Share = 0.2
    """Share of the episodes that start at the clip's first frame; the others start anywhere."""
    ahead: Annotated[tuple[Annotated[float, Range(above=0, most=10)], ...], Size(0, 100)] = AHEAD
    """Look-ahead times of the observation [s]."""
    reset_noise: Factor = 1.0
    """Factor on the noise of the initial state: 0.03 rad, 0.3 rad/s, 0.1 m/s, 0.02 m in the plane."""
    observation_noise: Factor = 1.0
    """Factor on the sensor noise of the policy's observation."""
    threshold_start: Annotated[float, Range(above=0, most=100)] = 0.8
    """Distance of a key body from the reference that ends an episode, at first [m]."""
    threshold_end: Annotated[float, Range(above=0, most=100)] = 0.3
    """Threshold at the end of the curriculum [m]."""
    threshold_share: Share = 0.5
    """Share of the training over which the threshold shrinks."""
    sampler_floor: Annotated[float, Range(above=0, most=1000)] = 0.3
    """A clip is drawn by its length times (this + its failure rate): no clip is ever forgotten."""
    sampler_memory: Share = 0.9
    """How much of a clip's failure rate one more episode leaves."""
    sampler_stretch: Annotated[float, Range(least=0, most=3600)] = 0.0
    """Length of the stretches of a clip whose own failure rates are followed [s]; 0: whole clips' rates."""
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    """Observation of the policy; the critic sees the same without noise, forces, torques and the time left."""
    critic: tuple[Name, ...] = ()
    """Terms that the critic sees beside that, exact: `demo` for a policy of `imu`, which sees less than the state."""
    student: ObservationConfig = field(default_factory=lambda: ObservationConfig(terms=()))
    """Observation of a student of the policy, as a group of its own; nothing where nobody is distilled."""
    action: Literal["reference", "default"] = "reference"
    """Command of an action of zero: the reference one step ahead with its gravity lead (ours), or the relaxed stand
    (the paper: actions are joint targets)."""
    place: Literal["world", "own"] = "world"
    """Where reward and ends of episodes compare robot and reference: in the world, or in the robot's own place, the
    reference moved in the plane until it stands over the robot; a policy that sees `demo_in_place` never knows of
    another."""
    reward: RewardConfig = field(default_factory=RewardConfig)
    """The reward."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    """Differences between the worlds."""
    sensors: SensorConfig = field(default_factory=SensorConfig)
    """Errors of the sensors that stay through an episode, in groups of observations that have noise."""
    terrain: Terrain = field(default_factory=Terrain)
    """The ground."""

    def __post_init__(self) -> None:
        """Refuse rates, curricula and terms that cannot be."""
        super().__post_init__()
        self.require(self.physics_hz % 50 == 0, "physics_hz", "a multiple of the policy's 50 Hz")
        expected = f"at most threshold_start, {self.threshold_start:g}"
        self.require(self.threshold_end <= self.threshold_start, "threshold_end", expected)
        groups = {"observation.terms": self.observation, "student.terms": self.student}
        named = {name: (*own.terms, *own.now) for name, own in groups.items()}
        for name, terms in (named | {"critic": self.critic}).items():
            for term in {*terms} - {*SETS, *TERMS}:
                raise Unfit(type(self), name, f"terms among {', '.join([*SETS, *TERMS][:8])} ...", term)
        self.require(bool(self.observation.terms or self.observation.now), "observation", "at least one term")
