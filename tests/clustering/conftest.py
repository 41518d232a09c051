"""Made-up motions and captions: a robot that stands, walks or hops as a rigid figure with swinging feet."""

import numpy as np
import pytest
import torch

from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.text import TokenTable, token_table
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import joint_names, stand_pose

TEXTS = {"stand": "a person stands and waves", "walk": "a person walks forward"}


def made_clip(name: str, kind: str, seed: int = 0, seconds: float = 2.0, split: str = "train") -> Clip:
    """A stand that waves or a walk that swings its legs, with a random place, heading, size and phase."""
    draw = np.random.default_rng(seed)
    time = np.arange(round(seconds * 50)) / 50.0
    phase = 2 * np.pi * (1.2 * time + draw.uniform())
    joint_pos = np.tile(stand_pose(), (len(time), 1))
    if kind == "stand":
        joint_pos[:, joint_names().index("left_elbow_joint")] += draw.uniform(0.3, 0.5) * np.sin(phase)
        speed = 0.0
    else:
        for side, sign in (("left", 1.0), ("right", -1.0)):
            joint_pos[:, joint_names().index(f"{side}_hip_pitch_joint")] += sign * 0.4 * np.sin(phase)
        speed = draw.uniform(0.6, 0.9)
    yaw = draw.uniform(-np.pi, np.pi)
    root_pos = np.stack([np.cos(yaw) * speed * time, np.sin(yaw) * speed * time, np.full_like(time, 0.78)], 1)
    root_pos[:, :2] += draw.uniform(-2, 2, 2)
    quat = np.tile([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)], (len(time), 1))
    return make_clip(name, 50.0, root_pos, quat, joint_pos, captions=(TEXTS[kind],), family=kind, split=split,
                     caption_source="file")  # fmt: skip


@pytest.fixture(scope="session")
def library() -> list[Clip]:
    """Eight stands and eight walks of unequal length, one of each held out."""
    return [
        made_clip(
            f"{kind}_{i}",
            kind,
            seed=100 * (kind == "walk") + i,
            seconds=1.5 + 0.2 * i,
            split="test" if i == 7 else "train",
        )
        for kind in ("stand", "walk")
        for i in range(8)
    ]


@pytest.fixture(scope="session")
def table() -> TokenTable:
    """Random tokens in place of BERT's, for tests that are not about text."""
    draw = torch.Generator().manual_seed(0)
    texts = tuple(sorted(TEXTS.values()))
    return token_table(texts, [torch.randn(4, 8, generator=draw) for _ in texts])


@pytest.fixture(scope="session")
def tiny() -> ClusterConfig:
    """Sizes that train in about a second."""
    return ClusterConfig(
        hidden=16,
        layers=1,
        heads=2,
        latent=4,
        epochs=25,
        batch_size=8,
        max_k=6,
        audit_seeds=3,
        dropout=0.0,
        audit_retrain=1,
    )
