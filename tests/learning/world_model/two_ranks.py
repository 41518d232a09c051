"""One of the processes of `test_ranks`: trains through a model a little, goes on once more, and writes what it knows.

python -m tests.learning.world_model.two_ranks FOLDER
"""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch

from bumblebee.learning.ranks import Ranks, join, leave
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from tests.learning.tiny import env_of
from tests.learning.world_model.test_trainer import SMALL, TASK, weights

CONFIG = replace(SMALL, iterations=3, checkpoint_every=2, model_updates=2, policy_updates=2, hidden=(16,))


def trained(folder: Path, ranks: Ranks) -> dict[str, Any]:
    """Networks and curve at the end of a training that begins, or goes on from the checkpoint of the folder."""
    trainer = WorldModelTrainer(env_of(TASK, seed=ranks.seed(3)), CONFIG, folder, seed=3, ranks=ranks)
    began = trainer.iteration
    trainer.train()
    learned = {"weights": weights(trainer), "began": began, "frames": trainer.frames}
    return learned | {"failure": trainer.env.sampler.failure, "bodies": trainer.memory.columns["body"]}


if __name__ == "__main__":
    torch.set_num_threads(1)
    own = join(on_gpu=False)
    out = Path(sys.argv[1])
    torch.save([trained(out, own), trained(out, own)], out / f"{own.rank}.pt")
    leave()
