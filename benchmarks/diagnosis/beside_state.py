"""The diagnosis of this state of the code beside another's: names, intervals, errors and processor time, case by case.

    git worktree add ../before COMMIT
    python -m benchmarks.diagnosis.beside_state OUT --other ../before --seed N [--robot arm ...] [--cases 40]
    python -m benchmarks.diagnosis.beside_state OUT --table

Cases of the sealed benchmark (single effects, pairs, triples, nulls, effects outside the catalogue) are drawn here and
written as datasets; either state diagnoses each by its own command with its own defaults, one core, one after the
other. Kinds that `--without` names are left out: those that the other state does not know. What is done stays in
OUT/results.jsonl.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import mujoco
import numpy as np

from benchmarks.diagnosis.diagnosis_cost import cost
from benchmarks.diagnosis.same_documents import single_threads
from benchmarks.undeclared.__main__ import commit, read_lines
from benchmarks.undeclared.draw import Drawn, draw
from benchmarks.undeclared.judge import score
from benchmarks.undeclared.lottery import Case, Suite
from benchmarks.undeclared.rivals.common import error_of
from benchmarks.undeclared.sight import problem_of
from benchmarks.undeclared.stats import bootstrap, wilson
from bumblebee.diagnosis.dataset import make_session
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.io.write import write_file
from bumblebee.measured.rollout import write_rollout
from bumblebee.sim.effects import read_effects
from bumblebee.stand_in.undeclared.kinds import KINDS

STATES = ("before", "now")
GROUPS = ("single", "pair", "triple", "null", "outside")
_WINDOWS = 60  # that judge
_HERE = Path(__file__).resolve().parents[2]


def cases(seed: int, robots: Sequence[str], without: Sequence[str]) -> Iterator[Case]:
    """Cases of the suite with `seed` of these robots and without these kinds, in the suite's order."""
    for case in Suite(seed).cases():
        if case.robot in robots and not set(case.kinds) & set(without):
            yield case


def write_case(folder: Path, drawn: Drawn) -> None:
    """A case as a user has it: the declared model and its rollouts."""
    (folder / "rollouts").mkdir(parents=True, exist_ok=True)
    for rollout in drawn.shown:
        place = folder / "rollouts" / f"{rollout.rollout_id}.parquet"
        if not place.exists():
            write_rollout(place, rollout)
    write_file(folder / "model.xml", drawn.robot.spec.to_xml())


def diagnosed(tree: Path, folder: Path, out: Path) -> tuple[dict[str, Any], float]:
    """`out`/diagnosis.json by the code in `tree`, empty where it broke, and the processor's seconds."""
    python = ["env", f"PYTHONPATH={tree}", sys.executable, "-P"]  # -P: this checkout does not come before the tree
    command = [*python, "-m", "bumblebee", "diagnose", str(folder / "model.xml"), str(folder)]
    try:
        _, seconds, _ = cost([*command, "--overwrite", "--out", str(out)])
    except CalledProcessError:
        return {"effects": [], "unexplained": {}, "broke": True}, float("nan")
    return json.loads((out / "diagnosis.json").read_text()), seconds


def compare(case: Case, seed: int, trees: dict[str, Path], folder: Path) -> dict[str, Any]:
    """One line of results."""
    drawn = draw(case, seed)
    write_case(folder, drawn)
    line: dict[str, Any] = {"case": case.number, "robot": case.robot, "group": case.group, "kinds": list(case.kinds)}
    line |= {"seed": seed, "commit": commit(), "ratio": case.ratio, "rollouts": case.rollouts, "truth": drawn.truth}
    shown, judge = (make_session(drawn.robot.spec.copy(), r, drawn.robot.name, "lottery") for r in
                    (drawn.shown, drawn.judge))  # fmt: skip
    problem = problem_of(judge, range(len(judge.rollouts)), _WINDOWS, shown.sigma)
    line["declared"] = error_of([])(problem)
    for state, tree in trees.items():
        out = folder.with_name(f"{folder.name}-{state}")
        document, seconds = diagnosed(tree, folder, out)
        effects = read_effects(out / "effects.yaml") if "broke" not in document else []
        line[state] = score(drawn.truth, document) | {"seconds": seconds, "error": error_of(effects)(problem)}
        line[state]["broke"] = "broke" in document
    return line


