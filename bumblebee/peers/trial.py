"""How well a peer's policy follows motions in MuJoCo C, and one of ours on the same motions, by the same rules."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import pandas as pd
import torch

from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.rollout import Manner, Tick, roll_out
from bumblebee.motion.clip import Clip
from bumblebee.peers import CHOICES
from bumblebee.peers.judge import FourRules
from bumblebee.peers.policy import Peer
from bumblebee.peers.rollout import roll_out_peer
from bumblebee.peers.world import PHYSICS_HZ, Whose, peer_model
from bumblebee.sim.engine import Engine
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.sampling.library import MotionLibrary

CONTROL_HZ = 50.0
_WORLDS = 128  # at once
Ticks = Callable[[Sequence[Clip], Engine], Iterator[Tick]]


@dataclass(frozen=True)
class Setting:
    """Whose model and whose gains a peer is tried with."""

    model: Whose = "own"
    gains: Whose = "own"

    def __str__(self) -> str:
        return f"{self.model} model, {self.gains} gains"


def setting_of(model: str | None, gains: str | None) -> Setting:
    """A setting of a command line's options; None is "own".

    Raises:
        BadInput: another word.
    """
    for option, value in (("--model", model), ("--gains", gains)):
        if value is not None and value not in CHOICES:
            raise BadInput(option, " or ".join(CHOICES), repr(value)[:60])
    return Setting(model or "own", gains or "own")  # type: ignore[arg-type]


def ours(folder: str) -> Policy:
    """One of our policies to try on the same motions: a folder with policy.pt, or a name of one that comes along."""
    return load_policy(pretrained.SHIPPED.get(folder) or Path(folder).expanduser())


@torch.inference_mode()
def try_peer(peer: Peer, clips: Sequence[Clip], setting: Setting, threads: int = 2) -> pd.DataFrame:
    """Roll out each clip once, without noise.

    Args:
        peer: the policy.
        clips: the motions, 50 Hz.
        setting: whose model and gains.
        threads: CPU threads of the physics.

    Returns:
        A row a clip with the columns of `baselines.trial.follow`, and success_heading: the reference is moved over the
            robot and turned to its heading.
    """

    def ticks(some: Sequence[Clip], engine: Engine) -> Iterator[Tick]:
        return roll_out_peer(peer, MotionLibrary(some, (), feed_forward=False), engine)

    model = peer_model(peer.contract, setting.model, setting.gains)
    return _tried(ticks, clips, model, peer.contract.control_hz, threads)


@torch.inference_mode()
def try_ours(policy: Policy, clips: Sequence[Clip], threads: int = 2) -> pd.DataFrame:
    """Roll out each clip once with one of our policies on the declared model, in the columns of `try_peer`."""

    def ticks(some: Sequence[Clip], engine: Engine) -> Iterator[Tick]:
        return roll_out(policy, Manner(policy.shape.seen), MotionLibrary(some, policy.shape.ahead), engine)

    return _tried(ticks, clips, load_model(physics_hz=PHYSICS_HZ), CONTROL_HZ, threads)


def _tried(ticks: Ticks, clips: Sequence[Clip], model: mujoco.MjModel, hz: float, threads: int) -> pd.DataFrame:
    tables = []
    for first in range(0, len(clips), _WORLDS):
        some = clips[first : first + _WORLDS]
        engine, judge = MujocoCpu(model, len(some), hz, min(threads, len(some))), FourRules(some)
        for tick in ticks(some, engine):
            if not bool(judge.see(tick).any()):
                break
        tables.append(judge.table(engine.control_dt))
    return pd.concat(tables, ignore_index=True)
