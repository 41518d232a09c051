"""Robots whose declared model comes from a drawing: right masses and lengths, no rotor inertia, no friction.

    python -m benchmarks.from_a_drawing --limit 24 --workers 2 --out arms.jsonl
    python -m benchmarks.from_a_drawing --robot stand --limit 4 --workers 2 --out stand.jsonl
    python -m benchmarks.from_a_drawing --robot track --policy FOLDER --limit 4 --workers 2 --out track.jsonl
    python -m benchmarks.from_a_drawing --table arms.jsonl

Most models of real robots are made so. Every joint then errs at once and by factors, where the sealed benchmark
(`benchmarks.undeclared`) lacks one effect of a size that can just be seen. Drawn are, for an arm, the links, the
drives, rotors of .2 to 5 times the joint's inertia, dry and viscous friction, noise and rates; for the G1 its rotors
and frictions. Half of them have one thing more: late commands, gains that are not the declared ones (arms), or a load.
"""

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import Any

from benchmarks.from_a_drawing import arms, humanoid
from benchmarks.from_a_drawing.table import HORIZONS, table
from benchmarks.undeclared.__main__ import _quiet, commit, read_lines
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.diagnose import diagnose

_PARAMETER = {"armature": "armature", "coulomb_friction": "frictionloss"}


def run(seed: int, robot: str = "arm", policy: Path | None = None) -> dict[str, Any]:
    """One robot, diagnosed: errors on held-out rollouts, sizes found relative to the true ones, what was named.

    A robot that fell at once, or a diagnosis that ended in an error, is a row of its own with `failed`.
    """
    try:
        return _run(seed, robot, policy)
    except Exception as error:  # of this robot, not of the run
        return {"seed": seed, "robot": robot, "failed": f"{type(error).__name__}: {error}"[:300]}


def _run(seed: int, robot: str, policy: Path | None) -> dict[str, Any]:
    case = arms.case(seed) if robot == "arm" else humanoid.case(seed, robot, policy)
    began = monotonic()
    document = diagnose(case.session, replace(DiagnosisConfig(), beyond=False)).document
    found = {(e["effect"], *e["where"]): e for e in document["effects"]}
    declared = case.session.plant.model
    sizes: dict[str, list[float]] = {}
    for kind, truths in case.sizes.items():
        sizes[kind] = []
        for joint, true in truths.items():
            dof = int(declared.joint(joint).dofadr[0])
            nominal = declared.dof_armature[dof] if kind == "armature" else declared.dof_frictionloss[dof]
            entry = found.get((kind, joint))
            value = entry["parameters"][_PARAMETER[kind]]["value"] if entry else float(nominal)
            sizes[kind].append(round(value / true - 1.0, 4))
    errors = {
        h: [document["error"][k][h]["joint_pos_rmse"]["value"] for k in ("before", "after", "floor")] for h in HORIZONS
    }
    named = [[e["effect"], *e["where"], round(e["explains"] or 0.0, 4)] for e in document["effects"]]
    seconds = round(monotonic() - began, 1)
    return {"seed": seed, **case.row, "errors": errors, "sizes": sizes, "named": named, "seconds": seconds}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run robots that the file does not hold yet, or print its table."""
    parser = argparse.ArgumentParser(prog="benchmarks.from_a_drawing", description=__doc__.splitlines()[0])
    parser.add_argument("--robot", choices=("arm", *humanoid.ROBOTS), default="arm")
    parser.add_argument("--policy", type=Path, help="folder of an exported policy, where the G1 tracks motions")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--limit", type=int, default=24, help="seeds from there on")
    parser.add_argument("--workers", type=int, default=1, help="processes, one core each")
    parser.add_argument("--out", type=Path, default=Path("from_a_drawing.jsonl"), help="file of results, appended to")
    parser.add_argument("--table", type=Path, help="print the table of a file of results and end")
    options = parser.parse_args(arguments)
    if options.table:
        print(table(read_lines(options.table)))
        return
    if options.robot == "track" and not (options.policy and (options.policy / "policy.onnx").is_file()):
        came = "none came" if options.policy is None else f"none in {options.policy}"
        parser.error(f"--robot track: --policy expected, a folder with policy.onnx and contract.json; {came}")
    done = (
        {(row.get("robot", "arm"), row["seed"]) for row in read_lines(options.out)} if options.out.exists() else set()
    )
    seeds = range(options.first, options.first + options.limit)
    left = [seed for seed in seeds if (options.robot, seed) not in done]
    with options.out.open("a") as out, ProcessPoolExecutor(options.workers, initializer=_quiet) as pool:
        for future in as_completed([pool.submit(run, seed, options.robot, options.policy) for seed in left]):
            row = {"commit": commit()} | future.result()
            out.write(json.dumps(row) + "\n")
            out.flush()
            print(brief(row), flush=True)


def brief(row: dict[str, Any]) -> str:
    """One line for the terminal."""
    if "failed" in row:
        return f"{row['robot']} {row['seed']}: {row['failed']}"
    errors = "; ".join(f"{h} s {' '.join(f'{1e3 * e:.3g}' for e in row['errors'][h])}" for h in HORIZONS[1:])
    return (
        f"{row['robot']} {row['seed']}: {row['joints']} joints, {row['more']}: {errors} mrad [{row['seconds']:.0f} s]"
    )


if __name__ == "__main__":
    main()
