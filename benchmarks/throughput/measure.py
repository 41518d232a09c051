"""Rates and memory of one environment: its physics alone, the environment, the PPO loop.

Physics alone is what `alone` has, side by side within the same run: .1 s of the environment, then .1 s of each kind of
physics from the states that it began with, with the commands that it gave; back to where the environment was. Actions
are random around the reference, so that robots fall and are reset; physics alone resets nobody.
"""

import gc
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch

from benchmarks.throughput.alone import Rolled, command, listening, physics_step, without_overflow
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.ranks import Ranks
from bumblebee.sim.effects import Effect, add_to_spec, runtime_hooks
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_spec
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary

ROUND = 25  # control steps between two looks at the clock
TURN = 5  # the same of environment and physics in turn: short, so that few robots without resets lie on the floor
ACTION = 0.3  # deviation of the random actions, of the action's scale


@dataclass(frozen=True)
class Rates:
    """Control steps a second."""

    environment: float
    physics: float
    """The engine's step from the same states with the same commands."""
    held: float
    """The engine's step from the states at the environment's end, its last commands held."""
    rollout: float
    """`mujoco.rollout` from the same states with the same commands; nan on a GPU."""


@dataclass(frozen=True)
class Loop:
    """The PPO loop of all ranks together."""

    frames: float
    """Control steps a second."""
    iteration: float
    """Seconds of one iteration, updating included."""
    update: float
    """Seconds of the update."""


def make_env(
    config: EnvConfig,
    library_on: Callable[[torch.device], MotionLibrary],
    ranks: Ranks | None = None,
    effects: Sequence[Effect] = (),
) -> TrackingEnv:
    """An environment of its own, so that rows share no states; its robot has `effects`."""
    alone = ranks or Ranks()
    model, hooks = task_model(config), None
    if effects:
        spec = load_spec(None, config.physics_hz)
        add_to_spec(spec, effects)
        model = spec.compile()
        hooks = runtime_hooks(effects, model)
    engine = make_engine(config.engine, model, config.num_worlds, config.threads, hooks, config.buffers, alone.device)
    return TrackingEnv(library_on(engine.device), engine, config, alone.seed(0))


def timed(work: Callable[[], object], device: str, times: int = 1) -> float:
    """Seconds that `work` takes, `times` in a row."""
    wait(device)
    began = time.perf_counter()
    for _ in range(times):
        work()
    wait(device)
    return time.perf_counter() - began


def wait(device: str) -> None:
    """Until the device has done what it was given."""
    if device != "cpu":
        torch.cuda.synchronize(torch.device(device))


@torch.inference_mode()
def physics_and_environment(env: TrackingEnv, seconds: float) -> Rates:
    """Control steps a second of the environment, and of the physics alone from the same states."""
    actions = random_actions(env)
    for action in actions * 2:
        env.step(action)
    alone, engine = physics_step(env), env.engine
    rolled = Rolled(env, TURN) if env.cfg.engine == "mujoco" else None
    spent = dict.fromkeys(("environment", "physics", "held", "rollout"), 0.0)
    turns = 0

    def driven(turn: Iterator[torch.Tensor]) -> None:
        command(env, next(turn))
        alone()

    while spent["environment"] < seconds:
        began, turn = engine.state_dict(), iter(actions[turns * TURN % ROUND :])
        with listening(engine) as commands:
            spent["environment"] += timed(lambda turn=turn: env.step(next(turn)), env.device, TURN)
        ended = engine.state_dict()
        with without_overflow(env):
            spent["held"] += timed(alone, env.device, TURN)
            engine.load_state_dict(began)
            if rolled is not None:
                rolled.prepare(commands)
            again = iter(commands)
            spent["physics"] += timed(lambda turn=again: driven(turn), env.device, TURN)
            if rolled is not None:
                spent["rollout"] += timed(rolled, env.device)
        engine.load_state_dict(ended)
        turns += 1
    steps = turns * TURN * env.num_envs
    return Rates(**{name: steps / seconds if seconds else float("nan") for name, seconds in spent.items()})


@torch.inference_mode()
def environment_rate(env: TrackingEnv, seconds: float) -> float:
    """Control steps a second of the environment alone."""
    actions = random_actions(env)
    for action in actions:
        env.step(action)
    spent, rounds = 0.0, 0
    while spent < seconds:
        turn = iter(actions)
        spent += timed(lambda turn=turn: env.step(next(turn)), env.device, ROUND)
        rounds += 1
    return rounds * ROUND * env.num_envs / spent


def random_actions(env: TrackingEnv) -> list[torch.Tensor]:
    """`ROUND` actions for all worlds, the same each time."""
    generator = torch.Generator(env.device).manual_seed(0)
    shape = (env.num_envs, env.num_actions)
    return [ACTION * torch.randn(shape, generator=generator, device=env.device) for _ in range(ROUND)]


def started(env: TrackingEnv, ppo: PpoConfig, ranks: Ranks | None = None) -> Trainer:
    """A trainer around the environment."""
    trainer = Trainer(env, ppo, Path(tempfile.mkdtemp()), ranks=ranks)
    trainer.algorithm.train_mode()
    return trainer


def loop_rate(trainer: Trainer, seconds: float) -> Loop:
    """The PPO loop for at least `seconds`, after three iterations that are not counted; all ranks call it together."""
    env, ppo, together = trainer.env, trainer.config, trainer.ranks
    for _ in range(3):
        trainer._iterate()
    updates, update = [0.0], trainer.algorithm.update

    def counted() -> dict[str, float]:
        wait(env.device)
        began = time.perf_counter()
        losses = update()
        wait(env.device)
        updates[0] += time.perf_counter() - began
        return losses

    trainer.algorithm.update = counted  # type: ignore[method-assign]
    spent: list[float] = []
    while together.decide(lambda: sum(spent) < seconds):
        spent.append(timed(trainer._iterate, env.device))
    count, total = len(spent), sum(spent)
    return Loop(count * ppo.steps * env.num_envs * together.count / total, total / count, updates[0] / count)


def used_memory(device: str) -> float:
    """Memory of the whole GPU that is in use [GiB], after what nobody holds was given back; nan without one."""
    if device == "cpu" or not torch.cuda.is_available():
        return float("nan")
    gc.collect()
    torch.cuda.empty_cache()
    torch.cuda.synchronize(torch.device(device))
    free, total = torch.cuda.mem_get_info(torch.device(device))
    return (total - free) / 2**30
