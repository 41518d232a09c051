"""Actions as Gaussians, and how far two of them are apart."""

from rsl_rl.models import MLPModel
from torch import Tensor

from bumblebee.learning.generalist.transformer import TransformerModel


def gaussian_kl(mean: Tensor, std: Tensor, other_mean: Tensor, other_std: Tensor) -> Tensor:
    """KL( N(mean, std^2) || N(other_mean, other_std^2) ), diagonal, summed over the last dimension.

    Args:
        mean: (B, J) of the first distribution, `std` (B, J) or (J,).
        std: see `mean`.
        other_mean: (B, J) of the second one, `other_std` likewise.
        other_std: see `other_mean`.
    """
    ratio = (std / other_std).square()
    shift = ((mean - other_mean) / other_std).square()
    return 0.5 * (ratio + shift - 1.0 - ratio.log()).sum(dim=-1)


def gaussian(actor: MLPModel, observation: Tensor) -> tuple[Tensor, Tensor]:
    """Mean (B, J) and standard deviation (B, J) of an actor's action."""
    actor.distribution.update(actor.mlp(actor.get_latent({"policy": observation})))
    return actor.output_mean, actor.output_std


def believed(student: MLPModel, observation: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
    """Action of a student with or without a memory: mean (N, J) and deviation (N, J).

    Args:
        student: who learns.
        observation: (N, M + 1, D) of the remembered steps and the newest one, M of 0 without a memory.
        known: (N, M + 1) bool, which of them belong to the episode.
    """
    if not isinstance(student, TransformerModel):
        return gaussian(student, observation[:, -1])
    student.distribution.update(student.mlp(student.latent_of_windows(observation, known)))
    return student.output_mean, student.output_std
