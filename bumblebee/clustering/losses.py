"""The four terms of the paper's L_cluster; each is a plain mean, they are summed with weight one."""

import torch
from torch import Tensor
from torch.nn import functional


def info_nce(z_text: Tensor, z_motion: Tensor, temperature: float, same: Tensor | None = None) -> Tensor:
    """Symmetric InfoNCE on cosine similarities; pair i of (B, Z), (B, Z) is positive, the others are negatives.

    `same` (B, B) marks pairs that say the same thing. Two clips of "a person walks" are no negatives of each other:
    pushing them apart would undo what the text is there for, so those entries leave the denominator.
    """
    similarity = functional.normalize(z_text, dim=-1) @ functional.normalize(z_motion, dim=-1).T / temperature
    if same is not None:
        hidden = same & ~torch.eye(len(similarity), dtype=torch.bool, device=similarity.device)
        similarity = similarity.masked_fill(hidden, float("-inf"))
    target = torch.arange(len(similarity), device=similarity.device)
    both = functional.cross_entropy(similarity, target) + functional.cross_entropy(similarity.T, target)
    return both / 2


def latent_l2(z_text: Tensor, z_motion: Tensor) -> Tensor:
    """Mean squared difference between the latents of a pair, both (B, Z)."""
    return (z_text - z_motion).square().mean()


def masked_huber(predicted: Tensor, target: Tensor, mask: Tensor, delta: float = 1.0) -> Tensor:
    """Huber loss of (B, T, D) against (B, T, D), averaged over the frames where `mask` (B, T) is true."""
    error = functional.huber_loss(predicted, target, reduction="none", delta=delta).mean(-1)
    return (error * mask).sum() / mask.sum().clamp_min(1)


def same_text(sentences: Tensor, threshold: float) -> Tensor:
    """(B, B), true where unit sentence embeddings (B, E) have a cosine similarity of at least `threshold`."""
    return sentences @ sentences.T >= threshold - 1e-5
