"""The loop over the wire: runs of a robot with sealed effects, their rollouts, and what the diagnosis finds in them."""

import argparse

from benchmarks.wire.common import clips, shipped
from bumblebee.measured.rollout import write_rollout
from bumblebee.robot.facts import ROBOT, joint_names
from bumblebee.robot.model import write_xml
from bumblebee.stand_in.sealed import declared_g1, entry
from bumblebee.stand_in.undeclared.kinds import KINDS, Place
from bumblebee.wire.robot_end.stand_in import prepared, records_of
from bumblebee.wire.rollouts import latency, rollout_of

MOTIONS = ["squat", "walk_slow", "reach_low_left", "march", "arm_circles", "kick_left"]
SEALED = (("coulomb_friction", "left_knee_joint", 4.0), ("encoder_offset", "left_shoulder_pitch_joint", 0.1))
DRAWN = {"sign": 1, "axis": 0, "number": 8, "other": "right_knee_joint"}


def run(options: argparse.Namespace) -> None:
    policy = shipped()
    effects = [
        entry(KINDS[kind], Place(declared_g1(), where, DRAWN, 0.0, 0.0, 0.0), size) for kind, where, size in SEALED
    ]
    for seed, clip in enumerate(clips(options.motions or MOTIONS)):
        done = prepared(policy, clip, effects, options.seed + seed)
        rows = records_of(done, done.entries())
        about = {"id": f"{clip.name}-{seed}", "joints": joint_names(), "control_hz": 50.0, "robot": ROBOT}
        rollout = rollout_of(
            about | {"motion": clip.name, "policy": {"name": "shipped", "sha256": policy.sha256}}, rows
        )
        write_rollout(options.out / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
        print(
            f"{clip.name}: {rollout.frames} of {clip.frames} rows, {done.guard.reason or 'to the end'}, {latency(rows)}"
        )
    write_xml(options.out / "model.xml")
    print(f"bumblebee diagnose {options.out}/model.xml {options.out} --out {options.out}/found")
