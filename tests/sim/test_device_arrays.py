"""NumPy's functions on torch tensors give what they give on arrays."""

from collections.abc import Callable

import numpy as np
import pytest
import torch

from bumblebee.sim.device_arrays import DeviceArray

X = np.linspace(-2.0, 2.0, 12).reshape(3, 4).astype(np.float32)
WEIGHT, SOME = np.array([0.5, -1.0, 2.0, np.inf]), np.array([True, False, True, False])

WORK: dict[str, Callable] = {
    "operators": lambda x: 2.0 * x - x / 3 + WEIGHT[:3].sum() - (-x) ** 2,
    "constants on the left": lambda x: SOME * x + np.float64(2.0) * x,
    "functions": lambda x: np.exp(-np.abs(x)) + np.sin(x) * np.cos(x) + np.tanh(x) + np.sign(x) + np.floor(x),
    "rounding to even": lambda x: np.round(x * 4) / 4 + np.rint(x),
    "bounds": lambda x: (
        np.clip(x, -WEIGHT[2:], WEIGHT[2:][::-1][1:]) if x.shape == () else np.clip(x, -1.0, WEIGHT + 2)
    ),
    "largest and smallest": lambda x: np.maximum(x, 0.1) + np.minimum(x, WEIGHT),
    "where": lambda x: np.where(SOME, x, 1.0) + np.where(x > 0, 0.5, x) + np.where(x < 0, 1.0, 0.0),
    "interp": lambda x: np.interp(x[:, 1], [-1.0, 0.0, 1.5], [2.0, -1.0, 4.0]),
    "indices": lambda x: x[:, np.array([3, 0])] + x[:, SOME],
    "pairs of indices": lambda x: x[:, None][:, np.array([0, 0]), np.array([1, 2])],
    "concatenate": lambda x: np.concatenate((x[:, None], x[:, None] * 2), axis=1),
}


@pytest.mark.parametrize("name", WORK)
def test_a_function_of_arrays_is_the_same_on_tensors(name: str) -> None:
    """Operators, functions, indices and constants of NumPy on either side."""
    ours = WORK[name](DeviceArray(torch.from_numpy(X.copy())))
    assert isinstance(ours, DeviceArray)
    np.testing.assert_allclose(ours.tensor.numpy(), WORK[name](X), rtol=1e-5, atol=1e-6)


def test_writing_happens_in_place() -> None:
    """By slice, index, pair of indices, constant mask, mask of worlds, and by operators."""
    plain, tensor = X.copy(), torch.from_numpy(X.copy())
    device = DeviceArray(tensor)
    worlds = np.array([True, False, True])
    for one, mask in ((plain, worlds), (device, DeviceArray(torch.from_numpy(worlds)))):
        one[:, 1] = 7.0
        one[:, np.array([2, 3])] = one[:, np.array([0, 1])] * 2
        one[mask] = (one * 10)[mask]
        one += 1.0
        one[0] = WEIGHT[:1]
    assert device.tensor is tensor
    np.testing.assert_allclose(tensor.numpy(), plain)


def test_what_is_not_known_is_an_error() -> None:
    """No silent copy to the host."""
    with pytest.raises(TypeError):
        np.linalg.norm(DeviceArray(torch.ones(3)))
