"""A gradient step recorded once as a CUDA graph, and what is done where it cannot be recorded.

Unlike `sim.cuda_graph`, whose work is part of a rollout, the work here has a backward pass: it is warmed up on the
stream that it is recorded on, since autograd keeps the stream of a parameter's first use, and a step that cannot be
recorded goes on without a graph.
"""

import contextlib
import sys
import weakref
from collections.abc import Callable, Iterable, Iterator

import torch
from torch import Tensor

_EAGER_CALLS = 3  # real calls before the recording: kernels, libraries and Adam's state are loaded by then

_ALL: "weakref.WeakSet[Recorded]" = weakref.WeakSet()

Place = tuple[int, tuple[int, ...]]


def place(tensor: Tensor | None) -> Place:
    """Where a tensor's numbers are, and its shape; a graph works on these whatever the name stands for later."""
    return (0, ()) if tensor is None else (tensor.data_ptr(), tuple(tensor.shape))


class Recorded:
    """A function without arguments and results that may differentiate; on a CPU it is called as it is.

    On a GPU it must not wait for the device, copy from the host or depend on values.

    Args:
        work: the function; called again after a recording that failed, which has changed no tensor.
        device: where its tensors are.
        uses: the tensors that others hold and that it reads or writes; a recording is renewed when one has moved.
    """

    def __init__(
        self, work: Callable[[], None], device: torch.device, uses: Callable[[], Iterable[Tensor | None]]
    ) -> None:
        self._work, self._device, self._uses = work, device, uses
        self._on_gpu = device.type == "cuda"
        self._calls = 0
        self._graph: torch.cuda.CUDAGraph | None = None
        self._places: tuple[Place, ...] = ()
        self._stream: torch.cuda.Stream | None = None
        _ALL.add(self)

    def renew(self) -> None:
        """Forget a recording that is of other tensors than those in use now; once an update is enough."""
        if self._graph is not None and self._places != self._now():
            self.forget()

    def forget(self) -> None:
        """Work without the recording until there is a new one."""
        self._graph, self._calls = None, 0

    def __call__(self) -> None:
        """Do the work once."""
        if not self._on_gpu:
            self._work()
        elif self._graph is None and self._calls < _EAGER_CALLS:
            self._calls += 1
            self._warm_up()
        elif self._graph is not None or self._try_to_record():
            self._replay()
        else:
            self._work()

    def _now(self) -> tuple[Place, ...]:
        return tuple(place(tensor) for tensor in self._uses())

    def _warm_up(self) -> None:
        with torch.cuda.device(self._device):
            self._stream = self._stream or torch.cuda.Stream()
            main = torch.cuda.current_stream()
            self._stream.wait_stream(main)
            with torch.cuda.stream(self._stream):
                self._work()
            main.wait_stream(self._stream)

    def _try_to_record(self) -> bool:
        """Whether there is a recording now; says in one line if not, and never tries again."""
        try:
            with _as_before(self._device):
                self._graph = self._record()
        except RuntimeError as error:  # of CUDA, of its memory, of torch: the work itself went well three times
            self._on_gpu = False
            print(f"update: no CUDA graph ({_cause(error)}); goes on without one", file=sys.stderr, flush=True)
            return False
        self._places = self._now()
        return True

    def _record(self) -> torch.cuda.CUDAGraph:
        graph = torch.cuda.CUDAGraph()
        # Threads of NCCL look at events of their own meanwhile, which a global capture forbids them.
        recording = torch.cuda.graph(graph, stream=self._stream, capture_error_mode="thread_local")
        # The random generators' tensors may have been made in inference mode, by the recordings of a rollout, and can
        # then be written in inference mode alone; the work itself is differentiated.
        with torch.cuda.device(self._device), torch.inference_mode(), recording, torch.inference_mode(False):
            self._work()
        return graph

    def _replay(self) -> None:
        assert self._graph is not None
        with torch.cuda.device(self._device), torch.inference_mode():
            self._graph.replay()


def forget_recordings() -> None:
    """Free every recording of this process: NCCL waits at its end for all graphs that hold exchanges of its own."""
    for recorded in list(_ALL):
        recorded.forget()


@contextlib.contextmanager
def _as_before(device: torch.device) -> Iterator[None]:
    """A recording that breaks off leaves its stream the current one, and torch's generator as if still recorded."""
    stream, state = torch.cuda.current_stream(device), torch.cuda.get_rng_state(device)
    try:
        yield
    except RuntimeError:
        torch.cuda.set_stream(stream)
        fresh = torch.Generator(device)
        fresh.set_state(state)
        index = torch.cuda.current_device() if device.index is None else device.index
        torch.cuda.default_generators[index].graphsafe_set_state(fresh.graphsafe_get_state())
        raise


def _cause(error: BaseException) -> str:
    """The first line of what went wrong first; the end of a broken recording raises an error of its own."""
    while error.__context__ is not None:
        error = error.__context__
    return (str(error).strip() or type(error).__name__).splitlines()[0]
