"""Arms whose declared model comes from a drawing: right masses and lengths, no rotor inertia, no friction.

    python -m benchmarks.from_a_drawing --limit 24 --workers 2 --out results.jsonl
    python -m benchmarks.from_a_drawing --table results.jsonl

Most models of real arms are made so. Every joint then errs at once and by factors, where the sealed benchmark
(`benchmarks.undeclared`) lacks one effect of a size that can just be seen. Drawn are the links, the drives (position
servos, or motors under a loop of the lab's own whose torque is logged), rotors of .2 to 5 times the joint's inertia,
dry and viscous friction, noise and rates; half of the arms have one thing more: late commands, gains that are not the
declared ones, or a load. The truth is plain MuJoCo at half a millisecond.
"""

import argparse
import json
import math
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

import mujoco
import numpy as np

from benchmarks.undeclared.__main__ import _quiet, commit, read_lines
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.measured.rollout import Rollout, write_rollout

HORIZONS = ("0.02", "0.2", "1.0")
MORE = ("nothing", "late commands", "other gains", "a load")
_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
_TRUE_STEP = 5e-4
_NEAR = 0.15
"""Relative error of a size that counts as found."""
_CLOSE = 2.0
"""Times the noise floor that a solved arm may be off."""


@dataclass(frozen=True)
class Joint:
    """A joint, its link and its drive; SI."""

    axis: str
    length: float
    mass: float
    armature: float = 0.0
    dry: float = 0.0
    viscous: float = 0.0
    kp: float = 0.0
    kd: float = 0.0
    limit: float = 0.0


@dataclass(frozen=True)
class Arm:
    """What was drawn."""

    joints: tuple[Joint, ...]
    servo: bool
    """Whether drives are position servos; else motors, and the lab's own loop at the log's rate."""
    hz: float
    noise: float
    """[rad] of the encoders."""
    more: str
    late: int
    """Ticks that commands are late."""
    gain: float
    """Factor on the true gains."""
    load: float
    """[kg] at the end."""


def draw(seed: int) -> Arm:
    """An arm of 2 to 6 joints."""
    rng = np.random.default_rng([19, seed])
    count, servo = int(rng.integers(2, 7)), bool(rng.random() < 0.7)
    hz = float(rng.choice([50, 100, 200])) if servo else 500.0
    sizes = [(float(rng.uniform(0.1, 0.4)), float(rng.uniform(0.5, 5.0) * 0.7**i)) for i in range(count)]
    bare = [Joint(_AXES[i], length, mass) for i, (length, mass) in enumerate(sizes)]
    model = mujoco.MjModel.from_xml_string(xml(bare, servo))
    data, inertia = mujoco.MjData(model), np.zeros((count, count))
    data.qpos[:] = 0.7
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    joints = []
    for i, link in enumerate(bare):
        own = max(float(inertia[i, i]), 1e-4)
        armature = own * float(np.exp(rng.uniform(math.log(0.2), math.log(5.0))))
        whole, frequency = own + armature, 2 * math.pi * float(rng.uniform(2.5, 6.0))
        held = 9.81 * sum(j.mass * sum(k.length for k in bare[i : n + 1]) for n, j in enumerate(bare) if n >= i)
        limit = 1.5 * held + 0.5 * whole * frequency**2
        kp, kd = whole * frequency**2, 2 * float(rng.uniform(0.5, 1.0)) * whole * frequency
        dry, viscous = float(rng.uniform(0.01, 0.05)) * limit, float(rng.uniform(0.0, 0.3)) * kd
        joints.append(replace(link, armature=armature, dry=dry, viscous=viscous, kp=kp, kd=kd, limit=limit))
    more = MORE[int(rng.integers(1, 4))] if rng.random() < 0.5 else MORE[0]
    if more == "other gains" and not servo:
        more = MORE[0]  # its own loop's gains are no part of the model
    return Arm(
        tuple(joints),
        servo,
        hz,
        float(np.exp(rng.uniform(math.log(5e-5), math.log(1e-3)))),
        more,
        int(rng.integers(1, 3)) if more == "late commands" else 0,
        float(2 ** rng.uniform(-1, 1)) if more == "other gains" else 1.0,
        float(rng.uniform(0.5, 1.5)) * joints[-1].mass if more == "a load" else 0.0,
    )


