"""How well any policy follows clips in MuJoCo C: success, MPJPE and MPKPE, in the world and over the robot's own place.

The same rule for every policy, whatever ended its episodes in training: from the first frame to the last, without
noise; lost where a key body is farther from its reference than the family's threshold, or the robot has fallen.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import pandas as pd
import torch
from torch import Tensor

from bumblebee.baselines import env as _registered  # noqa: F401, the terms of the baselines
from bumblebee.baselines.library import MovingLibrary
from bumblebee.learning.policy import Policy
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.tracking.config import ObservationConfig, Randomisation
from bumblebee.tracking.groups import Group
from bumblebee.tracking.library import ReferenceFrame, over_robot
from bumblebee.tracking.observations import action_middle, action_scale, joint_targets
from bumblebee.tracking.randomisation import randomise_worlds
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.starts import start_state
from bumblebee.tracking.terminations import fallen, success_threshold

ROBOTS_SEED = 11
"""Of robots that differ, the same for all policies."""
UPRIGHT_HEIGHT, UPRIGHT_TILT = 0.25, 0.8
"""The rule of BeyondMimic and what follows it: lost where the pelvis is so many metres too high or low, or gravity's
part along the base's z is off by so much."""


@dataclass(frozen=True)
class Manner:
    """How a policy is run: what it is shown, and the factor [rad] on its actions, one for all or our own by joint."""

    seen: ObservationConfig
    scale: float | None = None


@torch.inference_mode()
def follow(
    policy: Policy,
    manner: Manner,
    clips: Sequence[Clip],
    model: mujoco.MjModel,
    threads: int = 1,
    robots: Randomisation | None = None,
) -> pd.DataFrame:
    """Roll out each clip once.

    Args:
        policy: what acts.
        manner: how it is run.
        clips: N motions.
        model: the robot, with room for the delays of `robots`.
        threads: of the physics.
        robots: how much each clip's robot differs from `model`, drawn with a fixed seed, without pushes; None: not.

    Returns:
        a row a clip: name, family, split, seconds; success and lost_at [s]; success_local, by distances after the
        reference's root was moved over the robot's, which forgives drift; success_upright, by `upright`; mpjpe_rad,
        mpkpe_mm and mpkpe_local_mm over the frames before the loss.
    """
    n = len(clips)
    library = MovingLibrary(clips, policy.shape.ahead)
    engine = _started(library, model, threads, robots)
    ids, dt = torch.arange(n), engine.control_dt
    scale = action_scale() if manner.scale is None else torch.full((library.num_joints,), manner.scale)
    middle = action_middle(policy.shape.action)
    group = Group(manner.seen, (n, library.num_joints, len(library.ahead)), 0.0, engine.device)
    generator = torch.Generator().manual_seed(0)
    judge, act, action = Judge(clips, dt), policy.follower(), torch.zeros(n, library.num_joints)
    for frame in range(int(library.length.max()) - 1):
        ref = library.frames(ids, torch.full((n,), (frame + 1) * dt))
        group.look(engine.state(), ref, action, Rows(torch.full((n,), frame == 0), by_mask=False), generator)
        action = act(group.exact)
        engine.step(joint_targets(ref, action, scale, middle))
        if not bool(judge.see(engine.state(), ref, frame + 1 < library.length, engine.unstable()).any()):
            break
    return judge.table()


