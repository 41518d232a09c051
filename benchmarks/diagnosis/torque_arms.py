"""A six-joint arm that logs torques, as industrial arms do: what the declared model lacks, found and tried.

    python -m benchmarks.diagnosis.torque_arms --out runs/torque_arms

The declared model is that of a drawing: links, no rotors, no friction. Beside these the truth has what each case says;
on most the wrist's last motor turns with two joints. Eight runs of 6 s follow sums of sines; two are held out. A line
of JSON a case: joint errors [mrad] on held-out runs after 0.02, 0.2 and 1 s (declared, corrected, noise), true sizes
found within 5 %, seconds. What is done stays in `results.jsonl`, the logs beside it.
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from benchmarks.from_a_drawing.arms import STIFF
from benchmarks.undeclared.__main__ import commit, read_lines
from bumblebee.diagnosis.dataset import open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.io.write import write_file
from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.sim.effects import Effect

JOINTS = tuple(f"j{k}" for k in range(1, 7))
ARMATURE = np.array([3.0, 3.0, 1.2, 0.3, 0.15, 0.06])
DRY = np.array([9.0, 12.0, 6.0, 2.2, 1.6, 0.6])
VISCOUS = np.array([15.0, 18.0, 8.0, 3.0, 1.2, 0.5])
STICTION = np.array([4.0, 5.0, 3.0, 1.0, 0.7, 0.3])
COUPLED = {"coupled_friction": 1.1, "coupled_damping": 0.9, "coupled_armature": 0.08}
_KP, _KD = np.array([4000, 4000, 2500, 600, 300, 120.0]), np.array([400, 400, 200, 50, 25, 10.0])
_LINKS = (
    ("0 0 1", "0 0 .3", 12.0, ".02 0 .1", ".15 .15 .08"),
    ("0 1 0", "0 0 .2", 14.0, ".03 .05 .2", ".25 .24 .05"),
    ("0 1 0", "0 0 .4", 8.0, ".02 .03 .1", ".06 .06 .03"),
    ("0 0 1", "0 0 .2", 4.0, "0 .02 .12", ".02 .02 .01"),
    ("0 1 0", "0 0 .25", 2.2, ".01 .02 .04", ".006 .006 .004"),
    ("0 0 1", "0 0 .1", 0.9, ".02 .01 .05", ".0012 .0012 .0008"),
)
_INNER = 0.0005  # [s] step of the truth
SECONDS, RUNS = 6, 8
NEAR = 0.05
HORIZONS = ("0.02", "0.2", "1.0")


@dataclass(frozen=True)
class Case:
    """One true arm."""

    rubs: bool = True
    """Whether its joints have friction and rotors that the declared model lacks; else the rotors are declared."""
    coupled: bool = True
    strength: tuple[float, ...] = (1.0,) * 6
    """Share of the logged torque that arrives."""
    masses: tuple[tuple[str, float], ...] = ()
    """Factors on links' masses and moments."""
    load: float = 0.0
    """Friction that goes with the torque."""
    stiction: float = 0.0
    """Friction at rest beside dry friction, in `STICTION`."""
    hz: int = 200
    differences: bool = False
    """Whether velocities are differences of the positions."""


CASES = {
    "coupled wrist alone": Case(rubs=False),
    "drawing": Case(coupled=False),
    "drawing, coupled wrist": Case(),
    "and velocities by differences, 100 Hz": Case(hz=100, differences=True),
    "and drives 5 to 10 % off": Case(strength=(1.08, 0.93, 1.05, 0.9, 1.1, 0.95)),
    "and friction with load, stiction": Case(load=0.08, stiction=1.0),
    "drawing, 1.35 kg in the hand": Case(coupled=False, masses=(("b6", 2.5),)),
    "drawing, four masses 10 to 20 % off": Case(
        coupled=False, masses=(("b2", 1.15), ("b3", 0.85), ("b4", 1.2), ("b5", 0.9))
    ),
}


def model_of(armature: np.ndarray, dry: np.ndarray, viscous: np.ndarray, coupled: bool = False) -> str:
    """MJCF of the arm with motors; `coupled`: with a motor that turns with j5 and j6."""
    bodies = "".join(
        f'<body name="b{k + 1}" pos="{pos}"><joint name="{JOINTS[k]}" axis="{axis}" armature="{armature[k]}" '
        f'frictionloss="{dry[k]}" damping="{viscous[k]}" {STIFF}/>'
        f'<inertial pos="{com}" mass="{mass}" diaginertia="{inertia}"/>'
        for k, (axis, pos, mass, com, inertia) in enumerate(_LINKS)
    )
    dry_, viscous_, armature_ = COUPLED.values()
    wrist = (
        f'<tendon><fixed name="m6" frictionloss="{dry_}" damping="{viscous_}" armature="{armature_}" {STIFF}>'
        '<joint joint="j5" coef="1"/><joint joint="j6" coef="1"/></fixed></tendon>'
    )
    motors = "".join(f'<motor name="{j}" joint="{j}" ctrlrange="-400 400"/>' for j in JOINTS)
    return (
        '<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/><worldbody>'
        f"{bodies}{'</body>' * len(_LINKS)}</worldbody>{wrist if coupled else ''}<actuator>{motors}</actuator></mujoco>"
    )