def xml(joints: Sequence[Joint], servo: bool, rotors: bool = False, gain: float = 1.0, load: float = 0.0) -> str:
    """MJCF of an arm; with `rotors` the true one: armature and friction, servos of `gain` times the gains, a load."""
    bodies, drives = "", ""
    for i, j in enumerate(joints):
        own = f' armature="{j.armature}" frictionloss="{j.dry}" damping="{j.viscous}"' if rotors else ""
        mass = j.mass + (load if i == len(joints) - 1 else 0.0)
        place = 'pos="0 0 1"' if i == 0 else f'pos="0 0 {joints[i - 1].length}"'
        bodies += f'<body name="link{i}" {place}><joint name="joint{i}" axis="{j.axis}"{own}/>'
        bodies += (
            f'<geom type="capsule" fromto="0 0 0 0 0 {j.length}" size=".03" mass="{mass}" contype="0" conaffinity="0"/>'
        )
        limit = f'forcerange="-{j.limit or 1} {j.limit or 1}"'
        if servo:
            drives += f'<position joint="joint{i}" kp="{gain * j.kp}" kv="{j.kd}" {limit}/>'
        else:
            drives += f'<motor joint="joint{i}" {limit}/>'
    step = _TRUE_STEP if rotors else 2e-3
    return (
        f'<mujoco><option timestep="{step}" integrator="implicitfast"/><worldbody>{bodies}{"</body>" * len(joints)}'
        f"</worldbody><actuator>{drives}</actuator></mujoco>"
    )


def rollouts(arm: Arm, seed: int, count: int = 8, seconds: float = 8.0) -> list[Rollout]:
    """What the true arm's logger writes."""
    rng, joints = np.random.default_rng([20, seed]), len(arm.joints)
    model = mujoco.MjModel.from_xml_string(xml(arm.joints, arm.servo, True, arm.gain, arm.load))
    kp, kd = np.array([j.kp for j in arm.joints]), np.array([j.kd for j in arm.joints])
    ticks, steps = round(seconds * arm.hz), round(1 / (arm.hz * _TRUE_STEP))
    time, names, made = np.arange(ticks) / arm.hz, tuple(f"joint{i}" for i in range(joints)), []
    for number in range(count):
        frequency, phase = rng.uniform(0.1, 1.2, (2, 4, joints)) * [[[1.0]], [[6.0]]]
        amplitude = rng.uniform(0.05, 0.3, (4, joints)) / (0.5 + frequency)
        target = rng.uniform(-0.5, 0.5, joints) + np.sum(
            amplitude * np.sin(2 * np.pi * frequency * time[:, None, None] + phase), axis=1
        )
        data = mujoco.MjData(model)
        data.qpos[:] = target[0]
        position, velocity, sent = np.zeros((3, ticks, joints))
        for k in range(-round(arm.hz / 2), ticks):  # half a second to come to rest at the first target
            sent[max(k, 0)] = target[max(k, 0)]
            if not arm.servo:
                sent[max(k, 0)] = kp * (target[max(k, 0)] - data.qpos) - kd * data.qvel
            position[max(k, 0)], velocity[max(k, 0)] = data.qpos, data.qvel
            data.ctrl[:] = sent[max(k - arm.late, 0)]
            for _ in range(steps):
                mujoco.mj_step(model, data)
        position += arm.noise * rng.standard_normal(position.shape)
        velocity += 0.2 * arm.noise * arm.hz * rng.standard_normal(velocity.shape)
        command = {"joint_target" if arm.servo else "joint_torque_cmd": sent}
        made.append(Rollout(f"run{number}", names, arm.hz, time, position, velocity, **command))
    return made


