"""Cross-validation of a diagnosis beside `mujoco.sysid`, which is told the right parameters.

    python -m benchmarks.diagnosis.beside_sysid model.xml dataset --parameters coulomb_friction viscous_friction armature motor_strength

In every fold both are given the same rollouts; the diagnosis finds out by itself what the model lacks, `mujoco.sysid`
fits the named parameters of every joint by least squares of simulated against measured readings, over windows as long
and as many as the diagnosis has, each signal in units of what the declared model leaves. Judged by rollouts that neither
has seen: restarted windows, root mean square of the joint angles at their ends.
"""  # noqa: E501

import argparse
import contextlib
import io
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import mujoco.sysid
import numpy as np

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session, motion_names, open_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.replay import replay
from bumblebee.diagnosis.simulation import choose_starts, cut, residuals, vary
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.measured.rollout import read_rollout, rollout_files
from bumblebee.sim.effects import Effect

HORIZONS = ("0.02", "0.2", "1.0")
DECLARED, FOUND, SYSID = METHODS = ("declared", "diagnosis", "mujoco.sysid")


@dataclass(frozen=True)
class Kind:
    """A number that every joint has."""

    name: str
    """Name of the effect's parameter."""
    start: float
    most: float


KINDS = {
    "coulomb_friction": Kind("frictionloss", 0.05, 20.0),
    "viscous_friction": Kind("damping", 0.05, 20.0),
    "armature": Kind("armature", 0.002, 2.0),
    "motor_strength": Kind("factor", 1.0, 5.0),
    "kp": Kind("factor", 1.0, 5.0),
    "kd": Kind("factor", 1.0, 20.0),
}


def folds(names: Sequence[str], motions: Sequence[str], count: int) -> list[list[str]]:
    """Names of the rollouts that each fold holds out, evenly over their order; repeats of a motion in one fold."""
    parts: list[list[str]] = [[] for _ in range(count)]
    for name, motion in zip(names, motions, strict=True):
        parts[motions.index(motion) % count].append(name)
    return parts


def part(model: Path, dataset: Path, keep: Sequence[str], folder: Path) -> Session:
    """The session of some of a dataset's rollouts."""
    (folder / "rollouts").mkdir(parents=True)
    for file in rollout_files(dataset):
        if file.stem in keep:
            shutil.copy(file, folder / "rollouts" / file.name)
    return open_session(model, folder)


def parameters(joints: Sequence[str], kinds: Sequence[str]) -> mujoco.sysid.ParameterDict:
    """One number a kind and joint, with its start and bounds."""
    table = mujoco.sysid.ParameterDict()
    for kind in kinds:
        for joint in joints:
            own = KINDS[kind]
            table.add(mujoco.sysid.Parameter(f"{kind} {joint}", own.start, 0.0, own.most))
    return table


def effects_of(table: mujoco.sysid.ParameterDict) -> list[Effect]:
    """The parameters as effects of the catalogue."""
    found = []
    for name, parameter in table.items():
        kind, joint = name.split(" ", 1)
        found.append(Effect(kind, (joint,), {KINDS[kind].name: float(np.ravel(parameter.value)[0])}))
    return found


def identified(session: Session, kinds: Sequence[str], windows: int, horizon: float) -> list[Effect]:
    """Effects that `mujoco.sysid` makes of a session's rollouts, all of them."""
    plant, layout, step = session.plant, session.layout, session.steps[0]
    starts = choose_starts(session.rollouts, list(range(len(session.rollouts))), horizon, windows)
    cuts = cut(plant, layout, session.rollouts, starts)
    declared = residuals(plant, layout, cuts, [vary(plant, [])], step)[0]
    size = np.maximum(np.sqrt(np.nanmean(declared**2, axis=(0, 1))), session.sigma)
    worst = 10.0 * np.abs(np.nan_to_num(declared)).max(axis=(0, 1)) / size

    def left(x: np.ndarray, table: mujoco.sysid.ParameterDict) -> tuple[list[np.ndarray], None, None]:
        columns = np.atleast_2d(np.asarray(x).T if np.ndim(x) > 1 else x)
        variations = []
        for values in columns:
            table.update_from_vector(values)
            variations.append(vary(plant, effects_of(table)))
        raw = residuals(plant, layout, cuts, variations, step) / size
        flat = np.clip(np.where(np.isfinite(raw), raw, worst), -worst, worst).reshape(len(columns), -1)
        return [flat[0] if np.ndim(x) == 1 else flat.T], None, None

    table = parameters(plant.joints, kinds)
    with contextlib.redirect_stdout(io.StringIO()):  # it prints every iteration
        found, _ = mujoco.sysid.optimize(table, left, optimizer="mujoco", max_iters=30)
    return effects_of(found)


