"""Trains one policy of a run, or distils one, up to its iterations or until the call is over; goes on exactly."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import torch

from benchmarks.method.places import ARMS, BASE, LONGER, ONE, OWN, RANDOM, Place, experts
from benchmarks.method.settings import Method, iterations
from benchmarks.method.students import student_of
from benchmarks.study.correction import DECLARED, Correction
from benchmarks.study.motions import Motions
from bumblebee.io.write import write_file
from bumblebee.learning.delta import of_clusters
from bumblebee.learning.generalist.distill import CHECKPOINT as DISTILLING
from bumblebee.learning.generalist.distill import Distiller
from bumblebee.learning.learner import CHECKPOINT, Learner
from bumblebee.learning.learners import Config, make_learner, played
from bumblebee.learning.policy import load_policy
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.continuing import ContinuedTrainer, Parent, frame_of
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipShares

CHECKPOINT_EVERY = 60
"""Iterations."""
DONE, CURVE = "done.json", "distill.csv"
Over = Callable[[], bool]


class Training:
    """Trainings of a run.

    Args:
        method: its settings.
        motions: the study's.
        out: the run's folder.
        over: says when to stop and keep a checkpoint.
    """

    def __init__(self, method: Method, motions: Motions, out: Path, over: Over) -> None:
        self.method, self.motions, self.out, self.over = method, motions, out, over
        self.clips = [row.clip for row in motions.training()]

    def train(self, name: str) -> bool:
        """Train the policy into the folder of its name; whether it is done."""
        torch.set_num_threads(self.method.env.threads)
        folder, config = self.out / name, replace(self._config(name), checkpoint_every=CHECKPOINT_EVERY)
        clips = self._learned(name)
        shown, _ = played(config, clips)
        env = environment(shown, self._task(name), self.method.seed, correction(self.out, name))
        parent = None if name == BASE else self.out / self._parent(name)
        learner = self._learner(config, env, folder, parent)
        learner.train(name, self.over)
        if learner.iteration < config.iterations:
            learner.save_checkpoint()
            return False
        if name == BASE and isinstance(learner, WorldModelTrainer):
            Parent(frame_of(env, learner.config.model_hidden), learner.model_update.model).save(folder)
        learner.policy().save(folder)
        told = {"iterations": learner.iteration, "frames": learner.frames, "clips": len(clips)}
        write_file(folder / DONE, json.dumps(told) + "\n")
        (folder / CHECKPOINT).unlink(missing_ok=True)
        return True

    def distil(self, name: str) -> bool:
        """Distil a line's experts into the student of this folder, in the simulator that they were trained in."""
        torch.set_num_threads(self.method.env.threads)
        folder, (line, student) = self.out / name, student_of(name)
        folder.mkdir(parents=True, exist_ok=True)
        names = experts(line, self.motions.clusters, self.method.rounds)
        clusters = self.motions.cluster_indices(self.clips, self.method.seed if line == RANDOM else None)
        teachers = {index: load_policy(self.out / name) for index, name in enumerate(names)}
        config = student.config(self.method, self._task(ONE))
        corrections = [correction(self.out, name) for name in names]
        shared = Correction(corrections[0].diagnosis)
        env = environment(self.clips, config.env, config.seed, shared, ClipShares.equal(clusters))
        adapters = {index: one.adapter() for index, one in enumerate(corrections)}
        env.action_adapter = of_clusters(env, clusters, {i: one for i, one in adapters.items() if one is not None})
        distiller = Distiller(env, teachers, clusters, config, load_policy(self.out / BASE), folder)
        distiller.train(enough=self.over)
        if distiller.iteration < config.iterations:
            distiller.save_checkpoint(folder)
            return False
        curve = distiller.curve()
        curve.to_csv(folder / CURVE, index=False)
        distiller.policy().save(folder)
        kl = float(curve["kl"].tail(max(len(curve) // 10, 1)).mean())
        write_file(
            folder / DONE,
            json.dumps({"frames": distiller.iteration * distiller.frames_each, "kl": round(kl, 4)}) + "\n",
        )
        (folder / DISTILLING).unlink(missing_ok=True)
        return True

    def _config(self, name: str) -> Config:
        """Learner and iterations of a policy."""
        method = self.method
        if name == BASE:
            return method.base
        more = method.rounds * method.refine
        spent = {OWN: method.expert, LONGER: more, RANDOM: method.expert + more}
        count = method.spent(len(self.motions.clusters)) if name == ONE else spent.get(_line(name), method.refine)
        return iterations(method.child, count)

    def _task(self, name: str) -> EnvConfig:
        limit = self.method.child_threshold
        task = self.method.env
        return task if name == BASE else replace(task, threshold_start=limit, threshold_end=limit)

    def _learned(self, name: str) -> Sequence[Clip]:
        """Motions that a policy learns from."""
        if name in (BASE, ONE):
            return self.clips
        cluster, labels = name.rsplit("/", 1)[1], self.motions.labels.set_index("name")["cluster"]
        named = self.motions.random_clusters(self.method.seed) if _line(name) == RANDOM else labels
        return [clip for clip in self.clips if named[clip.name] == cluster]

    def _parent(self, name: str) -> str:
        """The policy that another starts from."""
        line, cluster = _line(name), name.rsplit("/", 1)[1]
        if name == ONE or line in (OWN, RANDOM):
            return BASE
        return f"{OWN if line == LONGER else Place.of(line).before}/{cluster}"

    def _learner(self, config: Config, env: TrackingEnv, folder: Path, parent: Path | None) -> Learner:
        """Learner around `env`; through a model it goes on with the base policy's, which knows all motions."""
        if parent is None or not isinstance(config, WorldModelConfig):
            return make_learner(config, env, folder, self.method.seed, parent)
        origin = Parent.load(self.out / BASE)
        return ContinuedTrainer(env, config, folder, origin, None, self.method.seed, parent)


def correction(out: Path, policy: str) -> Correction:
    """Correction of the simulator that a policy is trained in: its arm's in its round, its cluster's own delta."""
    if policy == BASE or policy.startswith("declared/"):
        return DECLARED
    place = Place.of(policy)
    parts = ARMS[place.arm]
    return Correction(
        out / place.recorded / "diagnosis" if "diagnosis" in parts else None,
        out / policy / "delta" if "delta" in parts else None,
    )


def environment(
    clips: Sequence[Clip], task: EnvConfig, seed: int, corrected: Correction, shares: ClipShares | None = None
) -> TrackingEnv:
    """The task in a corrected simulator, on its own engine."""
    model = task_model(task, corrected.model)
    hooks = corrected.hooks(model)
    engine = make_engine(task.engine, model, task.num_worlds, task.threads, hooks=hooks, buffers=task.buffers)
    library = MotionLibrary(clips, task.ahead, device=engine.device)
    return TrackingEnv(library, engine, task, seed, corrected.adapter(), shares)


def _line(name: str) -> str:
    return name.rsplit("/", 1)[0]
