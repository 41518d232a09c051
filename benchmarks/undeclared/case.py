"""One case from draw to a line of results."""

import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.undeclared.draw import Drawn, draw
from benchmarks.undeclared.judge import achieved, score
from benchmarks.undeclared.lottery import Case
from benchmarks.undeclared.rivals import delta, fit_everything, oracle, pace, ridge
from benchmarks.undeclared.rivals.common import error_of
from benchmarks.undeclared.sight import problem_of
from bumblebee.diagnosis.dataset import Session, make_session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.residuals import Problem
from bumblebee.errors import BadInput

_JUDGED, _FITTED = 60, 40  # windows


def run_case(case: Case, seed: int, policy: Path | None = None) -> dict[str, Any]:
    """Draw, diagnose, score; what goes wrong is in the line under `failed`."""
    line: dict[str, Any] = {
        "case": case.number, "robot": case.robot, "group": case.group, "kinds": list(case.kinds),
        "wanted_ratio": case.ratio, "noise": case.noise, "rollouts": case.rollouts,
    }  # fmt: skip
    began = time.monotonic()
    try:
        drawn = draw(case, seed, policy)
        line |= {"truth": drawn.truth, "draw_seconds": round(time.monotonic() - began, 2)}
        line |= {"ticks": [r.frames for r in drawn.shown], "judge_ticks": [r.frames for r in drawn.judge]}
        if not drawn.shown or not drawn.judge:
            return line | {"skipped": "every robot fell at once"}
        line |= _methods(case, drawn, seed)
    except Exception as error:  # a case that breaks is a result, too: of this case, not of the run
        line["failed"] = f"{type(error).__name__}: {error}"[:300]
        line["trace"] = traceback.format_exc(limit=-3)[-900:]
    return line


def _methods(case: Case, drawn: Drawn, seed: int) -> dict[str, Any]:
    """Ours, the oracle, and the rivals where the case has them."""
    line: dict[str, Any] = {}
    session = _session(drawn, drawn.shown)
    began = time.monotonic()
    try:
        found = diagnose(session)
        document, effects = found.document, found.effects
    except Exception as error:  # counts as a diagnosis that named nothing: it must not leave the table
        document, effects = {"effects": [], "unexplained": {}}, []
        line["broke"] = f"{type(error).__name__}: {error}"[:300]
    line["ours"] = score(drawn.truth, document) | {"seconds": round(time.monotonic() - began, 2)}
    line["smallest"] = [_smallest(t, document) for t in drawn.truth]
    line["effects"] = [_brief(e) for e in document["effects"]]
    line["unexplained"] = document["unexplained"]
    judge = _session(drawn, drawn.judge)
    problem = problem_of(judge, range(len(judge.rollouts)), _JUDGED, session.sigma)
    before, after = error_of([])(problem), error_of(effects)(problem)
    errors = {"before": before, "ours": after}
    best = oracle.run(drawn.robot, drawn.truth)
    try:
        errors |= {"oracle": best.error(problem)} if best is not None else {}
    except (BadInput, ValueError, KeyError, NotImplementedError) as error:
        line["oracle_failed"] = f"{type(error).__name__}: {error}"[:200]
    line["errors"] = errors
    if case.rivals:
        line["rivals"] = _rivals(case, drawn, session, problem, seed, errors)
    line["achieved"] = achieved(before, errors["ours"], errors["oracle"]) if "oracle" in errors else None
    return line


def _rivals(
    case: Case, drawn: Drawn, session: Session, judged: Problem, seed: int, errors: dict[str, float]
) -> dict[str, Any]:
    """Every other method; they may fit on all rollouts that ours got, held-out ones too."""
    ids = list(range(len(session.rollouts)))
    problem = problem_of(session, ids, _FITTED, session.sigma, 1)
    rng = np.random.default_rng([seed, case.number, 11])
    methods: dict[str, Callable] = {
        "fit_everything": lambda: fit_everything.run(drawn.robot, problem, rng),
        "ridge": lambda: ridge.run(drawn.robot, problem, rng),
        "pace": lambda: pace.run(drawn.robot, problem, rng),
        "delta": lambda: delta.run(drawn.robot, problem, rng),
    }
    out = {}
    for name, method in methods.items():
        began = time.monotonic()
        try:
            answer = method()
            error = answer.error(judged)
        except (BadInput, ValueError, np.linalg.LinAlgError) as problem_met:
            out[name] = {"failed": f"{type(problem_met).__name__}: {problem_met}"[:200]}
            continue
        document = {"effects": [{**e, "parameters": {}, "equivalent": []} for e in answer.named]}
        marks = score(drawn.truth, document)
        keep = ("named", "found", "top", "place", "top_place", "spurious", "alarm")
        out[name] = {k: marks[k] for k in keep} | {"error": error, "seconds": round(time.monotonic() - began, 2)}
        if "oracle" in errors:
            out[name]["achieved"] = achieved(errors["before"], error, errors["oracle"])
    return out


def _session(drawn: Drawn, rollouts: list) -> Session:
    return make_session(drawn.robot.spec.copy(), rollouts, drawn.robot.name, "lottery")


def _smallest(truth: dict[str, Any], document: dict[str, Any]) -> float | None:
    """The change of a true effect that the diagnosis says these data would have shown, where it was not found."""
    for entry in document.get("smallest_detectable", []):
        if entry["effect"] == truth["effect"] and set(entry["where"]) == set(truth["where"]):
            return entry.get("change")
    return None


def _brief(entry: dict[str, Any]) -> dict[str, Any]:
    """Part of an entry that is kept."""
    keep = ("effect", "where", "parameters", "equivalent", "explains", "evidence")
    return {k: entry[k] for k in keep if k in entry}
