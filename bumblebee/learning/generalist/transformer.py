"""The paper's generalist (appendix C): a Gated Transformer-XL as a model of rsl_rl, with its memory inside or outside.

One token is what is seen at one control step. The memory of a robot is the block's inputs of the last M steps,
(M, E + 1): the last entry of a row is 1 where the row holds a step of this episode, so that zeros are an empty memory
and are masked. No gradient reaches what a memory holds. With one block, an action depends on the observations of the
last M + 1 steps and on nothing older.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import torch
from rsl_rl.models import MLPModel
from rsl_rl.modules import HiddenState
from rsl_rl.utils import unpad_trajectories
from tensordict import TensorDict
from torch import Tensor, nn

from bumblebee.learning.generalist.attention import GatedBlock
from bumblebee.ranges import Range, Ranged, Widths


@dataclass(frozen=True)
class TransformerConfig(Ranged):
    """A Gated Transformer-XL of one block; the defaults are the paper's (`docs/decisions/generalist.md`)."""

    embedding: Annotated[int, Range(least=2, most=4096)] = 204
    """Entries of an embedded control step; even, and a multiple of `heads`."""
    heads: Annotated[int, Range(least=1, most=64)] = 6
    """Heads of the attention."""
    memory: Annotated[int, Range(least=1, most=200)] = 10
    """Control steps that are remembered."""
    feed_forward: Annotated[int, Range(least=1, most=16384)] = 128
    """Units of the block's feed-forward layer."""
    head: Widths = (128,)
    """Layers between the block and the actions."""
    gate_bias: Annotated[float, Range(least=-10, most=10)] = 2.0
    """How far the gates are closed at first."""

    def __post_init__(self) -> None:
        """Refuse heads that do not divide the embedding."""
        super().__post_init__()
        self.require(self.embedding % self.heads == 0, "embedding", f"a multiple of heads, {self.heads}")
        self.require(self.embedding % 2 == 0, "embedding", "an even number, for as many sines as cosines")

    @property
    def memory_shape(self) -> tuple[int, int]:
        """(M, E + 1) of one robot's memory."""
        return self.memory, self.embedding + 1


class TransformerModel(MLPModel):
    """rsl_rl's MLP, the head, behind an embedding and a gated block.

    As with rsl_rl's recurrent models, a call without masks is a control step of all robots and moves the memory on; a
    call with masks is a batch of padded trajectories, whose memories at their starts are given.

    Args:
        obs: see `MLPModel`, as all up to `distribution_cfg`.
        settings: the transformer; a mapping of its fields is taken, too.
    """

    is_recurrent: bool = True

    def __init__(
        self,
        obs: TensorDict,
        obs_groups: dict[str, list[str]],
        obs_set: str,
        output_dim: int,
        settings: TransformerConfig | dict[str, Any] | None = None,
        **rest: Any,
    ) -> None:
        own = TransformerConfig(**settings) if isinstance(settings, dict) else settings or TransformerConfig()
        self.settings = own
        super().__init__(obs, obs_groups, obs_set, output_dim, **rest)
        self.embedding = nn.Sequential(nn.Linear(self.obs_dim, own.embedding), nn.ELU())
        self.block = GatedBlock(own.embedding, own.heads, own.memory, own.feed_forward, own.gate_bias)
        self._memory: Tensor | None = None

    def get_latent(self, obs: TensorDict, masks: Tensor | None = None, hidden_state: HiddenState = None) -> Tensor:
        """(N, E) of a control step, or (T, N, E) of trajectories (T, P, ...) with their memories (M, P, E + 1)."""
        tokens = self.embedding(super().get_latent(obs))
        if masks is None:
            latent, self._memory = self._step(tokens, self._memory)
            return latent
        assert not isinstance(hidden_state, tuple)
        tokens = tokens.transpose(0, 1)
        past = self.empty_memory(len(tokens)) if hidden_state is None else hidden_state.transpose(0, 1)
        steps, known = _joined(past, tokens)
        return unpad_trajectories(self.block(steps, known).transpose(0, 1), masks)

    def advance(self, observation: Tensor, memory: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """Mean actions (N, J) and the new memory (N, M, E + 1), of observations (N, D) and the memory; None: empty."""
        tokens = self.embedding(self.obs_normalizer(observation))
        latent, memory = self._step(tokens, memory)
        return self.distribution.deterministic_output(self.mlp(latent)), memory

    def latent_of_windows(self, observation: Tensor, known: Tensor) -> Tensor:
        """(N, E) of the newest of M + 1 steps, seen with the memory that the present weights make of the others.

        Args:
            observation: (N, M + 1, D), the oldest first.
            known: (N, M + 1) bool, which of them belong to the episode.
        """
        with torch.no_grad():
            past = self.embedding(self.obs_normalizer(observation[:, :-1]))
        token = self.embedding(self.obs_normalizer(observation[:, -1:]))
        return self.block(torch.cat((past, token), dim=1), known)[:, 0]

    def empty_memory(self, robots: int) -> Tensor:
        """The memory (N, M, E + 1) of robots that have seen nothing."""
        return torch.zeros(robots, *self.settings.memory_shape, device=self.block.attention.out.weight.device)

    def reset(self, dones: Tensor | None = None, hidden_state: HiddenState = None) -> None:
        """Forget everything or take over a state (M, N, E + 1); with `dones` (N,) forget what these robots saw."""
        if dones is None:
            assert not isinstance(hidden_state, tuple)
            self._memory = None if hidden_state is None else hidden_state.transpose(0, 1)
        elif self._memory is not None:
            self._memory = self._memory.masked_fill(dones.view(-1, 1, 1) == 1, 0.0)

    def get_hidden_state(self) -> Tensor | None:
        """The memory as rsl_rl's storage has it, (M, N, E + 1)."""
        return None if self._memory is None else self._memory.transpose(0, 1)

    def as_jit(self) -> nn.Module:
        """rsl_rl's export to TorchScript, which we have none for."""
        raise NotImplementedError("bumblebee.learning.export.export_policy writes the model with its memory as ONNX")

    def as_onnx(self, verbose: bool = False) -> nn.Module:
        """rsl_rl's export through PyTorch's tracer; ours is `bumblebee.learning.export`."""
        return self.as_jit()

    def _step(self, tokens: Tensor, memory: Tensor | None) -> tuple[Tensor, Tensor]:
        """(N, E) of one step, and the memory after it."""
        memory = self.empty_memory(len(tokens)) if memory is None else memory
        steps, known = _joined(memory, tokens[:, None])
        row = torch.cat((tokens, torch.ones_like(tokens[:, :1])), dim=-1).detach()
        return self.block(steps, known)[:, 0], torch.cat((memory[:, 1:], row[:, None]), dim=1)

    def _get_latent_dim(self) -> int:
        return self.settings.embedding


def _joined(memory: Tensor, tokens: Tensor) -> tuple[Tensor, Tensor]:
    """Memory (N, M, E + 1) and tokens (N, S, E) as steps (N, M + S, E), and which are known (N, M + S) bool."""
    known = torch.cat((memory[..., -1] > 0.5, torch.ones_like(tokens[..., 0], dtype=torch.bool)), dim=1)
    return torch.cat((memory[..., :-1], tokens), dim=1), known
