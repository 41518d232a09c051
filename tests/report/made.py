"""A small made-up loop, as the report's sections take it."""

from itertools import pairwise
from typing import Any

import pandas as pd

from bumblebee.report.data_sections import clusters_section, motions_section
from bumblebee.report.loop_picture import Box, loop_picture
from bumblebee.report.page import Section, render
from bumblebee.report.policy_sections import registry_section, success_section, training_section
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.round_sections import round_section
from bumblebee.report.verdict import facts, verdict

RATES = {"untrained": 0.0, "base": 0.6, "experts-r0": 0.7, "experts-r1": 0.8, "generalist": 0.9}
TRUTH = {"effect": "coulomb_friction", "where": ["left_knee_joint"], "parameters": {"frictionloss": 1.2}, "unit": "N m"}


def found(
    effect: str = "coulomb_friction", where: str = "left_knee_joint", value: float = 1.15, **more: Any
) -> dict[str, Any]:
    name = {"coulomb_friction": "frictionloss", "kd": "factor"}.get(effect, "damping")
    parameter = {"value": value, "ci95": [value - 0.1, value + 0.1], "nominal": 0.0, "unit": "N m"}
    return {
        "effect": effect,
        "where": [where],
        "parameters": {name: parameter},
        "equivalent": [],
        "explains": 0.8,
        **more,
    }


def estimate(value: float, half: float = 0.1, motions: int = 9) -> dict[str, Any]:
    return {"value": value, "ci95": [max(value - half, 0.0), value + half], "n": motions, "motions": motions}


def difference(value: float, half: float, p: float, motions: int = 9) -> dict[str, Any]:
    """A paired difference as data/evaluation/summary.json has it."""
    return {"value": value, "ci95": [value - half, value + half], "p": p, "motions": motions}


def entry(policy: str, engine: str, split: str, by: str, group: str, rate: float) -> dict[str, Any]:
    errors = {key: estimate(0.1) for key in ("mpjpe_rad", "mpkpe_mm")}
    base = {"policy": policy, "engine": engine, "split": split, "group_by": by, "group": group, "n": 9}
    return {**base, "kind": policy, "round": None, "success": estimate(rate), **errors}


def block(value: float) -> dict[str, Any]:
    joints = {"left_knee_joint": {"value": value}, "right_knee_joint": {"value": value / 2}}
    return {"0.2": {"joint_pos_rmse": {"value": value, "ci95": [0.9 * value, 1.1 * value], "per_joint": joints}}}


def diagnosis(effects: list[dict[str, Any]]) -> dict[str, Any]:
    left = {"significant": False, "p": 0.4, "where": [], "depends_on": [], "description": ""}
    error = {"before": block(0.03), "after": block(0.01), "floor": block(0.005)}
    return {"train": ["a"], "holdout": ["b", "c"], "effects": effects, "unexplained": left, "error": error}


def published(name: str) -> dict[str, Any]:
    versions = ["3", "4"] if name.startswith("expert") else ["2"]
    why = "success +0.100 against its parent, 95 % interval -0.050 to +0.250, p = 0.2: not shown to be worse"
    facts = {"version": versions[-1], "versions": versions, "champion": versions[-1]}
    return {**facts, "promoted": True, "reason": why, "onnx_sha256": "f" * 64}