def judged(session: Session, effects: Sequence[Effect]) -> dict[str, float]:
    """Horizon -> root mean square error of the joint angles on all rollouts of a session."""
    errors = replay(session, effects)
    return {h: errors[h]["joint_pos_rmse"]["value"] for h in HORIZONS if h in errors}


def run(options: argparse.Namespace) -> None:
    """Print a row a fold and method, and the means."""
    files = sorted(rollout_files(options.dataset))
    names = [file.stem for file in files]
    if options.folds < 2:
        raise BadInput("--folds", "at least 2", str(options.folds))
    if len(names) < 2 * options.folds:
        raise BadInput(options.dataset, f"at least {2 * options.folds} rollouts", str(len(names)), "Say --folds.")
    mujoco.set_mju_user_warning(lambda text: None)
    config = replace(DiagnosisConfig(), max_windows=options.max_windows)
    rows: dict[str, list[dict[str, float]]] = {method: [] for method in METHODS}
    motions = motion_names([read_rollout(file) for file in files], config.thresholds.dataset.split)
    for k, held_out in enumerate(folds(names, motions, options.folds)):
        with tempfile.TemporaryDirectory() as scratch:
            rest = [name for name in names if name not in held_out]
            session = part(options.model, options.dataset, rest, Path(scratch) / "fitted")
            other = part(options.model, options.dataset, held_out, Path(scratch) / "held-out")
            clock = [time.process_time()]
            found = diagnose(session, config)
            clock.append(time.process_time())
            fitted = identified(session, options.parameters, config.max_windows, config.horizon)
            clock.append(time.process_time())
            sets = {DECLARED: [], FOUND: found.effects, SYSID: fitted}
            for method, effects in sets.items():
                rows[method].append(judged(other, effects))
                print(f"fold {k} {method}: {_told(rows[method][-1])}", flush=True)
            print(f"fold {k}: {clock[1] - clock[0]:.0f} s and {clock[2] - clock[1]:.0f} s of a processor", flush=True)
            for method in (FOUND, SYSID):
                print(
                    f"  {method}: {'; '.join(f'{e.effect} {e.where} {_values(e)}' for e in sets[method])}", flush=True
                )
    for method, own in rows.items():
        means = {h: float(np.sqrt(np.mean([row[h] ** 2 for row in own]))) for h in HORIZONS if all(h in r for r in own)}
        print(f"all folds {method}: {_told(means)}", flush=True)


def _told(errors: dict[str, float]) -> str:
    return ", ".join(f"{1e3 * value:.2f} mrad after {h} s" for h, value in errors.items())


def _values(effect: Effect) -> dict[str, float]:
    return {name: round(v, 4) for name, v in effect.parameters.items() if isinstance(v, (int, float))}


def main(arguments: list[str] | None = None) -> None:
    """Run it; bad input is one line and status 2."""
    parser = argparse.ArgumentParser(prog="benchmarks.diagnosis.beside_sysid", description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--parameters", nargs="+", choices=KINDS, required=True, help="that mujoco.sysid fits")
    parser.add_argument("--folds", type=int, default=3)
    parser.add_argument("--max-windows", type=int, default=120)
    try:
        run(parser.parse_args(arguments))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