class Judge:
    """Keeps who has lost its clip, by each rule, and the errors before that.

    Args:
        clips: N of them.
        dt: of a control step [s].
    """

    def __init__(self, clips: Sequence[Clip], dt: float) -> None:
        n = len(clips)
        self._clips, self._dt = clips, dt
        self._limit = torch.tensor([success_threshold(clip) for clip in clips])
        self._kept = torch.ones(3, n, dtype=torch.bool)  # in the world, over the robot's own place, by `upright`
        self._sums = torch.zeros(4, n)  # frames before the loss, and the three errors over them

    def see(self, state: RobotState, ref: ReferenceFrame, running: Tensor, unstable: Tensor) -> Tensor:
        """Take in a control step of all robots; which of those whose clip is not over are kept by any rule, (N,) bool.

        Args:
            state: the true one after the step.
            ref: what it should be.
            running: (N,) bool, whose clip is not over.
            unstable: (N,) bool, whose state stopped being a number.
        """
        world, local = key_errors(state, ref)
        down, limit = fallen(state, ref) | unstable, self._limit
        kept = torch.stack(
            ((world.amax(-1) <= limit) & ~down, (local.amax(-1) <= limit) & ~down, upright(state, ref) & ~unstable)
        )
        self._kept &= kept | ~running
        joints = (state.joint_pos - ref.joint_pos).abs().mean(-1)
        counted = (self._kept[0] & running).float()
        errors = torch.stack((torch.ones(len(counted)), joints, world.mean(-1), local.mean(-1)))
        self._sums += counted * torch.nan_to_num(errors)
        return self._kept.any(0) & running

    def table(self) -> pd.DataFrame:
        """The rows of `follow`."""
        return _table(self._clips, self._kept, self._sums, self._dt)


def _started(library: MovingLibrary, model: mujoco.MjModel, threads: int, robots: Randomisation | None) -> Engine:
    """A robot at the start of each clip."""
    n = len(library)
    engine = make_engine("mujoco", model, n, min(threads, n))
    if robots is not None:
        randomise_worlds(engine, robots, ROBOTS_SEED)
    first = library.frames(torch.arange(n), torch.zeros(n))
    engine.reset(torch.arange(n), *start_state(first, 0.0, torch.Generator()), first.hold_pos)
    engine.settle()
    return engine


def upright(state: RobotState, ref: ReferenceFrame) -> Tensor:
    """Robots (B,) bool whose pelvis is about as high and as tilted as the reference's."""
    high = (state.root_pos_w[:, 2] - ref.root_pos_w[:, 2]).abs() <= UPRIGHT_HEIGHT
    down = torch.tensor([0.0, 0.0, -1.0]).expand(len(high), 3)
    tilt = rotate_inverse(state.root_quat_w, down)[:, 2] - rotate_inverse(ref.root_quat_w, down)[:, 2]
    return high & (tilt.abs() <= UPRIGHT_TILT)


def _table(clips: Sequence[Clip], kept: Tensor, sums: Tensor, dt: float) -> pd.DataFrame:
    """The rows of `follow`.

    Args:
        clips: N of them.
        kept: (3, N) bool, which were never lost in the world, over the robot's own place, and by `upright`.
        sums: (4, N) frames and errors before the loss.
        dt: of a frame [s].
    """
    alive, alive_local, stands = kept
    frames = sums[0].clamp(min=1)
    about = [(clip.name, clip.family, clip.split, clip.duration) for clip in clips]
    table = pd.DataFrame(about, columns=["name", "family", "split", "seconds"])
    table["success"], table["success_local"] = alive.numpy(), alive_local.numpy()
    table["success_upright"] = stands.numpy()
    table["lost_at"] = torch.where(alive, torch.nan, sums[0] * dt).numpy()
    table["mpjpe_rad"] = (sums[1] / frames).numpy()
    table["mpkpe_mm"] = (1000 * sums[2] / frames).numpy()
    table["mpkpe_local_mm"] = (1000 * sums[3] / frames).numpy()
    return table


def key_errors(state: RobotState, ref: ReferenceFrame) -> tuple[Tensor, Tensor]:
    """Distances (B, K) [m] of the key bodies from the reference: in the world, and with its root over the robot's."""
    world = (state.key_pos_w - ref.key_pos_w).norm(dim=-1)
    return world, (state.key_pos_w - over_robot(ref, state.root_pos_w).key_pos_w).norm(dim=-1)
