"""The steps of one seed; each writes what it made whole or not at all and is not done again."""

import json
import tempfile
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import pandas as pd
from torch import nn

from benchmarks.measured_loop.settings import ARMS, Loop, seen_by
from benchmarks.study.correction import DECLARED, Correction
from benchmarks.study.on_robot import KEY, exported, judged_rows, run_on_robot, write_csv
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.output import fill
from bumblebee.evaluation.thinning import thin
from bumblebee.files import save_tensors
from bumblebee.io.write import new_folder, write_file
from bumblebee.learning import pretrained
from bumblebee.learning.checkpoint import load_checkpoint
from bumblebee.learning.policy import load_policy
from bumblebee.learning.world_model.accuracy import HORIZONS
from bumblebee.learning.world_model.continuing import Continued, ContinuedTrainer, Parent, continue_model
from bumblebee.learning.world_model.measured import Measured, measured
from bumblebee.learning.world_model.residual import corrected, fit_residual, new_residual, predicted_error
from bumblebee.measured.rollout import Rollout, read_rollout, rollout_files, write_rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import make_library
from bumblebee.policy.episodes import Episode
from bumblebee.robot.model import write_xml
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary
from tasks.on_robot.stand_in import cut
from tasks.seal import found

SETS = ("learn", "learn", "learn", "stop", "judge", "judge")
"""Use of the recordings of each six motions in a row."""
RESIDUAL, CARD, TRIED = "residual.pt", "card.json", "tried.csv"