def run(options: argparse.Namespace) -> None:
    """Cases that OUT does not hold yet."""
    trees = dict(zip(STATES, (options.other.resolve(), _HERE), strict=True))
    if not (trees["before"] / "bumblebee").is_dir():
        raise BadInput(f"--other {options.other}", "a checkout of another state", "no folder bumblebee in it")
    options.out.mkdir(parents=True, exist_ok=True)
    results = options.out / "results.jsonl"
    rows = read_lines(results) if results.exists() else []
    done = {(row["seed"], row["case"]) for row in rows}
    for robot in options.robot:
        for case in list(cases(options.seed, [robot], options.without))[: options.cases]:
            if (options.seed, case.number) in done:
                continue
            line = compare(case, options.seed, trees, options.out / f"{options.seed}-{case.number:04d}")
            rows.append(line)
            write_file(results, "".join(json.dumps(row) + "\n" for row in rows))
            told = ", ".join(f"{state} {line[state]['named']} in {line[state]['seconds']:.0f} s" for state in STATES)
            print(f"{case.number} {case.robot} {'+'.join(case.kinds) or case.group}: {told}", flush=True)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Both states by robot and group, with 95 % intervals; ratios are now / before, geometric means.

    Effects outside the catalogue have no name: of them those that were flagged are counted.
    """
    lines = ["| robot, group | cases | named first, before | now | strange names, before | now | error | time |"]
    lines.append("|---" * 8 + "|")
    keys = sorted({(row["robot"], row["group"]) for row in rows}, key=lambda k: (k[0], GROUPS.index(k[1])))
    for robot, group in keys:
        some = [row for row in rows if (row["robot"], row["group"]) == (robot, group)]
        names = [_first(some, state) if group != "null" else "" for state in STATES]
        strange = [str(sum(row[state]["spurious"] for row in some)) for state in STATES]
        ratios = [_ratio(some, lambda row, state, key=key: row[state][key]) for key in ("error", "seconds")]
        lines.append("| " + " | ".join([f"{robot}, {group}", str(len(some)), *names, *strange, *ratios]) + " |")
    sizes = {state: [s for row in rows for s in row[state]["sizes"]] for state in STATES}
    told = [f"{state} {_share([s['covered'] for s in sizes[state]])}" for state in STATES]
    return "\n".join([*lines, "", f"Intervals that cover the true size: {', '.join(told)}."])


def _first(rows: Sequence[dict[str, Any]], state: str) -> str:
    return _share(
        [row[state]["outside"]["flagged"] if row["group"] == "outside" else row[state]["top"] for row in rows]
    )


def _share(hits: Sequence[bool]) -> str:
    low, high = wilson(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} [{low:.2f}, {high:.2f}]"


def _ratio(rows: Sequence[dict[str, Any]], value: Callable[[dict[str, Any], str], float]) -> str:
    logs = [np.log(value(row, "now") / value(row, "before")) for row in rows]
    logs = [x for x in logs if np.isfinite(x)]
    if not logs:
        return "-"
    low, high = np.exp(bootstrap(logs, np.mean))
    return f"{np.exp(np.mean(logs)):.2f} [{low:.2f}, {high:.2f}]"


def main(argv: list[str] | None = None) -> int:
    """Run or tabulate; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.diagnosis.beside_state",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("out", type=Path, help="folder of datasets and results")
    parser.add_argument("--table", action="store_true", help="print the table of what is there")
    parser.add_argument("--other", type=Path, help="a checkout of the other state")
    parser.add_argument("--seed", type=int, default=1, help="the suite's seed")
    parser.add_argument("--robot", nargs="+", default=["arm"], choices=("arm", "stand"), help="robots, in turn")
    parser.add_argument("--cases", type=int, default=40, help="cases a robot, from the first on")
    parser.add_argument(
        "--without", nargs="*", default=[], choices=sorted(KINDS), metavar="KIND", help="kinds that are left out"
    )
    options = parser.parse_args(argv)
    try:
        if options.table:
            print(table(read_lines(options.out / "results.jsonl")))
            return 0
        if options.other is None:
            raise BadInput("--other", "a checkout of the other state", "none")
        mujoco.set_mju_user_warning(lambda text: None)
        single_threads()
        run(options)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


if __name__ == "__main__":
    sys.exit(main())
