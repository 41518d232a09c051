"""Rollouts of a G1 that sways its arms, or its ankles, while it stands and slowly falls."""

from collections.abc import Sequence

import mujoco
import numpy as np
import torch

from bumblebee.measured.rollout import Rollout
from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model

ARMS = tuple(range(15, 23))
ANKLES = tuple(joint_names().index(f"{side}_ankle_pitch_joint") for side in ("left", "right"))


def weakened(share: float, joints: Sequence[int]) -> mujoco.MjModel:
    """The declared model with that share of some motors' gains."""
    model = load_model()
    own = list(joints)
    model.actuator_gainprm[own, 0] *= share
    model.actuator_biasprm[own, 1:3] *= share
    return model


def record(
    worlds: int = 3,
    ticks: int = 70,
    model: mujoco.MjModel | None = None,
    moved: Sequence[int] = ARMS,
    seed: int = 0,
    sway: float = 0.15,
) -> list[Rollout]:
    """A rollout for each world, whose `moved` joints' targets sway by `sway` [rad], each at a phase of its own."""
    model = load_model() if model is None else model
    engine = MujocoCpu(model, worlds, threads=1)
    qpos = torch.as_tensor(model.key_qpos[:1], dtype=torch.float32).repeat(worlds, 1)
    pose = torch.as_tensor(stand_pose(), dtype=torch.float32).repeat(worlds, 1)
    engine.reset(torch.arange(worlds), qpos, torch.zeros(worlds, 29), pose)
    phase = torch.as_tensor(np.random.default_rng(seed).uniform(0, 6, (worlds, 1)), dtype=torch.float32)
    sways = torch.zeros(23)
    sways[list(moved)] = sway
    rows: list[list[torch.Tensor]] = []
    for k in range(ticks):
        target = pose + sways * torch.sin(0.1 * k + phase)
        state = engine.state()
        rows.append([state.root_pos_w, state.root_quat_w, state.root_lin_vel_b, state.root_ang_vel_b,
                     state.joint_pos, state.joint_vel, target])  # fmt: skip
        engine.step(target)
    columns = [torch.stack(c, dim=1).numpy() for c in zip(*rows, strict=True)]
    names = ("base_pos", "base_quat", "base_lin_vel", "base_ang_vel", "joint_pos", "joint_vel", "joint_target")
    time = np.arange(ticks) / 50
    return [
        Rollout(
            f"r{i}",
            joint_names(),
            50,
            time,
            meta={"motion": f"phase {i}"},
            **{n: c[i] for n, c in zip(names, columns, strict=True)},
        )
        for i in range(worlds)
    ]
