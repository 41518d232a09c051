#!/bin/bash
# torch 2.13.0. Muon takes a tensor as its learning rate, as Adam does, but asks it for its number at each step: on a GPU
# the step waits for the device, and a CUDA graph of it cannot be captured. Fused Adam leaves the tensor where it is.
# Seen: 1 such question a step of Muon, 0 of Adam. Source: torch/optim/_muon.py, `_single_tensor_muon` (`_to_scalar(lr)`);
# documentation of torch.optim.Muon, "lr (float, Tensor, optional)".
set -euo pipefail
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT
python3 -m venv "$here/venv"
"$here/venv/bin/pip" install -q torch==2.13.0 numpy==2.4.6
cd "$here"
venv/bin/python - <<'PY'
import torch
from torch.utils._python_dispatch import TorchDispatchMode


class Asked(TorchDispatchMode):
    count = 0

    def __torch_dispatch__(self, function, types, args=(), kwargs=None):
        self.count += function is torch.ops.aten._local_scalar_dense.default
        return function(*args, **(kwargs or {}))


def asked(make):
    weight = torch.nn.Parameter(torch.eye(4))
    weight.grad = torch.ones(4, 4)
    optimiser = make([weight], torch.tensor(0.01))
    optimiser.step()  # the first makes its state
    with Asked() as mode:
        optimiser.step()
    return mode.count


muon = asked(lambda weights, rate: torch.optim.Muon(weights, lr=rate))
adam = asked(lambda weights, rate: torch.optim.Adam(weights, lr=rate, fused=True))
print("torch", torch.__version__, "numbers asked of the device a step: Muon", muon, "Adam", adam)
assert (muon, adam) == (1, 0)
PY
