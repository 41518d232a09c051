"""A trained policy in torch: building, saving and loading the network, apart from how it was trained."""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import torch
from rsl_rl.models import MLPModel
from tensordict import TensorDict
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.files import save_tensors
from bumblebee.learning.generalist.transformer import TransformerConfig, TransformerModel
from bumblebee.learning.pretrained import NAMES, NO_POLICY, THEIRS
from bumblebee.robot.facts import IDENTITY, ROBOT
from bumblebee.robot.identity import require_robot
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.env import TrackingEnv

FILE = "policy.pt"


@dataclass(frozen=True)
class Shape:
    """Sizes and inputs that fix an actor and its critic."""

    observation: int
    """Entries of the actor's observation, of all control steps that it sees."""
    critic_observation: int
    actions: int
    hidden: tuple[int, ...]
    ahead: tuple[float, ...]
    """Look-ahead times [s] of the reference."""
    terms: tuple[str, ...] = ("demo",)
    """Terms of the observation, see `tracking.observing.terms`."""
    history: int = 1
    """Control steps of the observation, the oldest first."""
    now: tuple[str, ...] = ()
    """Terms of which the newest step alone is seen, after the others."""
    action: Literal["reference", "default"] = "reference"
    """Command of an action of zero, see `EnvConfig.action`."""
    transformer: TransformerConfig | None = None
    """The transformer that `hidden` stands behind; None for an MLP."""

    @property
    def memory(self) -> tuple[int, int] | None:
        """(M, E + 1) of what it remembers of one robot; None for a policy without a memory."""
        return None if self.transformer is None else self.transformer.memory_shape

    @property
    def seen(self) -> ObservationConfig:
        """Observation of the actor, as the environment's configuration has it."""
        return ObservationConfig(self.terms, self.history, self.now)


def shape_of(env: TrackingEnv, hidden: Sequence[int], group: str = "policy") -> Shape:
    """The shape of a policy that acts in `env` and sees the observations of `group`."""
    observation = env.get_observations()
    config = env.cfg.student if group == "student" else env.cfg.observation
    return Shape(
        observation=observation[group].shape[1],
        critic_observation=observation["critic"].shape[1],
        actions=env.num_actions,
        hidden=tuple(hidden),
        ahead=tuple(env.library.ahead),
        terms=tuple(config.terms),
        history=config.history,
        now=tuple(config.now),
        action=env.cfg.action,
    )


def model_config(hidden: tuple[int, ...], initial_std: float | None) -> dict[str, Any]:
    """rsl_rl's settings of an actor, or of a critic where `initial_std` is None; normalisation is inside."""
    config: dict[str, Any] = {"hidden_dims": list(hidden), "activation": "elu", "obs_normalization": True}
    if initial_std is not None:
        config["distribution_cfg"] = {
            "class_name": "GaussianDistribution",
            "init_std": initial_std,
            "std_range": (0.05, 1.5),
        }
    return config


class Policy:
    """The deterministic policy, observation (N, D) to mean action (N, J), with its critic's weights beside it.

    One with a memory acts by `follower`; called as a function it acts as at an episode's first step.

    Args:
        actor: rsl_rl's network with group "policy".
        critic_state: weights of the critic, for whoever trains on.
        shape: sizes of both.
    """

    def __init__(self, actor: MLPModel, critic_state: dict[str, Tensor], shape: Shape) -> None:
        self.actor, self.critic_state, self.shape = actor, critic_state, shape
        self.actor.eval()

    @torch.inference_mode()
    def __call__(self, observation: Tensor) -> Tensor:
        """Mean actions (N, J) of observations (N, D)."""
        return self.advance(observation, None)[0]

    @torch.inference_mode()
    def advance(self, observation: Tensor, memory: Tensor | None) -> tuple[Tensor, Tensor | None]:
        """Mean actions (N, J) of observations (N, D), and the memory (N, M, E + 1) after that step.

        No memory is an empty one; a policy that has none gives None back.
        """
        if isinstance(self.actor, TransformerModel):
            return self.actor.advance(observation, memory)
        return self.actor({"policy": observation}), None

    def follower(self) -> Callable[[Tensor], Tensor]:
        """The policy from an episode's start on: to be called with each control step's observations (N, D)."""
        memory: Tensor | None = None

        def act(observation: Tensor) -> Tensor:
            nonlocal memory
            action, memory = self.advance(observation, memory)
            return action

        return act

    def to(self, device: torch.device | str) -> "Policy":
        """The policy on a device; a copy."""
        return Policy(deepcopy(self.actor).to(device), self.critic_state, self.shape)

    def save(self, folder: Path) -> None:
        """Write `policy.pt` into an existing folder."""
        own = {"robot": ROBOT, "robot_sha256": IDENTITY}
        content = {**own, "shape": asdict(self.shape), "actor": self.actor.state_dict(), "critic": self.critic_state}
        save_tensors(Path(folder) / FILE, content)


def new_actor(shape: Shape, initial_std: float = 1.0) -> MLPModel:
    """An untrained actor."""
    example = TensorDict({"policy": torch.zeros(1, shape.observation)}, batch_size=[1])
    config, groups = model_config(shape.hidden, initial_std), {"actor": ["policy"]}
    if shape.transformer is not None:
        return TransformerModel(example, groups, "actor", shape.actions, shape.transformer, **config)
    return MLPModel(example, groups, "actor", shape.actions, **config)


def load_policy(folder: Path) -> Policy:
    """Read `policy.pt`; only tensors and plain values are unpickled.

    Raises:
        BadInput: if there is none, it is no checkpoint of a policy, or one for another robot.
    """
    path = Path(folder) / FILE
    try:
        content = torch.load(path, weights_only=True, map_location="cpu")
        shape, weights = _shape(content["shape"]), content["actor"]
        _check_sizes(shape, weights)
        actor = new_actor(shape)
        actor.load_state_dict(weights)
    except FileNotFoundError:
        raise BadInput(path, "a trained policy", "no file", NO_POLICY) from None
    except Exception as error:
        raise BadInput(path, "a checkpoint of a policy", str(error).splitlines()[0]) from None
    known = {"robot": THEIRS} if Path(folder) in NAMES else {}
    require_robot(path, known | content, shape.actions)
    return Policy(actor, content["critic"], shape)


def _shape(content: dict[str, Any]) -> Shape:
    """The shape that a checkpoint states as plain values."""
    own = content.get("transformer")
    return Shape(**content | {"transformer": None if own is None else TransformerConfig(**own)})


def _check_sizes(shape: Shape, weights: dict[str, Tensor]) -> None:
    """Refuse a shape that is not that of the weights before a network of it takes any memory."""
    with torch.device("meta"):
        wanted = {name: tensor.shape for name, tensor in new_actor(shape).state_dict().items()}
    came = {name: tensor.shape for name, tensor in weights.items()}
    for name in sorted(wanted.keys() | came.keys()):
        if wanted.get(name) != came.get(name):
            said = [tuple(at[name]) if name in at else "none" for at in (wanted, came)]
            raise ValueError(f"{name}: {said[0]} by its shape, {said[1]} in the file")
