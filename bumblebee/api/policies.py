"""Load a policy, try it on motions, and let it follow one."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bumblebee.api import checks
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip

if TYPE_CHECKING:
    import pandas as pd
    import torch

    from bumblebee.learning.policy import Policy
    from bumblebee.policy.exported import ExportedPolicy

PHYSICS_HZ = 200.0


def load_policy(folder: str | Path = "shipped") -> "Policy | Deployed":
    """Load a policy of the G1.

    Args:
        folder: what `train` or `bumblebee fetch` wrote, or a policy that comes along: `"shipped"`,
            `"randomised"` (for robots with delays and other gains) or `"imu"` (likewise, and without odometry).

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
    from bumblebee.learning import policy as trained
    from bumblebee.learning import pretrained
    from bumblebee.policy.exported import ExportedPolicy

    place = pretrained.SHIPPED.get(str(folder)) or Path(folder).expanduser()
    if (place / "policy.onnx").exists() and not (place / trained.FILE).exists():
        return Deployed(ExportedPolicy.load(place))
    return trained.load_policy(place)


class Deployed:
    """An exported policy (`policy.onnx`), as a function of observations.

    `evaluate` and `follow` run it as a robot does, with its history and memory. Called as a function, a policy with a
    memory acts as at an episode's first step.

    Args:
        exported: the policy.
    """

    def __init__(self, exported: "ExportedPolicy") -> None:
        self.exported = exported

    def __call__(self, observation: "torch.Tensor") -> "torch.Tensor":
        """Mean actions (N, 23) of observations (N, D)."""
        import torch

        return torch.from_numpy(self.exported.act(observation.numpy()))


def evaluate(
    policy: "Policy | Deployed | str | Path",
    motions: "Clip | Sequence[Clip]",
    *,
    repeats: int = 1,
    noise: float = 0.0,
    seed: int = 0,
    threads: int = 2,
    out: str | Path | None = None,
) -> "pd.DataFrame":
    """Let a policy follow motions in MuJoCo at 200 Hz, each from its first frame to its last.

    Args:
        policy: the policy, or its folder.
        motions: one motion or several, at 50 Hz.
        repeats: rollouts of each motion.
        noise: factor on the noise of start and sensors; 0 is none, 1 that of training (of the stand-in robot for a
            folder with `policy.onnx` alone).
        seed: seed of that noise.
        threads: CPU threads of the physics.
        out: a new folder for this table with how each rollout ended (trials.csv) and its states, which
            `bumblebee view` shows; None writes nothing.

    Returns:
        A row a rollout: `name`, `family`, `split`, `success` (bool: every key body within the threshold to the end, no
            fall), `share` (part of the motion until it failed), `key_error` [m] and `joint_error` [rad] (means until
            then).

    Raises:
        BadInput: no such policy, no motions, a number out of its range, or a folder that exists.

    Examples:
        >>> import bumblebee as bb
        >>> table = bb.evaluate("shipped", bb.read_motions("embedded", families=("stand",), limit=2))
        >>> table["success"].tolist()
        [True, True]
    """
    from bumblebee.io.write import refuse_existing, try_output
    from bumblebee.learning.trial import Trials, World, try_policy
    from bumblebee.learning.trial_folder import Kept
    from bumblebee.policy.trial import try_exported
    from bumblebee.sim.sensors import load_model

    clips, own, kept = checks.motions(motions), _loaded(policy), Kept()
    if out is not None:
        if isinstance(own, Deployed):
            place, do = own.exported.folder, "Evaluate it without `out`."
            raise BadInput(place, "policy.pt, of whose rollouts the states are kept", "policy.onnx alone", do)
        refuse_existing(Path(out))
        try_output(Path(out))
    if isinstance(own, Deployed):
        return try_exported(own.exported, clips, repeats, noise, seed, threads)
    world, how = World(load_model(physics_hz=PHYSICS_HZ), threads=threads), Trials(repeats, noise, seed)
    table = try_policy(own, clips, world, own.shape.ahead, how, None if out is None else kept.add)
    if out is not None:
        kept.write(Path(out), table)
    return table


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

    from bumblebee.learning.rollout import Manner, roll_out
    from bumblebee.motion.kinematics import make_clip
    from bumblebee.policy.trial import follow_exported
    from bumblebee.sim.engine_choice import make_engine
    from bumblebee.sim.sensors import load_model
    from bumblebee.tracking.sampling.library import MotionLibrary

    clip, own = checks.motions(motion, "motion")[0], _loaded(policy)
    if isinstance(own, Deployed):
        return follow_exported(own.exported, clip)
    engine = make_engine("mujoco", load_model(physics_hz=PHYSICS_HZ), 1, 1)
    manner = Manner(own.shape.seen)
    library = MotionLibrary([clip], own.shape.ahead)
    rows = [(clip.root_pos[0], clip.root_quat[0], clip.joint_pos[0])]
    with torch.inference_mode():
        for tick in roll_out(own, manner, library, engine):
            state = tick.state
            rows.append((state.root_pos_w[0].numpy(), state.root_quat_w[0].numpy(), state.joint_pos[0].numpy()))
    root, quat, joints = (np.stack(part) for part in zip(*rows, strict=True))
    return make_clip(clip.name, clip.fps, root, quat, joints, family=clip.family)


def _loaded(policy: "Policy | Deployed | str | Path") -> "Policy | Deployed":
    return load_policy(policy) if isinstance(policy, str | Path) else policy
