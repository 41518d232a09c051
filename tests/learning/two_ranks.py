"""One of the processes of `test_ranks`: trains a little, then writes what it knows into a folder of the test.

python -m tests.learning.two_ranks FOLDER[:ITERATION AT WHICH THE SECOND RANK DIES | :captured] ...
"""

import sys
from dataclasses import replace
from pathlib import Path

import torch

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.ranks import Ranks, join, leave
from bumblebee.sim.mujoco_cpu import MujocoCpu
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.sampling.library import MotionLibrary
from tests.tracking.clips import waving

CONFIG = PpoConfig(iterations=3, steps=4, epochs=2, mini_batches=2, hidden=(16, 16), checkpoint_every=2)


def train(folder: Path, ranks: Ranks, dies_at: int | None = None, captured: bool = False) -> None:
    """Train to the end, or die."""
    config = EnvConfig(num_worlds=8, threads=1, physics_hz=100)
    library = MotionLibrary([waving("a", 50), waving("b", 70)], config.ahead)
    engine = MujocoCpu(load_model(physics_hz=100), config.num_worlds, threads=1)
    env = TrackingEnv(library, engine, config, seed=ranks.seed(3))
    trainer = Trainer(env, replace(CONFIG, captured=captured), folder, seed=3, ranks=ranks)
    began, iterate = trainer.iteration, trainer._iterate

    def fragile() -> dict[str, float]:
        if ranks.rank == 1 and trainer.iteration == dies_at:
            raise SystemExit(7)
        return iterate()

    trainer._iterate = fragile  # type: ignore[method-assign]
    trainer.train()
    models = (trainer.algorithm.actor, trainer.algorithm.critic)
    state = {f"{i}.{name}": value for i, model in enumerate(models) for name, value in model.state_dict().items()}
    learned = {"state": state, "rate": trainer.algorithm.learning_rate, "frames": trainer.frames, "began": began}
    torch.save(
        learned | {"frame": env._frame, "mass": engine.batch.expand("body_mass")[:, 1]}, folder / f"{ranks.rank}.pt"
    )


if __name__ == "__main__":
    torch.set_num_threads(1)
    own = join(on_gpu=False)
    for word in sys.argv[1:]:
        place, _, also = word.partition(":")
        train(Path(place), own, int(also) if also.isdigit() else None, also == "captured")
    leave()
