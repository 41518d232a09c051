"""A world model that learned in one simulator goes on in another, and a policy goes on through it and its residual."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from bumblebee.errors import BadInput
from bumblebee.files import save_tensors
from bumblebee.learning.checkpoint import load_checkpoint
from bumblebee.learning.policy import load_policy
from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.context import context_in, past_in
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.memory import Memory
from bumblebee.learning.world_model.model_update import ModelUpdate
from bumblebee.learning.world_model.policy_update import PolicyUpdate
from bumblebee.learning.world_model.residual import corrected
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.robot.facts import joint_names
from bumblebee.tracking.env import TrackingEnv

FILE = "model.pt"


@dataclass(frozen=True)
class Frame:
    """Facts that fix a world model."""

    joints: tuple[str, ...]
    """Names in column order."""
    hidden: tuple[int, ...]
    dt: float
    """Control period [s]."""
    context: int
    """Numbers in which the worlds of its simulator differed."""
    past: int
    """Earlier targets that it is shown."""


@dataclass(frozen=True)
class Parent:
    """A trained world model."""

    frame: Frame
    model: Dynamics

    def save(self, folder: Path) -> None:
        """Write `model.pt` into an existing folder."""
        save_tensors(Path(folder) / FILE, {"frame": asdict(self.frame), "model": self.model.state_dict()})

    @classmethod
    def load(cls, folder: Path) -> "Parent":
        """Read `model.pt`; only tensors and plain values are unpickled.

        Raises:
            BadInput: if there is none, or it is no world model.
        """
        file = Path(folder) / FILE
        if not file.exists():
            raise BadInput(file, "a trained world model", "no such file")
        try:
            saved = load_checkpoint(file)
            known: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in saved["frame"].items()}
            made = new_model(Frame(**known))
            made.load_state_dict(saved["model"])
        except (KeyError, TypeError, AttributeError, RuntimeError, ValueError) as error:
            raise BadInput(file, "a world model", f"{type(error).__name__}: {error}"[:120]) from None
        return cls(Frame(**known), made)


def new_model(frame: Frame) -> Dynamics:
    """An untrained world model."""
    return Dynamics(len(frame.joints), frame.hidden, frame.dt, frame.context, frame.past)


def frame_of(env: TrackingEnv, hidden: tuple[int, ...]) -> Frame:
    """Facts of a world model of `env`."""
    return Frame(joint_names(), tuple(hidden), env.dt, context_in(env).shape[1], past_in(env))


def fitting(parent: Parent, frame: Frame, where: object) -> Dynamics:
    """A copy of the parent's model for a simulator that needs a `frame`; earlier targets that it lacks have no weight.

    Raises:
        BadInput: for a model of another robot, control period, context or width, or of later commands.
    """
    own = parent.frame
    for name in ("joints", "hidden", "dt", "context"):
        if getattr(own, name) != getattr(frame, name):
            wanted, came = (f"{name} {str(getattr(each, name))[:80]}" for each in (frame, own))
            raise BadInput(where, f"a world model of {wanted}", came, "Train one in this task's declared simulator.")
    if own.past > frame.past:
        came = f"one of {own.past}"
        raise BadInput(where, f"a world model of at most {frame.past} earlier targets", came, "Train one here.")
    model, saved, joints = new_model(frame), parent.model.state_dict(), len(own.joints)
    last = 10 + (3 + own.past) * joints  # the end of the columns of earlier targets, see `Dynamics.seen`
    more = (frame.past - own.past) * joints
    for name, value in saved.items():
        if name in ("mean", "std", "layers.0.weight"):
            added = value[..., last - joints : last].repeat(*[1] * (value.ndim - 1), frame.past - own.past)
            added = torch.zeros_like(added) if name == "layers.0.weight" else added
            saved[name] = torch.cat((value[..., :last], added[..., :more], value[..., last:]), dim=-1)
    model.load_state_dict(saved)
    return model


@dataclass(frozen=True)
class Continued:
    """Where a part of a model's training ended."""

    parent: Parent
    descent: dict[str, Any]
    """State of the optimiser."""
    memory: Memory
    """The last control steps that it learned from."""
    loss: float


def continue_model(
    env: TrackingEnv,
    act: Callable[[Tensor], Tensor],
    config: WorldModelConfig,
    parent: Parent | None,
    iterations: int,
    descent: dict[str, Any] | None = None,
    done: tuple[float, float] = (0.0, 1.0),
    seed: int = 0,
) -> Continued:
    """Train a model in `env`, in which a policy acts that does not learn.

    Args:
        env: the worlds; its own draws begin with its own seed.
        act: the policy: observations (N, D) -> actions (N, J).
        config: window, batch, rates, memory, and steps and updates an iteration.
        parent: the model to go on from; None: a new one.
        iterations: iterations after the memory is full, each some control steps and then updates.
        descent: state of the optimiser to go on with.
        done: shares of the whole training that lie behind at the beginning and at the end, for the learning rate.
        seed: of a new model, the exploration and the draws of windows.
    """
    torch.manual_seed(seed)
    frame = frame_of(env, config.model_hidden if parent is None else parent.frame.hidden)
    model = (new_model(frame) if parent is None else fitting(parent, frame, "world model")).to(env.device)
    memory = Memory(config.memory, context_in(env), env.num_actions, frame.past)
    collect, update = Collector(env, memory, config.noise), ModelUpdate(model, memory, config)
    if descent is not None:
        update.descent.load_state_dict(descent)
    while not memory.full:
        collect(act)
    if parent is None:
        update.begin()
    for iteration in range(iterations):
        update.decay(done[0] + (done[1] - done[0]) * iteration / iterations)
        for _ in range(config.steps):
            collect(act)
        for _ in range(config.model_updates):
            update()
    env.engine.check()
    return Continued(Parent(frame, model), update.descent.state_dict(), memory, float(update.told["loss_model"]))


class _Begun(ModelUpdate):
    """The update of a model that learned elsewhere and stays normalised as it was."""

    def begin(self) -> None:
        """Nothing is left to begin."""


class ContinuedTrainer(WorldModelTrainer):
    """Trains a policy through a parent's world model, which learns on in `env`, and a residual, which does not.

    Only what a policy imagines has the residual: the simulator that `env` collects from knows nothing of it, and the
    model goes on learning from that simulator alone.

    Args:
        env: the task, in the declared or in a corrected simulator.
        config: the algorithm; the model has its parent's layers, whatever it says.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        origin: the world model to go on from.
        residual: of the model, if there is one; it stays as it is.
        seed: of the networks and of the exploration.
        parent: folder of a policy to start from, if any.

    Raises:
        BadInput: as `WorldModelTrainer` and `fitting` do.
    """

    def __init__(
        self,
        env: TrackingEnv,
        config: WorldModelConfig,
        folder: Path,
        origin: Parent,
        residual: nn.Module | None = None,
        seed: int = 0,
        parent: Path | None = None,
    ) -> None:
        config = replace(config, model_hidden=origin.frame.hidden)
        own = fitting(origin, frame_of(env, config.model_hidden), "world model")
        super().__init__(env, config, folder, seed, parent)
        model = self.model_update.model
        model.load_state_dict(own.state_dict())
        self.model_update = _Begun(model, self.memory, self.config)
        whole = corrected(model, None if residual is None else residual.to(env.device))
        actor = self.policy_update.actor
        self.policy_update = PolicyUpdate(actor, whole, self.imagination, self.memory, self.config)
        self._begin_value(None if parent is None else load_policy(parent))
        self._resume()  # into the networks that are used