def run(seed: int) -> dict[str, Any]:
    """One arm, diagnosed: errors on held-out rollouts, sizes found, other names."""
    arm = draw(seed)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "rollouts").mkdir()
        (folder / "model.xml").write_text(xml(arm.joints, arm.servo))
        for rollout in rollouts(arm, seed):
            write_rollout(folder / "rollouts" / f"{rollout.rollout_id}.parquet", rollout)
        began = monotonic()
        document = diagnose(
            open_session(folder / "model.xml", folder), replace(DiagnosisConfig(), beyond=False)
        ).document
    found = {(e["effect"], *e["where"]): e for e in document["effects"]}
    sizes: dict[str, list[float]] = {"armature": [], "coulomb_friction": []}
    for i, joint in enumerate(arm.joints):
        for kind, key, true in (
            ("armature", "armature", joint.armature),
            ("coulomb_friction", "frictionloss", joint.dry),
        ):
            entry = found.get((kind, f"joint{i}"))
            value = entry["parameters"][key]["value"] if entry else 0.0
            sizes[kind].append(round(value / true - 1.0, 4))
    errors = {
        h: [document["error"][k][h]["joint_pos_rmse"]["value"] for k in ("before", "after", "floor")] for h in HORIZONS
    }
    return {
        "seed": seed,
        "joints": len(arm.joints),
        "servo": arm.servo,
        "hz": arm.hz,
        "noise": arm.noise,
        "more": arm.more,
        "errors": errors,
        "sizes": sizes,
        "named": [[e["effect"], *e["where"], round(e["explains"], 4)] for e in document["effects"]],
        "seconds": round(monotonic() - began, 1),
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Medians over arms, shares with their counts."""
    more = ", ".join(f"{sum(r['more'] == m for r in rows)} with {m} more" for m in MORE)
    out = [f"{len(rows)} arms: {more}"]
    for h in HORIZONS:
        before, after, floor = np.array([r["errors"][h] for r in rows], float).T * 1e3
        solved = int((after <= _CLOSE * floor).sum())
        medians = [float(np.median(values)) for values in (before, after, floor)]
        out.append(
            f"after {h} s: median declared {medians[0]:.3g}, corrected {medians[1]:.3g}, noise {medians[2]:.3g} mrad; "
            f"largest corrected {after.max():.3g}; within {_CLOSE:g} times the noise {solved} of {len(rows)}"
        )
    for kind in ("armature", "coulomb_friction"):
        errors = np.abs(np.concatenate([r["sizes"][kind] for r in rows]))
        near = int((errors <= _NEAR).sum())
        out.append(f"{kind}: {near} of {len(errors)} within {_NEAR:.0%}, median error {np.median(errors):.1%}")
    out.append(
        f"seconds: median {np.median([r['seconds'] for r in rows]):.0f}, most {max(r['seconds'] for r in rows):.0f}"
    )
    return "\n".join(out)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run arms that the file does not hold yet, or print its table."""
    parser = argparse.ArgumentParser(prog="benchmarks.from_a_drawing", description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--limit", type=int, default=24, help="seeds from there on")
    parser.add_argument("--workers", type=int, default=1, help="processes, one core each")
    parser.add_argument("--out", type=Path, default=Path("from_a_drawing.jsonl"), help="file of results, appended to")
    parser.add_argument("--table", type=Path, help="print the table of a file of results and end")
    options = parser.parse_args(arguments)
    if options.table:
        print(table(read_lines(options.table)))
        return
    done = {row["seed"] for row in read_lines(options.out)} if options.out.exists() else set()
    left = [seed for seed in range(options.first, options.first + options.limit) if seed not in done]
    with options.out.open("a") as out, ProcessPoolExecutor(options.workers, initializer=_quiet) as pool:
        for future in as_completed([pool.submit(run, seed) for seed in left]):
            row = {"commit": commit()} | future.result()
            out.write(json.dumps(row) + "\n")
            out.flush()
            errors = "; ".join(f"{h} s {' '.join(f'{1e3 * e:.3g}' for e in row['errors'][h])}" for h in HORIZONS[1:])
            print(
                f"{row['seed']:3d} {row['joints']} joints, {row['more']}: {errors} mrad [{row['seconds']:.0f} s]",
                flush=True,
            )


if __name__ == "__main__":
    main()
