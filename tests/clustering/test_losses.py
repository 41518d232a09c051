"""Each term against numbers worked out by hand."""

import math

import pytest
import torch

from bumblebee.clustering.losses import info_nce, latent_l2, masked_huber, same_text


def test_info_nce_of_orthogonal_pairs() -> None:
    """Similarities are the identity: each row's loss is log(e + 1) - 1 at temperature one."""
    z = torch.tensor([[2.0, 0.0], [0.0, 3.0]])
    assert info_nce(z, z, 1.0).item() == pytest.approx(math.log(math.e + 1) - 1, abs=1e-6)


def test_info_nce_is_symmetric_and_uses_the_temperature() -> None:
    """Rows give log(1 + e^(1/t)) for swapped pairs; exchanging the modalities changes nothing."""
    text, motion = torch.tensor([[1.0, 0.0], [0.0, 1.0]]), torch.tensor([[0.0, 1.0], [1.0, 0.0]])
    assert info_nce(text, motion, 0.5).item() == pytest.approx(math.log(1 + math.exp(2)), abs=1e-6)
    a, b = torch.randn(5, 3), torch.randn(5, 3)
    assert info_nce(a, b, 0.1).item() == pytest.approx(info_nce(b, a, 0.1).item(), abs=1e-5)


def test_same_text_is_no_negative() -> None:
    """Clips 0 and 1 say the same: with both hidden from each other only clip 2 is left to contrast with."""
    z = torch.tensor([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    same = same_text(torch.nn.functional.normalize(z, dim=-1), 0.95)
    assert same.tolist() == [[True, True, False], [True, True, False], [False, False, True]]
    first, last = math.log(math.e + 1) - 1, math.log(math.e + 2) - 1
    assert info_nce(z, z, 1.0, same).item() == pytest.approx((2 * first + last) / 3, abs=1e-6)
    assert info_nce(z, z, 1.0).item() > info_nce(z, z, 1.0, same).item()


def test_one_pair_alone_costs_nothing() -> None:
    """Without negatives there is nothing to tell apart."""
    assert info_nce(torch.randn(1, 4), torch.randn(1, 4), 0.1).item() == 0.0


def test_latent_l2() -> None:
    """(1 + 4 + 0 + 9) / 4."""
    assert latent_l2(torch.tensor([[1.0, 2.0], [0.0, 3.0]]), torch.zeros(2, 2)).item() == pytest.approx(3.5)


def test_huber_reads_real_frames_only() -> None:
    """Errors 0.5 and 3 give 0.125 and 2.5, their mean 1.3125; the masked frame's error of 100 is not seen."""
    predicted, target = torch.tensor([[[0.5, 3.0], [100.0, 100.0]]]), torch.zeros(1, 2, 2)
    mask = torch.tensor([[True, False]])
    assert masked_huber(predicted, target, mask).item() == pytest.approx(1.3125)
    assert masked_huber(predicted, target, ~mask).item() == pytest.approx(99.5)