class Work:
    """One seed of a run.

    Args:
        config: see `Loop`.
        out: the run's folder.
        seed: of recordings, networks and exploration.
        over: whether this call's time is over; asked between parts.
    """

    def __init__(self, config: Loop, out: Path, seed: int, over: Callable[[], bool] = lambda: False) -> None:
        self.config, self.out, self.folder, self.seed, self.over = config, out, out / f"seed-{seed}", seed, over
        self.policy = load_policy(pretrained.FOLDER)
        self.task = replace(config.env, **seen_by(config.env, self.policy))
        self.clips = [cut(clip, config.seconds) for clip in make_library()]
        families = [clip.family for clip in self.clips]
        names = [clip.name for clip in self.clips]
        table = pd.DataFrame({"name": names, "cluster": families, "family": families, "split": "train"})
        self.recorded = sorted(thin(table, config.motions))
        self.use = {name: SETS[i % len(SETS)] for i, name in enumerate(self.recorded)}

    @property
    def names(self) -> list[str]:
        """Names of the robots."""
        return [f"robot-{index}" for index in range(len(self.config.robots))]

    def robot(self, name: str) -> None:
        """Draw the robot until it is worth it, and seal it; the same for all seeds."""
        path = self.out / f"{name}.json"
        if not path.exists():
            sealed = found(self.config.sealed(self.names.index(name)), self._clips(self.recorded)[:: self._every])
            write_file(path, json.dumps(sealed, indent=1) + "\n")

    def record(self, name: str) -> None:
        """The recorded motions by the shipped policy: readings, and the true states of those that judge."""
        judges = [motion for motion, use in self.use.items() if use == "judge"]
        for what, motions in (("readings", self.recorded), ("truth", judges)):
            if (self.folder / name / what).exists():
                continue
            made = self._on_robot(name, pretrained.FOLDER, motions, self.config.record_seed, what == "truth")
            with new_folder(self.folder / name / what) as folder:
                _write(folder, made)

    def diagnosis(self, name: str) -> None:
        """Diagnose the declared model by the recordings that do not judge."""
        out = self.folder / name / "diagnosis"
        if out.exists():
            return
        with tempfile.TemporaryDirectory() as scratch:
            _write(Path(scratch), self._rollouts(name, "readings", ("learn", "stop")))
            write_xml(Path(scratch) / "model.xml")
            session = open_session(Path(scratch) / "model.xml", Path(scratch), self.config.diagnosis.thresholds.dataset)
            result = diagnose(session, self.config.diagnosis, say=lambda text: None)
            with new_folder(out) as folder:
                fill(result, folder)

    def model(self, name: str, physics: bool) -> bool:
        """The parent's model, then it goes on in the arm's simulator; False where the time was over before."""
        config, correction = self.config, self._correction(name, physics)
        if not self._parts(self.folder / "parent", DECLARED, None, config.parent_parts):
            return False
        parent = Parent.load(self.folder / "parent" / f"part-{config.parent_parts - 1}")
        return self._parts(self._model_folder(name, physics), correction, parent, config.parts)

    def residual(self, name: str, physics: bool) -> None:
        """The residual of an arm's model, fitted, stopped and judged on recordings of their own."""
        out = self.folder / name / ("both" if physics else "residual")
        if out.exists():
            return
        origin = self._model(name, physics)
        sets = [self._measured(name, "readings", use) for use in ("learn", "stop", "judge")]
        memory = self._went_on(self._correction(name, physics), origin, 0, self.config.parts).memory
        fitted = fit_residual(origin.model, *sets, memory, self.config.residual, self.seed)
        card = {"kept": fitted.gain.promoted, "updates": fitted.updates, "stop": fitted.stop}
        card |= {"gain": asdict(fitted.gain), "learned_from": sets[0].provenance}
        with new_folder(out) as folder:
            save_tensors(folder / RESIDUAL, fitted.residual.state_dict())
            (folder / CARD).write_text(json.dumps(card, indent=1) + "\n")

    def replay(self, name: str) -> None:
        """Errors of the four arms' models on the recordings that judge, whether or not a residual is kept."""
        out = self.folder / name / "replay.csv"
        if out.exists():
            return
        tables = []
        for arm, (physics, learned) in ARMS.items():
            origin = self._model(name, physics)
            model = corrected(origin.model, self._residual(name, arm, origin) if learned else None)
            for what in ("readings", "truth"):
                own = self._measured(name, what, "judge")
                for horizon, errors in predicted_error(model, own, origin.frame.past).items():
                    about = {"rollout": own.recordings.ids, "motion": own.recordings.motions, "arm": arm}
                    tables.append(pd.DataFrame({**about, "by": what, "horizon": float(horizon), "error": errors}))
        write_csv(out, pd.concat(tables, ignore_index=True))

    def trained(self, name: str, arm: str) -> bool:
        """The arm's policy, through its model and the residual that was kept; False where the time was over before."""
        folder, (physics, learned) = self.folder / name / "policy" / arm, ARMS[arm]
        if (folder / "policy.pt").exists():
            return True
        env = self._env(self._correction(name, physics), self._clips(self.recorded), self.seed)
        origin, config = self._model(name, physics), self.config.learner
        residual = self._residual(name, arm, origin) if learned and self._kept(name, arm) else None
        trainer = ContinuedTrainer(env, config, folder, origin, residual, self.seed, pretrained.FOLDER)
        trainer.train(f"{name}, {arm}", self.over)
        if trainer.iteration < config.iterations:
            trainer.save_checkpoint()
            return False
        trainer.policy().save(folder)
        return True

    def tried(self, name: str, arm: str) -> None:
        """The arm's policy on the robot: motions that were recorded, and the others."""
        folder = self.folder / name / "policy" / arm
        if not (folder / TRIED).exists():
            names = [clip.name for clip in self.clips]
            judged = self._on_robot(name, folder, names, self.config.try_seed, True)
            others = [motion for motion in names if motion not in self.recorded]
            write_csv(folder / TRIED, judged_rows(judged, self.clips, others).assign(arm=arm, robot=name))

    @property
    def _every(self) -> int:
        return max(len(self.recorded) // self.config.trial_motions, 1)

    def _clips(self, names: list[str]) -> list[Clip]:
        by_name = {clip.name: clip for clip in self.clips}
        return [by_name[name] for name in names]

    def _on_robot(self, name: str, policy: Path, motions: list[str], seed: int, judged: bool) -> list[Rollout]:
        seed += self.seed
        episodes = [Episode(f"{motion}-{seed}", KEY, motion, seed) for motion in motions]
        robot = self.out / f"{name}.json"
        with tempfile.TemporaryDirectory() as scratch:
            own = exported(policy, Path(scratch) / "policy")
            return run_on_robot(own, robot, self._clips(motions), episodes, self.config.base, judged, 1)

    def _rollouts(self, name: str, what: str, uses: tuple[str, ...]) -> list[Rollout]:
        every = [read_rollout(file) for file in rollout_files(self.folder / name / what)]
        return [rollout for rollout in every if self.use[str(rollout.meta["motion"])] in uses]

    def _measured(self, name: str, what: str, use: str) -> Measured:
        """Stretches of recordings; of those too short for a window nothing is taken."""
        steps = max(self.config.residual.window, round(HORIZONS[-1] * 50)) + 4
        return measured(self._rollouts(name, what, (use,)), load_model(), 1 / 50, steps).to(self._device)

    @property
    def _device(self) -> str:
        return "cpu" if self.task.engine == "mujoco" else "cuda"

    def _correction(self, name: str, physics: bool) -> Correction:
        return Correction(self.folder / name / "diagnosis") if physics else DECLARED

    def _model_folder(self, name: str, physics: bool) -> Path:
        return self.folder / name / "model" if physics else self.folder / "declared"

    def _model(self, name: str, physics: bool) -> Parent:
        origin = Parent.load(self._model_folder(name, physics) / f"part-{self.config.parts - 1}")
        return Parent(origin.frame, origin.model.to(self._device))

    def _parts(self, folder: Path, correction: Correction, parent: Parent | None, parts: int) -> bool:
        """Train a model part by part; the same parts wherever a call ends."""
        for part in range(parts):
            out = folder / f"part-{part}"
            if out.exists():
                continue
            if self.over():
                return False
            before = folder / f"part-{part - 1}"
            own = Parent.load(before) if part else parent
            descent = load_checkpoint(before / "descent.pt") if part else None
            done = (part / parts, (part + 1) / parts)
            went = self._went_on(correction, own, self.config.part, part, descent, done)
            with new_folder(out) as made:
                went.parent.save(made)
                save_tensors(made / "descent.pt", went.descent)
                (made / CARD).write_text(json.dumps({"loss": went.loss}) + "\n")
        return True

    def _went_on(
        self,
        correction: Correction,
        parent: Parent | None,
        iterations: int,
        part: int,
        descent: dict | None = None,
        done: tuple[float, float] = (0.0, 1.0),
    ) -> Continued:
        seed = 1000 * self.seed + part
        env = self._env(correction, self._clips(self.recorded), seed)
        policy = self.policy.to(env.device)
        return continue_model(env, policy, self.config.learner, parent, iterations, descent, done, seed)

    def _env(self, correction: Correction, clips: list[Clip], seed: int) -> TrackingEnv:
        task, model = self.task, task_model(self.task, correction.model)
        engine = make_engine(task.engine, model, task.num_worlds, task.threads, correction.hooks(model), task.buffers)
        return TrackingEnv(MotionLibrary(clips, task.ahead, device=engine.device), engine, task, seed)

    def _residual(self, name: str, arm: str, origin: Parent) -> nn.Module:
        """The arm's residual, whether or not it is kept."""
        residual = new_residual(origin.model, self.config.residual.hidden)
        residual.load_state_dict(load_checkpoint(self.folder / name / arm / RESIDUAL))
        return residual.requires_grad_(False)

    def _kept(self, name: str, arm: str) -> bool:
        return bool(json.loads((self.folder / name / arm / CARD).read_text())["kept"])


def _write(folder: Path, rollouts: list[Rollout]) -> None:
    for rollout in rollouts:
        write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
