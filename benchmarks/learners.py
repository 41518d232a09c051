"""Both learners refine the shipped policy in a simulator that differs from the declared one, at equal CPU time.

    OMP_NUM_THREADS=1 python -m benchmarks.learners --learner ppo --seeds 0 1 --seconds 100 --out ppo.jsonl
    OMP_NUM_THREADS=1 python -m benchmarks.learners --learner world_model --seeds 0 1 --seconds 100 --out model.jsonl

PPO has the settings of `refine` in params.yaml, the other learner those of profiles/world_model.yaml. `--robot knee`:
its left knee has half its strength, its torso is 6 kg heavier, and hips and knees have dry friction of 6 N m. `--robot
demo`: the declared robot with the three effects that the demo's diagnosis names (README). Time is this process's own,
of one thread, setting up and trying excluded.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import torch

from benchmarks.baselines.methods import changed
from bumblebee.learning import pretrained
from bumblebee.learning.learners import make_learner
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.trial import Trials, World, try_policy
from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded import make_library
from bumblebee.motion.filters.rules import filter_clips
from bumblebee.sim.effects import add_to_spec, runtime_hooks, single
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model, load_spec
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.sampling.library import MotionLibrary
from tasks.refine import RefineConfig
from tasks.settings import params

HOME = Path(__file__).parents[1]
DEMO = [
    single("joint_spring", "waist_pitch_joint", 28.9, 0.00948),
    single("torque_limit", "right_hip_roll_joint", 2.24),
    single("encoder_offset", "left_ankle_pitch_joint", -0.25),
]
_ENDLESS = 10**9


def named_by_the_demo(physics_hz: float) -> World:
    """The model that the demo refines in."""
    spec = load_spec(physics_hz=physics_hz)
    add_to_spec(spec, DEMO)
    model = spec.compile()
    return World(model, runtime_hooks(DEMO, model), threads=1)


def weak_knee(physics_hz: float) -> World:
    """The declared robot with a weak knee, a heavy torso and dry friction."""
    model = load_model(physics_hz=physics_hz)
    weak = model.actuator("left_knee_joint").id
    for field in (model.actuator_forcerange, model.actuator_gainprm, model.actuator_biasprm):
        field[weak] *= 0.5
    model.body("torso_link").mass[0] += 6.0
    for joint in range(1, model.njnt):
        if any(part in model.joint(joint).name for part in ("hip", "knee")):
            model.dof_frictionloss[model.jnt_dofadr[joint]] = 6.0
    return World(model, threads=1)


ROBOTS: dict[str, Callable[[float], World]] = {"knee": weak_knee, "demo": named_by_the_demo}


def settings(learner: str, changes: Sequence[str] = ()) -> RefineConfig:
    """Those of the stage `refine`, on one thread, with single ones changed (`world_model.policy_rate=0.0005`)."""
    file = HOME / "params.yaml" if learner == "ppo" else HOME / "profiles" / "world_model.yaml"
    config = params.section_of(params.read(file), "refine", RefineConfig, file)
    return changed(replace(config, env=replace(config.env, threads=1)), list(changes))


def refined(
    learner: str, clips: list[Clip], world: World, seconds: float, seed: int, changes: Sequence[str] = ()
) -> tuple[Policy, int]:
    """The shipped policy after so many seconds of training, and the control steps that it saw."""
    config = settings(learner, changes)
    engine = make_engine("mujoco", world.model, config.env.num_worlds, 1, world.hooks)
    env = TrackingEnv(MotionLibrary(clips, config.env.ahead), engine, config.env, seed)
    endless = replace(config.algorithm, iterations=_ENDLESS, checkpoint_every=_ENDLESS)
    with tempfile.TemporaryDirectory() as folder:
        trainer = make_learner(endless, env, Path(folder), seed, pretrained.FOLDER)
        began = time.process_time()

        def enough() -> bool:
            spent = time.process_time() - began
            if trainer.iteration:  # rates and curriculum follow the share of the iterations that is done
                whole = max(round(trainer.iteration * seconds / spent), trainer.iteration + 1)
                trainer.config = replace(trainer.config, iterations=whole)
            return spent >= seconds

        trainer.train(learner, enough)
        return trainer.policy(), trainer.frames


def tried(policy: Policy, clips: list[Clip], world: World) -> dict[str, float]:
    """Success and error [m] of the key bodies on the wrong robot, all motions twice with noisy starts and sensors."""
    trials = try_policy(policy, clips, world, settings("ppo").env.ahead, Trials(repeats=2, noise=1.0))
    return {"success": float(trials["success"].mean()), "key_error": float(trials["key_error"].mean())}


def main() -> None:
    """Train, try, and add a line of JSON for each seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learners", description=__doc__.splitlines()[0])
    parser.add_argument("--learner", choices=("ppo", "world_model"), required=True)
    parser.add_argument("--robot", choices=ROBOTS, default="knee")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--seconds", type=float, default=120.0, help="of CPU time, each")
    parser.add_argument("--out", type=Path, required=True, help="file to add lines to")
    parser.add_argument("--set", nargs="*", default=[], metavar="PATH=VALUE")
    options = parser.parse_args()
    torch.set_num_threads(1)
    world = ROBOTS[options.robot](settings("ppo").env.physics_hz)
    clips = filter_clips(make_library())[0]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    before = tried(load_policy(pretrained.FOLDER), clips, world)
    for seed in options.seeds:
        learned = [clip for clip in clips if clip.split == "train"]
        policy, frames = refined(options.learner, learned, world, options.seconds, seed, options.set)
        given = {name: getattr(options, name) for name in ("learner", "robot", "seconds", "set")}
        row = given | {"seed": seed, "frames": frames}
        row |= {"before": before, "after": tried(policy, clips, world)}
        with options.out.open("a") as file:
            file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
