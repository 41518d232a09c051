"""Physics alone, from the states and with the commands that an environment's robots had.

Three ways: the engine's own step with those commands; the same with the last of them held (robots come to rest, which
the solver finds easier); and, on a CPU, `mujoco.rollout` with those commands on the engine's model, worlds alike.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
import torch
from mujoco.rollout import Rollout

from bumblebee.sim.engine import Engine
from bumblebee.tracking.env import TrackingEnv


@contextmanager
def listening(engine: Engine) -> Iterator[list[torch.Tensor]]:
    """The targets (B, J) of each control step that the engine does meanwhile."""
    heard: list[torch.Tensor] = []
    step = engine.step

    def said(targets: torch.Tensor) -> None:
        heard.append(targets)
        step(targets)

    engine.step = said  # type: ignore[method-assign]
    try:
        yield heard
    finally:
        engine.step = step  # type: ignore[method-assign]


def physics_step(env: TrackingEnv) -> Callable[[], None]:
    """One control period of the engine alone: no kinematics afterwards, no copies."""
    engine: Any = env.engine
    if env.cfg.engine == "mujoco":
        return lambda: engine.batch.step(nstep=engine.substeps)
    import mujoco_warp
    import warp

    def advance() -> None:
        with warp.ScopedDevice(str(engine.device)):
            for _ in range(engine.substeps):
                mujoco_warp.step(engine._model, engine._data)

    if engine.device.type == "cpu":  # Warp's own, slow, for tests
        return advance
    torch.cuda.synchronize(engine.device)
    with warp.ScopedDevice(str(engine.device)), warp.ScopedCapture() as capture:
        advance()
    stream = warp.stream_from_torch(torch.cuda.current_stream(engine.device))
    return lambda: warp.capture_launch(capture.graph, stream=stream)


def command(env: TrackingEnv, targets: torch.Tensor) -> None:
    """Give the engine's motors the targets (B, J) for its next step alone."""
    engine: Any = env.engine
    if env.cfg.engine == "mujoco":
        engine.batch.ctrl[:] = targets.numpy()
    else:
        engine._ctrl.copy_(targets)


@contextmanager
def without_overflow(env: TrackingEnv) -> Iterator[None]:
    """Keep physics alone from leaving a trace in the engine's count of dropped contacts.

    Robots that nobody restarts may lie in a heap, for which an environment's buffers need not be large enough.
    """
    if env.cfg.engine == "mujoco":
        yield
        return
    flags = env.engine._data.overflow  # type: ignore[attr-defined]
    kept = flags.numpy().copy()  # on a CPU the array itself
    yield
    flags.assign(kept)


class Rolled:
    """`mujoco.rollout` of the engine's model in as many threads as the engine has, into buffers that are there before.

    Args:
        env: an environment on the CPU engine.
        steps: control steps of a rollout.
    """

    def __init__(self, env: TrackingEnv, steps: int) -> None:
        engine: Any = env.engine
        self._model, self._batch, self._substeps = engine.model, engine.batch, engine.substeps
        self._spec = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
        size = mujoco.mj_stateSize(self._model, self._spec)
        self._rollout = Rollout(nthread=env.cfg.threads)
        self._data = [mujoco.MjData(self._model) for _ in range(env.cfg.threads)]
        shape = (env.num_envs, steps * self._substeps)
        self._states, self._sensed = np.zeros((*shape, size)), np.zeros((*shape, self._model.nsensordata))
        self._first, self._warm = np.zeros((env.num_envs, size)), np.zeros((env.num_envs, self._model.nv))
        self._control = np.zeros((*shape, self._model.nu))

    def prepare(self, commands: list[torch.Tensor]) -> None:
        """Begin where the engine stands now, with these commands (B, J), one a control step."""
        data, whole = self._data[0], int(mujoco.mjtState.mjSTATE_INTEGRATION)
        for world, row in enumerate(self._batch.state):
            mujoco.mj_setState(self._model, data, row, whole)
            mujoco.mj_getState(self._model, data, self._first[world], self._spec)
        self._warm[:] = self._batch.qacc_warmstart
        self._control[:] = np.repeat(torch.stack(commands, 1).numpy(), self._substeps, axis=1)

    def __call__(self) -> None:
        """Roll all worlds out."""
        self._rollout.rollout(
            self._model,
            self._data,
            self._first,
            self._control,
            initial_warmstart=self._warm,
            state=self._states,
            sensordata=self._sensed,
        )

    def last(self) -> np.ndarray:
        """Positions (B, nq) at the end."""
        return self._states[:, -1, 1 : 1 + self._model.nq]
