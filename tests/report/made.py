"""A small made-up loop, as the report's sections take it."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pandas as pd

from bumblebee.report.charts.loop_picture import Box, loop_picture
from bumblebee.report.page import Block, Section, render
from bumblebee.report.results import LoopResults, RoundResults
from bumblebee.report.sections.clusters_section import clusters_section
from bumblebee.report.sections.data_sections import motions_section
from bumblebee.report.sections.opening import headline, opening
from bumblebee.report.sections.policy_sections import registry_section, success_section, training_section
from bumblebee.report.sections.round_sections import round_section

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


def index(value: float) -> dict[str, Any]:
    """A figure of the clustering's audit, as data/clusters/summary.json has it."""
    return {"value": value, "ci95": [value - 0.1, value + 0.1], "n": 9, "chance95": [-0.1, 0.1]}


def clusters() -> dict[str, Any]:
    """data/clusters/summary.json of two clusters."""
    row = {"label": "stand", "clips": 1, "held_out_clips": 1, "speed": 0.1, "displacement": 0.2, "z_move": 0.001,
           "keywords": "waves"}  # fmt: skip
    audit = {
        "method": "autoencoder",
        "stability": {"seeds": index(1.0), "subsamples": index(0.8), "retrained": index(0.6)},
        "silhouette": index(0.4),
        "balance": {"evenness": 0.9, "smallest": 0.4, "largest": 0.6, "n": 2},
        "kinematic": {"ari": index(0.3), "ami": index(0.3), "clips": {"still": 2}},
        "motion_only": None,
        "family_ari": None,
        "separation": {"speed": 0.9},
        "separation_random_split": {"speed": 0.1},
    }
    texts = {"train": 2, "held_out": 1, "with_captions": 3, "texts": {"made": 3}}
    return {"k": 2, "suggested_k": 3, "clusters": {"c0": row, "c1": row}, "audit": audit, "loss": {"infonce": 0.5},
            "clips": texts, "plane_variance": [0.5, 0.25]}  # fmt: skip


def evaluation() -> dict[str, Any]:
    """data/evaluation/summary.json: the policies of `RATES` on the stand-in, and steps from one to the next."""
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
    return {"results": entries, "comparisons": steps, "contract_sha256": "abc" * 20}


def round_results(effects: list[dict[str, Any]], note: str) -> RoundResults:
    """A round whose diagnosis found `effects`."""
    change = {"1.0": {"without": 0.1, "with": 0.09, "relative": -0.1, "low": -0.2, "high": 0.1}}
    return RoundResults(
        n=1,
        intake={"accepted": 9, "quarantined": 1, "seconds": 45.0},
        gate={"status": "approved", "by": "Ada <script>", "at": "2026-01-01", "note": note},
        diagnosis=diagnosis(effects),
        deltas={"c0": {"promoted": False, "held_out": {"rollouts": 6, "change": change}}},
    )


def loop_results(
    effects: list[dict[str, Any]], sealed: list[dict[str, Any]] | None, name: str = "<b>walk</b>", note: str = ""
) -> LoopResults:
    """Results of a loop; `name` is a motion's and a family's, `note` what the gate's answer says."""
    names = ["wave", name, "squat"]
    library = pd.DataFrame({"name": names, "family": ["stand", name, "squat"], "split": ["train", "test", "train"]})
    library = library.assign(source="made", licence="Apache-2.0", duration=4.0)
    labels = pd.DataFrame({"name": names, "cluster": ["c0", "c1", "c0"], "x": [0.0, 1, 2], "y": [1.0, 0, 2]})
    labels = labels.assign(split=library["split"], family=library["family"])
    curve = pd.DataFrame({"frames": [1e5, 2e5, 3e5], "success": [0.1, 0.4, 0.8], "key_error": [0.3, 0.2, 0.1]})
    return LoopResults(
        library=library,
        skipped=pd.DataFrame({"file": ["a.npz"], "reason": ["SMPL motions cannot be read yet"]}),
        drops=pd.DataFrame({"motion": ["squat"], "rule": ["joint_speed"], "explanation": ["45 rad/s at 1.2 s"]}),
        labels=labels,
        elbow=pd.DataFrame({"k": [1, 2, 3], "within_ss": [9.0, 4.0, 2.0]}),
        clusters=clusters(),
        curves={"base": curve, "expert-c0 r0": curve},
        evaluation=evaluation(),
        contract={"motions": [{"name": n} for n in names], "seeds": [0]},
        published={"models": {name: published(name) for name in ("base", "expert-c0", "expert-c1", "generalist")}},
        sealed=None if sealed is None else {"effects": sealed},
        rounds=(round_results(effects, note),),
    )


