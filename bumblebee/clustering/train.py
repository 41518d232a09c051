"""Train the text-motion autoencoder: seeded, on one CPU thread, every loss term recorded."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch

from bumblebee.clustering import losses
from bumblebee.clustering.autoencoder import AutoencoderConfig, TextMotionAutoencoder
from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.features import COLUMNS, TARGET_COLUMNS, fit_normaliser, pad
from bumblebee.clustering.text import TokenTable

TERMS = ("info_nce", "latent_l2", "huber_text", "huber_motion")


@dataclass(frozen=True)
class Batch:
    """Windows with one caption each.

    `features` (B, T, D), `mask` (B, T), `captioned` (B,) true where the clip has a caption, `tokens` (B, L, E),
    `token_mask` (B, L), `sentences` (B, E); rows without a caption hold another caption that no term reads.
    """

    features: torch.Tensor
    mask: torch.Tensor
    captioned: torch.Tensor
    tokens: torch.Tensor
    token_mask: torch.Tensor
    sentences: torch.Tensor


def loss_terms(model: TextMotionAutoencoder, batch: Batch, config: ClusterConfig) -> dict[str, torch.Tensor]:
    """The four terms by name, to be summed; the three that read text skip windows without a caption."""
    z_motion = model.encode_motion(batch.features, batch.mask)
    target = model.target(batch.features)
    terms = {"huber_motion": losses.masked_huber(model.decode(z_motion, batch.mask), target, batch.mask)}
    rows = batch.captioned
    if not rows.any():
        return {name: terms.get(name, z_motion.new_zeros(())) for name in TERMS}
    z_text, z_paired = model.encode_text(batch.tokens[rows], batch.token_mask[rows]), z_motion[rows]
    same = losses.same_text(batch.sentences[rows], config.same_text)
    terms["info_nce"] = losses.info_nce(z_text, z_paired, config.temperature, same)
    terms["latent_l2"] = losses.latent_l2(z_text, z_paired)
    terms["huber_text"] = losses.masked_huber(model.decode(z_text, batch.mask[rows]), target[rows], batch.mask[rows])
    return {name: terms[name] for name in TERMS}


def train(
    clips: Sequence[Sequence[np.ndarray]],
    captions: Sequence[Sequence[Sequence[int]]],
    table: TokenTable,
    config: ClusterConfig,
    report: Callable[[int, str], None] = lambda epoch, note: None,
) -> tuple[TextMotionAutoencoder, pd.DataFrame]:
    """Fit the autoencoder.

    Args:
        clips: motion windows (T_i, D) of each training clip; an epoch draws one of them, and one caption, a clip, so
            that a minute of dance weighs no more than a jump.
        captions: for each window of each clip the rows of `table` that describe it; none is allowed.
        table: token features of all captions.
        config: sizes, budget, seed.
        report: called after each epoch with its number and a short note.

    Returns:
        The model in evaluation mode, and the curve: one row an epoch, columns `epoch`, the four terms, `total`.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(config.threads)
    try:
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(config.seed)
            return _fit(clips, captions, table, config, report)
    finally:
        torch.set_num_threads(threads)


