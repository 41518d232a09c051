"""Work on fixed buffers, recorded once as a CUDA graph and replayed: one launch instead of hundreds."""

from collections.abc import Callable, Sequence

import torch

_EAGER_CALLS = 2  # real calls before the recording: they load what kernels and libraries load lazily


class Captured:
    """A function without arguments and results that reads and writes tensors which stay where they are.

    On a CPU it is called as it is. On a GPU it must not wait for the device, copy from the host or depend on values.

    Args:
        work: the function.
        device: where its tensors are.
        generators: the random generators that it draws from, on the same device.
    """

    def __init__(
        self, work: Callable[[], None], device: torch.device, generators: Sequence[torch.Generator] = ()
    ) -> None:
        self._work, self._generators = work, generators
        self._on_gpu = device.type == "cuda"
        self._calls = 0
        self._graph: torch.cuda.CUDAGraph | None = None

    def __call__(self) -> None:
        """Do the work once."""
        if not self._on_gpu or self._calls < _EAGER_CALLS:
            self._calls += 1
            self._work()
            return
        if self._graph is None:
            self._graph = self._record()
        self._graph.replay()

    def _record(self) -> torch.cuda.CUDAGraph:
        graph = torch.cuda.CUDAGraph()
        for generator in self._generators:
            graph.register_generator_state(generator)
        torch.cuda.synchronize()
        # Threads of NCCL look at events of their own meanwhile, which a global capture forbids them.
        with torch.cuda.graph(graph, capture_error_mode="thread_local"):
            self._work()
        return graph