LAW = {"effect": "torque_ripple", "where": ["waist_yaw_joint"], "parameters": {"amplitude": 2.1}, "unit": "N m"}
DELAY = {"effect": "command_delay", "where": ["right_hip_pitch_joint"], "parameters": {"delay": 0.014}, "unit": "s"}
FORM = {
    "effect": "discovered", "where": ["waist_yaw_joint"], "equivalent": [], "explains": 0.12,
    "parameters": {"terms": [{"term": "sin(12*q)", "coefficient": 2.05, "ci95": [1.9, 2.2]}]},
}  # fmt: skip
PLAN = {
    "plan": [
        {"effect": "coulomb_friction", "where": ["left_knee_joint"], "done": "torque along the speed asked for",
         "size": "1.15 N m", "why_not": ""},
        {"effect": "command_delay", "where": ["right_hip_pitch_joint"], "done": "", "size": "",
         "why_not": "14 ms are more than the reference can be read ahead"},
    ]
}  # fmt: skip
WON = {
    ("base", "stand_in"): 0.22, ("base", "nominal"): 0.89, ("experts-r0", "stand_in"): 0.28,
    ("experts-r0", "nominal"): 0.92, ("experts-r0-compensated", "stand_in"): 0.61, ("experts-r1", "stand_in"): 0.86,
    ("experts-r1", "nominal"): 0.81, ("generalist", "stand_in"): 0.83, ("generalist", "nominal"): 0.86,
    ("control-declared-r1", "stand_in"): 0.31, ("control-declared-r1", "nominal"): 0.94,
    ("control-delta-r1", "stand_in"): 0.36,
}  # fmt: skip
GAINS = {
    ("base", "experts-r0"): 0.06, ("experts-r0", "experts-r0-compensated"): 0.33, ("experts-r0", "experts-r1"): 0.58,
    ("experts-r0-compensated", "experts-r1"): 0.25, ("control-declared-r1", "experts-r1"): 0.55,
    ("control-delta-r1", "experts-r1"): 0.50, ("experts-r1", "generalist"): -0.03, ("base", "experts-r1"): 0.64,
    ("base", "generalist"): 0.61, ("base", "control-declared-r1"): 0.09,
}  # fmt: skip


def won_back(sealed: list[dict[str, Any]] | None = None, effects: list[dict[str, Any]] | None = None) -> LoopResults:
    """A loop that wins a robot back: one effect found by name, one as a law without one, one missed, one false."""
    sealed = [TRUTH, DELAY, LAW] if sealed is None else sealed
    if effects is None:
        effects = [found(explains=0.71), FORM, found("kd", "left_elbow_joint", 1.4, explains=0.02)]
    made = loop_results(effects, sealed)
    entries = [
        {**entry(policy, engine, split, by, group, rate), "success": estimate(rate, 0.13, 36)}
        for (policy, engine), rate in WON.items()
        for split in ("all", "train", "test")
        for by, group in (("all", "all"), ("family", "walk"))
    ]  # fmt: skip
    for one in entries:
        low, high = one["success"]["ci95"]
        one["success"]["ci95"] = [low, min(high, 1.0)]
    steps = [
        {"from": a, "to": b, "engine": engine, "split": split, "motions": 36, "success": difference(gain, 0.17, p),
         "mpjpe_rad": difference(0.004, 0.001, 0.01), "mpkpe_mm": difference(2.0, 4.0, 0.3)}
        for (a, b), gain in GAINS.items()
        for p in ([0.0004] if abs(gain) > 0.17 else [0.3])
        for engine in ("stand_in", "nominal")
        for split in ("all", "test", "train")
    ]  # fmt: skip
    evaluation = {**made.evaluation, "results": entries, "comparisons": steps}
    left = {
        "significant": True, "p": 1e-4, "where": ["right_hip_pitch_joint"], "depends_on": ["target", "velocity"],
        "description": "right_hip_pitch_joint: a torque of 3.1 N m RMS depends on target, velocity",
    }  # fmt: skip
    (turn,) = made.rounds
    turn = replace(turn, diagnosis={**turn.diagnosis, "unexplained": left}, compensation=PLAN)
    return replace(made, evaluation=evaluation, rounds=(turn,), began="shipped")


def page(
    effects: list[dict[str, Any]], sealed: list[dict[str, Any]] | None, more: list[Section] | None = None, **named: str
) -> str:
    """The whole page of such a loop, with further sections."""
    return page_of(loop_results(effects, sealed, **named), more)


def page_of(results: LoopResults, more: list[Section] | None = None, film: Sequence[Block] = ()) -> str:
    """The whole page of any loop, with a film on its first screen."""
    sections = [motions_section(results), clusters_section(results), training_section(results)]
    sections += [round_section(results, turn) for turn in results.rounds]
    sections += [success_section(results), registry_section(results), *(more or [])]
    picture = loop_picture([Box("a", "1")], [Box("b", "2")], "back")
    return render(headline(results), "sub", picture, sections, opening(results, film))
