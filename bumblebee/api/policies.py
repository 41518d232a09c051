"""Load a policy, try it on motions, and let it follow one."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bumblebee.api import checks
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip

if TYPE_CHECKING:
    import pandas as pd
    import torch

    from bumblebee.deploy.policy import ExportedPolicy
    from bumblebee.learning.policy import Policy

SHIPPED = "shipped"
PHYSICS_HZ = 200.0


def load_policy(folder: str | Path = SHIPPED) -> "Policy | Deployed":
    """Load a policy of the G1.

    Args:
        folder: what `train` or `bumblebee fetch` wrote, or `"shipped"` for the policy that comes along.

    Returns:
        A function of observations (N, D) that gives mean actions (N, 23), one control step of 0.02 s each.

    Raises:
        BadInput: no policy there, or one for another robot or another version.

    Examples:
        >>> import bumblebee as bb, torch
        >>> policy = bb.load_policy("shipped")
        >>> policy(torch.zeros(1, 283)).shape
        torch.Size([1, 23])
    """
    from bumblebee.deploy.policy import ExportedPolicy
    from bumblebee.learning import policy as trained
    from bumblebee.learning import pretrained

    place = pretrained.FOLDER if str(folder) == SHIPPED else Path(folder).expanduser()
    if (place / "policy.onnx").exists() and not (place / trained.FILE).exists():
        return Deployed(ExportedPolicy.load(place))
    return trained.load_policy(place)


class Deployed:
    """An exported policy (`policy.onnx`), as a function of observations.

    Args:
        exported: the policy; one that sees one control step and remembers nothing.

    Raises:
        BadInput: a policy with a history or a memory, which the runner of `bumblebee.deploy` feeds.
    """

    def __init__(self, exported: "ExportedPolicy") -> None:
        from bumblebee.tracking.config import ObservationConfig

        plain = exported.seen == ObservationConfig() and exported.memory is None
        if not plain or exported.contract["action"]["base"] != "reference":
            raise BadInput(
                exported.folder, "a policy with the default observation", f"{exported.seen}", "Give its policy.pt."
            )
        self.exported = exported

    def __call__(self, observation: "torch.Tensor") -> "torch.Tensor":
        """Mean actions (N, 23) of observations (N, D)."""
        import torch

        return torch.from_numpy(self.exported.act(observation.numpy()))


def ahead_of(policy: "Policy | Deployed") -> tuple[float, ...]:
    """Look-ahead times [s] of the reference that a policy sees."""
    if isinstance(policy, Deployed):
        return tuple(policy.exported.contract.get("ahead", ()))
    return policy.shape.ahead


def evaluate(
    policy: "Policy | Deployed | str | Path",
    motions: "Clip | Sequence[Clip]",
    *,
    repeats: int = 1,
    noise: float = 0.0,
    seed: int = 0,
    threads: int = 2,
) -> "pd.DataFrame":
    """Let a policy follow motions in MuJoCo at 200 Hz, each from its first frame to its last.

    Args:
        policy: the policy, or its folder.
        motions: one motion or several, at 50 Hz.
        repeats: rollouts of each motion.
        noise: factor on the noise of start and sensors; 0 is none, 1 that of training.
        seed: seed of that noise.
        threads: CPU threads of the physics.

    Returns:
        A row a rollout: `name`, `family`, `split`, `success` (bool: every key body within the threshold to the end, no
            fall), `share` (part of the motion until it failed), `key_error` [m] and `joint_error` [rad] (means until
            then).

    Raises:
        BadInput: no such policy, no motions, or a number out of its range.

    Examples:
        >>> import bumblebee as bb
        >>> table = bb.evaluate("shipped", bb.read_motions("embedded", families=("stand",), limit=2))
        >>> table["success"].tolist()
        [True, True]
    """
    from bumblebee.learning.trial import Trials, World, try_policy
    from bumblebee.sim.sensors import load_model

    clips, own = checks.motions(motions), _loaded(policy)
    world = World(load_model(physics_hz=PHYSICS_HZ), threads=threads)
    return try_policy(cast(Callable[..., Any], own), clips, world, ahead_of(own), Trials(repeats, noise, seed))


def follow(policy: "Policy | Deployed | str | Path", motion: Clip) -> Clip:
    """Simulate a policy that follows one motion; the result is what the robot did.

    Args:
        policy: the policy, or its folder.
        motion: the reference, at 50 Hz.

    Returns:
        The robot's motion, as long as the reference; compare `joint_pos` and `key_pos` with those of `motion`.

    Raises:
        BadInput: no such policy, or something that is no motion.

    Examples:
        >>> import bumblebee as bb
        >>> motion = bb.read_motions("embedded", families=("stand",), limit=1)[0]
        >>> done = bb.follow("shipped", motion)
        >>> bool(abs(done.joint_pos - motion.joint_pos).mean() < 0.1)
        True
    """
    import torch

    from bumblebee.learning.policy import Policy
    from bumblebee.learning.rollout import Manner, roll_out
    from bumblebee.motion.kinematics import make_clip
    from bumblebee.sim.engine_choice import make_engine
    from bumblebee.sim.sensors import load_model
    from bumblebee.tracking.config import ObservationConfig
    from bumblebee.tracking.library import MotionLibrary

    clip, own = checks.motions(motion, "motion")[0], _loaded(policy)
    engine = make_engine("mujoco", load_model(physics_hz=PHYSICS_HZ), 1, 1)
    manner = Manner(own.shape.seen if isinstance(own, Policy) else ObservationConfig())
    library = MotionLibrary([clip], ahead_of(own))
    rows = [(clip.root_pos[0], clip.root_quat[0], clip.joint_pos[0])]
    with torch.inference_mode():
        for tick in roll_out(cast(Callable[..., Any], own), manner, library, engine):
            state = tick.state
            rows.append((state.root_pos_w[0].numpy(), state.root_quat_w[0].numpy(), state.joint_pos[0].numpy()))
    root, quat, joints = (np.stack(part) for part in zip(*rows, strict=True))
    return make_clip(clip.name, clip.fps, root, quat, joints, family=clip.family)


def _loaded(policy: "Policy | Deployed | str | Path") -> "Policy | Deployed":
    return load_policy(policy) if isinstance(policy, str | Path) else policy
