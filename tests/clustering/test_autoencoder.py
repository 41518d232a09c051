"""The networks: masks hide what is padded, training lowers every term, the seed is the result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from bumblebee.clustering.autoencoder import AutoencoderConfig, TextMotionAutoencoder, sinusoid
from bumblebee.clustering.config import ClusterConfig
from bumblebee.clustering.features import COLUMNS, TARGET_COLUMNS, motion_windows, pad
from bumblebee.clustering.text import TokenTable, token_table
from bumblebee.clustering.train import TERMS, encode_clips, train
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip


@pytest.fixture(scope="module")
def model() -> TextMotionAutoencoder:
    torch.manual_seed(1)
    sizes = AutoencoderConfig(len(COLUMNS), TARGET_COLUMNS, text_size=8, hidden=16, layers=2, heads=2, latent=4)
    return TextMotionAutoencoder(sizes).eval()


def test_longer_padding_changes_no_latent(model: TextMotionAutoencoder, library: list[Clip]) -> None:
    windows = [motion_windows(clip, 10.0, 8.0)[0] for clip in library[:4]]
    latents = []
    for length in (None, 60):
        values, mask = map(torch.from_numpy, pad(windows, length))
        values[~mask] = 7.0 if length else 0.0  # what stands behind the end has no influence either
        latents.append(model.encode_motion(values, mask))
    torch.testing.assert_close(latents[0], latents[1], atol=1e-5, rtol=1e-5)
    assert latents[0].std(0).min() > 0


def test_longer_padding_changes_no_text_latent(model: TextMotionAutoencoder) -> None:
    tokens = torch.randn(2, 5, 8)
    longer = torch.cat([tokens, torch.full((2, 3, 8), 9.0)], 1)
    mask = torch.tensor([[True] * 5, [True] * 3 + [False] * 2])
    more = torch.cat([mask, torch.zeros(2, 3, dtype=torch.bool)], 1)
    torch.testing.assert_close(model.encode_text(tokens, mask), model.encode_text(longer, more), atol=1e-5, rtol=1e-5)


def test_decoded_frames_do_not_depend_on_padding(model: TextMotionAutoencoder) -> None:
    latent = torch.randn(1, 4)
    short, long = torch.ones(1, 6, dtype=torch.bool), torch.zeros(1, 9, dtype=torch.bool)
    long[:, :6] = True
    torch.testing.assert_close(model.decode(latent, short), model.decode(latent, long)[:, :6], atol=1e-5, rtol=1e-5)


def test_positions_are_told_apart() -> None:
    table = sinusoid(200, 16)
    assert torch.cdist(table, table).add(10 * torch.eye(200)).min() > 0.05


def test_every_term_falls(library: list[Clip], table: TokenTable, tiny: ClusterConfig) -> None:
    clips, captions = _training(library, table)
    _, curve = train(clips, captions, table, tiny)
    assert list(curve.columns) == ["epoch", *TERMS, "total"] and len(curve) == tiny.epochs
    first, last = curve.iloc[:3].mean(), curve.iloc[-3:].mean()
    assert last["total"] < 0.7 * first["total"]
    assert all(last[term] < first[term] for term in TERMS if term != "latent_l2")
    np.testing.assert_allclose(curve[list(TERMS)].sum(axis=1), curve["total"])


def test_same_seed_same_weights_and_the_callers_randomness_is_left_alone(
    library: list[Clip], table: TokenTable, tiny: ClusterConfig
) -> None:
    clips, captions = _training(library, table)
    short = replace(tiny, epochs=3, dropout=0.1)
    runs = []
    for noise in (1, 2):
        torch.manual_seed(noise)
        before = torch.get_rng_state()
        runs.append(train(clips, captions, table, short)[0].state_dict())
        assert torch.equal(before, torch.get_rng_state())
    assert all(torch.equal(runs[0][name], runs[1][name]) for name in runs[0])
    other = train(clips, captions, table, replace(short, seed=1))[0].state_dict()
    assert not torch.equal(runs[0]["motion.head.weight"], other["motion.head.weight"])


def test_clips_without_captions_train_the_motion_side(
    library: list[Clip], table: TokenTable, tiny: ClusterConfig
) -> None:
    clips, _ = _training(library, table)
    _, curve = train(clips, [[[]] for _ in clips], token_table((), ()), replace(tiny, epochs=8))
    assert (curve[["info_nce", "latent_l2", "huber_text"]] == 0).all(axis=None)
    assert curve["huber_motion"].iloc[-1] < curve["huber_motion"].iloc[0]


def test_a_clips_latent_is_the_mean_of_its_windows(model: TextMotionAutoencoder, library: list[Clip]) -> None:
    windows = motion_windows(library[7], 10.0, 1.0)
    assert len({len(window) for window in windows}) > 1
    each = np.concatenate([encode_clips(model, [[window]]) for window in windows])
    whole = encode_clips(model, [windows, windows[:1]])
    np.testing.assert_allclose(whole[0], np.average(each, axis=0, weights=[len(w) for w in windows]), atol=1e-5)
    np.testing.assert_allclose(whole[1], each[0], atol=1e-5)


def test_weights_load_without_pickled_code(model: TextMotionAutoencoder, tmp_path: Path) -> None:
    torch.save(model.state_dict(), tmp_path / "a.pt")
    twin = TextMotionAutoencoder(model.config)
    twin.load_state_dict(torch.load(tmp_path / "a.pt", weights_only=True))
    values, mask = torch.randn(1, 5, len(COLUMNS)), torch.ones(1, 5, dtype=torch.bool)
    assert torch.equal(twin.eval().encode_motion(values, mask), model.encode_motion(values, mask))


@pytest.mark.parametrize("bad", [{"fps": 0.0}, {"hidden": 30, "heads": 4}, {"dropout": 1.0}, {"min_clips": 0}])
def test_unusable_settings_are_named(bad: dict[str, float]) -> None:
    with pytest.raises(BadInput, match="ClusterConfig." + next(iter(bad))):
        ClusterConfig(**bad)


def _training(library: list[Clip], table: TokenTable) -> tuple[list[list[np.ndarray]], list[list[list[int]]]]:
    clips = [clip for clip in library if clip.split == "train"]
    return [motion_windows(clip, 10.0, 8.0) for clip in clips], [[[table.captions.index(c.captions[0])]] for c in clips]