def planned_epochs(clips: int, config: ClusterConfig) -> int:
    """`config.epochs`, or fewer where so many clips would take more than `config.max_steps` steps; at least one."""
    return max(1, min(config.epochs, config.max_steps // math.ceil(clips / config.batch_size)))


def encode_text(model: TextMotionAutoencoder, table: TokenTable, rows: Sequence[int], batch: int = 64) -> np.ndarray:
    """Latents (N, Z) of some captions of the table."""
    model.eval()
    with torch.inference_mode():
        parts = [model.encode_text(*table.padded(part)).numpy() for part in torch.tensor(list(rows)).split(batch)]
    return np.concatenate(parts).astype(np.float64)


def encode_clips(model: TextMotionAutoencoder, clips: Sequence[Sequence[np.ndarray]], batch: int = 64) -> np.ndarray:
    """Latent of each clip (N, Z): the mean of its windows' z_m, weighted by their length."""
    windows = [window for clip in clips for window in clip]
    rows = []
    model.eval()
    with torch.inference_mode():
        for start in range(0, len(windows), batch):
            values, mask = pad(windows[start : start + batch])
            rows.append(model.encode_motion(torch.from_numpy(values), torch.from_numpy(mask)).numpy())
    latents, ends = np.concatenate(rows).astype(np.float64), np.cumsum([len(clip) for clip in clips])
    lengths = np.array([len(window) for window in windows], np.float64)
    parts = [slice(end - len(clip), end) for end, clip in zip(ends, clips, strict=True)]
    return np.stack([np.average(latents[part], axis=0, weights=lengths[part]) for part in parts])


def _fit(
    clips: Sequence[Sequence[np.ndarray]],
    captions: Sequence[Sequence[Sequence[int]]],
    table: TokenTable,
    config: ClusterConfig,
    report: Callable[[int, str], None],
) -> tuple[TextMotionAutoencoder, pd.DataFrame]:
    sizes = AutoencoderConfig(
        motion_size=len(COLUMNS), target_columns=TARGET_COLUMNS, text_size=table.tokens.shape[-1],
        hidden=config.hidden, layers=config.layers, heads=config.heads, latent=config.latent, dropout=config.dropout,
    )  # fmt: skip
    model = TextMotionAutoencoder(sizes, fit_normaliser([window for clip in clips for window in clip])).train()
    optimiser = torch.optim.AdamW(model.parameters(), lr=config.learning_rate, weight_decay=1e-4)
    epochs = planned_epochs(len(clips), config)
    steps = epochs * math.ceil(len(clips) / config.batch_size)
    schedule = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda step: _rate(step, steps))
    draw = np.random.default_rng(config.seed)
    rows = []
    for epoch in range(epochs):
        sums = dict.fromkeys(TERMS, 0.0)
        for chosen in _batches(len(clips), config.batch_size, draw):
            terms = loss_terms(model, _batch(clips, captions, table, chosen, draw), config)
            optimiser.zero_grad(set_to_none=True)
            torch.stack(list(terms.values())).sum().backward()
            torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            for name, value in terms.items():
                sums[name] += value.item() * len(chosen) / len(clips)
        rows.append({"epoch": epoch + 1, **sums, "total": sum(sums.values())})
        report(epoch + 1, f"loss {rows[-1]['total']:.3f}")
    return model.eval(), pd.DataFrame(rows)


def _rate(step: int, steps: int) -> float:
    warm = max(1, steps // 10)
    return (step + 1) / warm if step < warm else 0.5 * (1 + math.cos(math.pi * (step - warm) / max(1, steps - warm)))


def _batches(count: int, size: int, draw: np.random.Generator) -> list[np.ndarray]:
    """A shuffle cut into near-equal batches: a last batch of one would have no negatives."""
    return np.array_split(draw.permutation(count), math.ceil(count / size))


def _batch(
    clips: Sequence[Sequence[np.ndarray]],
    captions: Sequence[Sequence[Sequence[int]]],
    table: TokenTable,
    chosen: np.ndarray,
    draw: np.random.Generator,
) -> Batch:
    windows = [int(draw.integers(len(clips[i]))) for i in chosen]
    values, mask = pad([clips[i][window] for i, window in zip(chosen, windows, strict=True)])
    known = [captions[i][window] for i, window in zip(chosen, windows, strict=True)]
    captioned = torch.tensor([len(own) > 0 for own in known])
    rows = torch.tensor([int(draw.choice(own)) if len(own) else 0 for own in known])
    if not captioned.any():
        rows = rows[:0]  # the table may be empty; nothing reads it
    tokens, token_mask = table.padded(rows)
    return Batch(torch.from_numpy(values), torch.from_numpy(mask), captioned, tokens, token_mask, table.sentences[rows])
