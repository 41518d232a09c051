"""Processes that train one policy together, one GPU each, on one machine: torchrun's environment as a value.

Every rank has its own worlds and episodes; gradients, the KL divergence, the observations' normalisation, the curve and
the losses are those of all ranks together. Torchrun starts them, or `launch`, which ends all when one has failed and
passes its status on.
"""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import torch
from torch import Tensor
from torch import distributed as dist

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.ppo.update_graph import forget_recordings

T = TypeVar("T")
_LAUNCHED = "BUMBLEBEE_LAUNCHED"


@dataclass(frozen=True)
class Ranks:
    """This process among those that train together; the default is one that trains alone."""

    rank: int = 0
    count: int = 1
    device: str = "cuda"
    """Where this rank's worlds and networks are, if its engine is on a GPU."""

    @property
    def first(self) -> bool:
        """Whether this process writes the curve, the checkpoint and the lines on the terminal."""
        return self.rank == 0

    @property
    def settings(self) -> dict[str, int] | None:
        """Settings that rsl_rl calls `multi_gpu_cfg`; None for one process."""
        if self.count == 1:
            return None
        return {"global_rank": self.rank, "local_rank": self.rank, "world_size": self.count}

    def seed(self, seed: int) -> int:
        """This rank's own seed: others' worlds, draws and noise are different ones."""
        return seed + 1_000_003 * self.rank

    def add(self, values: Tensor) -> None:
        """Replace `values`, any shape, by their sum over all ranks."""
        if self.count > 1:
            dist.all_reduce(values)

    def mean(self, values: dict[str, float], device: str) -> dict[str, float]:
        """The means over all ranks of some numbers that all have."""
        if self.count == 1:
            return values
        packed = torch.tensor(list(values.values()), dtype=torch.float64, device=device)
        self.add(packed)
        return dict(zip(values, (packed / self.count).tolist(), strict=True))

    def moments(self, rows: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and standard deviation (D,) float64 of the rows (B, D) of all ranks."""
        rows = rows.double()
        sums = torch.cat((rows.new_full((1,), len(rows)), rows.sum(0), rows.square().sum(0)))
        self.add(sums)
        mean, square = (sums[1:] / sums[0]).view(2, -1)
        return mean, (square - mean.square()).clamp(min=0).sqrt()

    def decide(self, question: Callable[[], bool]) -> bool:
        """The first rank's answer, for all."""
        answer = [question() if self.first else False]
        if self.count > 1:
            dist.broadcast_object_list(answer, src=0)
        return bool(answer[0])

    def gather(self, value: T) -> list[T] | None:
        """On the first rank the values of all, in their order; None on the others."""
        if self.count == 1:
            return [value]
        values: list[Any] | None = [None] * self.count if self.first else None
        dist.gather_object(value, values, dst=0)
        return values


def started_together() -> bool:
    """Whether torchrun or `launch` started this process beside others."""
    return int(os.environ.get("WORLD_SIZE", "1")) > 1


def join(on_gpu: bool = True) -> Ranks:
    """Meet the other ranks, as the environment names them; alone without any.

    Args:
        on_gpu: whether each rank takes the GPU of its number; else they meet on the CPU.

    Raises:
        BadInput: on the first rank, if there are more ranks than GPUs; the others then leave in silence.
    """
    if not started_together():
        return Ranks()
    end_with_launcher()
    rank, count = int(os.environ["RANK"]), int(os.environ["WORLD_SIZE"])
    if on_gpu:
        try:
            check_gpus(count)
        except BadInput:
            if rank == 0:
                raise
            raise SystemExit(EXIT_BAD_INPUT) from None
        torch.cuda.set_device(rank)
    if not dist.is_initialized():
        dist.init_process_group("cpu:gloo,cuda:nccl" if on_gpu else "gloo", rank=rank, world_size=count)
    return Ranks(rank, count, f"cuda:{rank}")


def end_with_launcher() -> None:
    """Where `launch` started this process: end it, whatever it does, when that one is gone."""
    if os.environ.get(_LAUNCHED):
        threading.Thread(target=_wait_for_end, daemon=True, name="launcher").start()


def _wait_for_end() -> None:
    os.read(0, 1)  # nothing is ever written there; it ends when the other end is closed
    os._exit(1)


def leave() -> None:
    """Take leave of the other ranks, if there are any."""
    if dist.is_initialized():
        forget_recordings()
        dist.destroy_process_group()


def check_gpus(count: int) -> None:
    """Raise `BadInput` if this machine has fewer than `count` GPUs that torch can use."""
    have = torch.cuda.device_count()
    if count > have:
        came, do = f"{have} that torch can use", f"Train on {have} at most." if have else "Train on the CPU."
        raise BadInput("gpus", f"{count} NVIDIA GPUs on this machine", came, do)


def this_command() -> list[str]:
    """The arguments of Python that started this program as a module."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    return ["-m", spec.name, *sys.argv[1:]] if spec is not None else list(sys.argv)


def launch(count: int, command: Sequence[str]) -> int:
    """Run `command`, arguments of this Python, as `count` ranks; the status of the first that fails, else 0.

    Only the first rank's output is shown, and every rank's errors.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ranks = []
    for rank in range(count):
        where: dict[str, object] = {"RANK": rank, "LOCAL_RANK": rank, "WORLD_SIZE": count, "LOCAL_WORLD_SIZE": count}
        where |= {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port}
        own = os.environ | {name: str(value) for name, value in where.items()} | {_LAUNCHED: "1"}
        out = None if rank == 0 else subprocess.DEVNULL
        ranks.append(subprocess.Popen([sys.executable, *command], env=own, stdin=subprocess.PIPE, stdout=out))
    try:
        while True:
            codes = [process.poll() for process in ranks]
            failed = [code for code in codes if code]
            if failed or all(code == 0 for code in codes):
                return failed[0] if failed else 0
            time.sleep(0.2)
    finally:
        for process in ranks:
            if process.poll() is None:
                process.terminate()
        for process in ranks:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