def truth_of(case: Case) -> mujoco.MjModel:
    """The true arm."""
    some = 1.0 if case.rubs else 0.0
    model = mujoco.MjModel.from_xml_string(model_of(ARMATURE, some * DRY, some * VISCOUS, case.coupled))
    model.opt.timestep = _INNER
    for body, factor in case.masses:
        model.body_mass[model.body(body).id] *= factor
        model.body_inertia[model.body(body).id] *= factor
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def run_of(model: mujoco.MjModel, case: Case, number: int) -> Rollout:
    """One run: a PD drive follows sums of three sines a joint, its torque is logged and held for a period."""
    rng, count = np.random.default_rng(100 + number), SECONDS * case.hz
    time_ = np.arange(count) / case.hz
    size, pace, phase = (
        rng.uniform(0.15, 0.4, (6, 3)),
        2 * np.pi * rng.uniform(0.2, 1.1, (6, 3)),
        rng.uniform(0, 2 * np.pi, (6, 3)),
    )
    target = (size * np.sin(pace * time_[:, None, None] + phase)).sum(axis=2)
    rate = (size * pace * np.cos(pace * time_[:, None, None] + phase)).sum(axis=2)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = target[0], rate[0]
    q, v, torque = np.empty((count, 6)), np.empty((count, 6)), np.empty((count, 6))
    dry = model.dof_frictionloss.copy()
    for k in range(count):
        q[k], v[k] = data.qpos, data.qvel
        torque[k] = _KP * (target[k] - data.qpos) + _KD * (rate[k] - data.qvel)
        data.ctrl[:] = np.array(case.strength) * torque[k]
        for _ in range(round(1 / case.hz / _INNER)):
            rest = case.stiction * STICTION * np.exp(-((data.qvel / 0.05) ** 2))
            model.dof_frictionloss[:] = dry + rest + case.load * np.abs(data.ctrl)
            mujoco.mj_step(model, data)
    model.dof_frictionloss[:] = dry
    q += 2e-5 * rng.standard_normal(q.shape)
    v = np.gradient(q, time_, axis=0) if case.differences else v + 2e-3 * rng.standard_normal(v.shape)
    return Rollout(f"r{number}", JOINTS, float(case.hz), time_, q, v, joint_torque_cmd=torque)


def true_sizes(case: Case) -> Iterator[tuple[str, str, float]]:
    """(effect, place, first parameter) of all that the declared model lacks and one number says."""
    for k, joint in enumerate(JOINTS):
        if case.rubs:
            yield "armature", joint, ARMATURE[k]
            yield "coulomb_friction", joint, DRY[k]
            yield "viscous_friction", joint, VISCOUS[k]
        if case.strength[k] != 1:
            yield "motor_strength", joint, case.strength[k]
        if case.load:
            yield "load_dependent_friction", joint, case.load
    for kind, size in COUPLED.items() if case.coupled else ():
        yield kind, "j6", size
    for body, factor in case.masses:
        yield "link_mass", body, factor * _LINKS[int(body[1:]) - 1][2]


def within(found: list[Effect], case: Case) -> tuple[int, int]:
    """How many true sizes were found within `NEAR`, and how many there are."""
    by_place = {(e.effect, e.where): e.value() for e in found}
    true = list(true_sizes(case))
    near = [abs(by_place.get((kind, (place,)), np.inf) / size - 1) < NEAR for kind, place, size in true]
    return int(sum(near)), len(true)


def measured(case: Case, folder: Path) -> dict[str, Any]:
    """Diagnose one case, whose logs are made where they are not there yet."""
    (folder / "rollouts").mkdir(parents=True, exist_ok=True)
    none, model = np.zeros(6), truth_of(case)
    for number in range(RUNS):
        if not (place := folder / "rollouts" / f"r{number}.parquet").exists():
            write_rollout(place, run_of(model, case, number))
    write_file(folder / "model.xml", model_of(none if case.rubs else ARMATURE, none, none))
    began = time.monotonic()
    result = diagnose(open_session(folder / "model.xml", folder))
    error = result.document["error"]
    near, true = within(result.effects, case)
    return {
        "seconds": round(time.monotonic() - began, 1),
        "near": near,
        "true": true,
        "found": len(result.effects),
        **{
            kind: {h: round(1e3 * error[kind][h]["joint_pos_rmse"]["value"], 3) for h in HORIZONS}
            for kind in ("before", "after", "floor")
        },
    }


def main() -> None:
    """Run the cases that are not done yet."""
    parser = argparse.ArgumentParser(prog="benchmarks.diagnosis.torque_arms", description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, required=True, help="Folder of logs and results.")
    options = parser.parse_args()
    mujoco.set_mju_user_warning(lambda text: None)
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / "results.jsonl"
    rows = read_lines(results) if results.exists() else []
    for number, (name, case) in enumerate(CASES.items()):
        if name not in {row["case"] for row in rows}:
            row = {"case": name, "commit": commit()} | measured(case, options.out / f"case_{number}")
            rows.append(row)
            write_file(results, "".join(json.dumps(one) + "\n" for one in rows))
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