def loop_results(
    effects: list[dict[str, Any]], sealed: list[dict[str, Any]] | None, name: str = "<b>walk</b>", note: str = ""
) -> LoopResults:
    """Results of a loop; `name` is a motion's and a family's, `note` what the gate's answer says."""
    names = ["wave", name, "squat"]
    library = pd.DataFrame({"name": names, "family": ["stand", name, "squat"], "split": ["train", "test", "train"]})
    library = library.assign(source="made", licence="Apache-2.0", duration=4.0)
    labels = pd.DataFrame({"name": names, "cluster": ["c0", "c1", "c0"], "x": [0.0, 1, 2], "y": [1.0, 0, 2]})
    labels = labels.assign(split=library["split"], family=library["family"])
    row = {
        "label": "stand",
        "clips": 1,
        "held_out_clips": 1,
        "speed": 0.1,
        "displacement": 0.2,
        "z_move": 0.001,
        "keywords": "waves",
    }
    audit = {
        "stability": {"seeds": 1.0, "subsamples": 0.8},
        "family_ari": None,
        "separation": {"speed": 0.9},
        "separation_random_split": {"speed": 0.1},
    }
    clusters = {"k": 2, "suggested_k": 3, "clusters": {"c0": row, "c1": row}, "audit": audit, "loss": {"infonce": 0.5}}
    clusters["clips"] = {"train": 2, "held_out": 1, "with_captions": 3, "texts": {"made": 3}}
    clusters["plane_variance"] = [0.5, 0.25]
    entries = [
        entry(policy, "stand_in", split, by, group, rate)
        for policy, rate in RATES.items()
        for split in ("all", "train", "test")
        for by, group in (("all", "all"), ("family", "walk"))
    ]  # fmt: skip
    measured = {"success": difference(0.1, 0.15, 0.2), "mpjpe_rad": difference(-0.002, 0.004, 0.4)}
    step = {"engine": "stand_in", "motions": 9, **measured, "mpkpe_mm": difference(3.0, 8.0, 0.5)}
    pairs = [*pairwise(list(RATES)[1:]), ("base", "experts-r1"), ("base", "generalist")]
    steps = [{"from": a, "to": b, "split": split, **step} for split in ("all", "train", "test") for a, b in pairs]
    held = {
        "rollouts": 6,
        "change": {"1.0": {"without": 0.1, "with": 0.09, "relative": -0.1, "low": -0.2, "high": 0.1}},
    }
    turn = RoundResults(
        n=1,
        intake={"accepted": 9, "quarantined": 1, "seconds": 45.0},
        gate={"status": "approved", "by": "Ada <script>", "at": "2026-01-01", "note": note},
        diagnosis=diagnosis(effects),
        deltas={"c0": {"promoted": False, "held_out": held}},
    )
    curve = pd.DataFrame(
        {"frames": [1e5, 2e5, 3e5], "success": [0.1, 0.4, 0.8], "key_error": [0.3, 0.2, 0.1], "seconds": [9.0, 18, 27]}
    )
    return LoopResults(
        library=library,
        skipped=pd.DataFrame({"file": ["a.npz"], "reason": ["SMPL motions cannot be read yet"]}),
        drops=pd.DataFrame({"motion": ["squat"], "rule": ["joint_speed"], "explanation": ["45 rad/s at 1.2 s"]}),
        labels=labels,
        elbow=pd.DataFrame({"k": [1, 2, 3], "within_ss": [9.0, 4.0, 2.0]}),
        clusters=clusters,
        curves={"base": curve, "expert-c0 r0": curve},
        evaluation={"results": entries, "comparisons": steps, "contract_sha256": "abc" * 20},
        contract={"motions": [{"name": n} for n in names], "seeds": [0]},
        published={"models": {name: published(name) for name in ("base", "expert-c0", "expert-c1", "generalist")}},
        sealed=None if sealed is None else {"effects": sealed},
        rounds=(turn,),
    )


def page(
    effects: list[dict[str, Any]], sealed: list[dict[str, Any]] | None, more: list[Section] | None = None, **named: str
) -> str:
    """The whole page of such a loop, with further sections."""
    results = loop_results(effects, sealed, **named)
    sections = [motions_section(results), clusters_section(results), training_section(results)]
    sections += [round_section(results, turn) for turn in results.rounds]
    sections += [success_section(results), registry_section(results), *(more or [])]
    picture = loop_picture([Box("a", "1")], [Box("b", "2")], "back")
    return render("Title", "sub", verdict(results), picture, sections, facts(results))
