"""Limits of MuJoCo Warp: missing packages, device or memory, and buffers that are too small; a clear line for each."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import torch

from bumblebee.errors import BadInput
from bumblebee.ranges import Count, Ranged

_SHARE = 0.9  # of the free memory that the worlds may fill
_SAMPLE = 64  # worlds from which the memory a world is measured


@dataclass(frozen=True)
class Buffers(Ranged):
    """Room for contacts; Warp drops what does not fit, and `MujocoWarp.check` says so."""

    contacts: Count = 32
    """Contacts a world, on average over all worlds."""
    constraints: Count = 192
    """Rows of constraints in any one world: 4 a contact, 1 a joint at its limit or with dry friction."""


def warp_modules(device: str) -> tuple[Any, Any]:
    """The modules `warp` and `mujoco_warp`, checked to work on `device`.

    Raises:
        BadInput: if a package, the device or a driver that records conditional graphs is missing.
    """
    try:
        import mujoco_warp
        import warp
    except ImportError as error:
        came = f"no module {error.name!r}"
        raise BadInput("engine mujoco_warp", "the packages of the extra `gpu`", came, _INSTALL) from None
    warp.config.log_level = warp.LOG_WARNING
    on_gpu = torch.device(device).type == "cuda"
    if on_gpu and not torch.cuda.is_available():  # asked first: without a GPU, Warp has a warning of its own
        raise _no_gpu("torch")
    warp.init()
    if on_gpu and not warp.is_cuda_available():
        raise _no_gpu("warp")
    if on_gpu and not warp.is_conditional_graph_supported():
        came = ".".join(map(str, warp.get_cuda_driver_version() or ("none",)))
        raise BadInput("NVIDIA driver", "CUDA 12.4 or later, for graphs", f"CUDA {came}", "Update the driver.")
    return warp, mujoco_warp


def _no_gpu(blind: str) -> BadInput:
    do = "Use the engine `mujoco`, or install a CUDA build of torch and NVIDIA's driver."
    return BadInput("engine mujoco_warp", "an NVIDIA GPU", f"none that {blind} can use", do)


_INSTALL = "In the checkout: pip install -e '.[gpu]'"


def fitting(model: mujoco.MjModel, num_worlds: int, buffers: Buffers, device: str) -> Any:
    """Warp's data of `num_worlds` worlds.

    Raises:
        BadInput: if they do not fit into the device's free memory; it names how many would.
    """
    import mujoco_warp

    def make(n: int) -> Any:
        return mujoco_warp.make_data(model, n, nconmax=buffers.contacts, njmax=buffers.constraints)

    if torch.device(device).type == "cuda":
        each = bytes_of(make(_SAMPLE)) / _SAMPLE
        free = torch.cuda.mem_get_info(torch.device(device))[0] * _SHARE
        if num_worlds * each > free:
            came = f"{num_worlds} worlds of {each / 2**20:.2f} MiB, {num_worlds * each / 2**30:.1f} GiB"
            wanted = f"worlds that fit into {free / 2**30:.1f} GiB"
            raise BadInput("num_worlds", wanted, came, f"At most {int(free / each)} fit.")
    return make(num_worlds)


@contextmanager
def within_memory(num_worlds: int) -> Iterator[None]:
    """Work whose tensors must fit into the GPU's memory beside the worlds.

    Raises:
        BadInput: if they do not.
    """
    try:
        yield
    except torch.OutOfMemoryError as error:
        wanted, do = "worlds, networks and batches within the GPU's memory", "Use fewer worlds or shorter batches."
        raise BadInput("num_worlds", wanted, f"{num_worlds} worlds: {str(error).splitlines()[0]}", do) from None


def bytes_of(data: Any) -> int:
    """Memory of all arrays in Warp's data [B]."""
    total = 0
    for value in vars(data).values():
        if hasattr(value, "capacity"):
            total += int(value.capacity)
        elif hasattr(value, "__dataclass_fields__"):
            total += bytes_of(value)
    return total


def overflow_line(overflow: np.ndarray, buffers: Buffers) -> BadInput | None:
    """The line for worlds (B,) whose overflow bits are set; None if nothing that matters was dropped."""
    from mujoco_warp import OverflowType

    rows = int(((overflow & int(OverflowType.NEFC)) != 0).sum())
    pooled = int(OverflowType.BROADPHASE) | int(OverflowType.NARROWPHASE) | int(OverflowType.CONTACT_MATCH)
    contacts = int(((overflow & pooled) != 0).sum())
    if rows:
        came = f"more in {rows} of {len(overflow)} worlds"
        do = "Raise `env.buffers.constraints`."
        return BadInput("constraints of a world", f"at most {buffers.constraints} rows", came, do)
    if contacts:
        came = f"more, dropped in {contacts} of {len(overflow)} worlds"
        do = "Raise `env.buffers.contacts`."
        return BadInput("contacts of a world", f"at most {buffers.contacts} on average", came, do)
    return None
