"""A delay of all joints at once: the robot's, or the logger's, whose states came late by as much.

With states late by e, row k holds the state of `time[k] - e` beside the command of `time[k]`. A simulation restarted
from it sees commands that come e too late: the same as a robot with a command delay e. Commands that do not follow from
the states cannot separate the two.

One factor on everything that is a force: motion alone cannot tell it.

Masses, inertias, friction, springs and torques times the same number move the same way. As long as one drive
keeps its declared strength that drive sets the factor; where every drive's was fitted the declared masses do.

Gravity from another direction: under a robot that stands it is a sloping floor, under one that is bolted down a mount
that is not level.

What only rollouts show that were not fitted: it can be neither named nor ruled out, and a note says so.

A target that is limited in rate, a hit, a slip may happen once, in a run that was put aside. Nothing that is fitted
tells of it, and no test of what is left sees it; the error after is then large, and nothing else says why.

What must not be overlooked: a correction that is worse, a large error that nothing explains, what was not tested.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bumblebee.diagnosis.budget import EARLY
from bumblebee.diagnosis.dataset import Session, window_errors
from bumblebee.diagnosis.report.gain_by_horizon import worse_rows
from bumblebee.diagnosis.report.html import number
from bumblebee.diagnosis.simulation import pick, position_rows
from bumblebee.diagnosis.thresholds.report import Verdicts
from bumblebee.sim.effects import Effect

_LATE = ("command_delay", "encoder_delay")
_STRENGTH = ("motor_strength", "kp")
LONE = (
    "a single rollout: nothing could be held out; errors are those of the fitted data, and no effect was tested on "
    "data that it was not fitted to. Record another run"
)
ALONE = (
    "a single rollout: what the model lacks in its first two thirds was looked for in the rest; whether another run "
    "lacks the same could not be tested. Record another run"
)


def early_first(notes: Sequence[str]) -> tuple[list[str], list[str]]:
    """Notes on searches that the user's time or signal ended, which are read before all else, and the others."""
    return [note for note in notes if EARLY in note], [note for note in notes if EARLY not in note]


def latency_notes(effects: Sequence[dict[str, Any]], driven: Sequence[str], rule: Verdicts | None = None) -> list[str]:
    """A note where the found delays are of one size on every driven joint.

    Args:
        effects: the contract's list.
        driven: names of the joints with an actuator.
        rule: how alike they must be.
    """
    rule = rule or Verdicts()
    delays: dict[str, float] = {}
    for entry in effects:
        if entry["effect"] in _LATE:
            for name in entry["where"] or driven:
                delays[name] = entry["parameters"]["delay"]["value"]
    values = [delays.get(name, 0.0) for name in driven]
    if len(driven) < 2 or not values or min(values) <= 0 or max(values) - min(values) > rule.alike:
        return []
    size = 1e3 * sum(values) / len(values)
    return [
        f"all joints share a latency of {size:.1f} ms: the robot's, or that of the logger's timestamps; commands that "
        "do not follow from the states cannot distinguish them. To distinguish: log a step with the drive's torque"
    ]


def factor_notes(effects: Sequence[dict[str, Any]], driven: Sequence[str]) -> list[str]:
    """A note where the strength of every driven joint was found to differ.

    Args:
        effects: the contract's list.
        driven: names of the joints with an actuator.
    """
    found = {name for entry in effects if entry["effect"] in _STRENGTH for name in entry["where"]}
    if not driven or not set(driven) <= found:
        return []
    return [
        "the strength of every drive was fitted: strengths, friction and inertias are identifiable only up to one "
        "common scale, which the declared masses fix; their intervals are conditional on it. To fix it: weigh a link, "
        "or log the torque"
    ]


def mount_notes(effects: Sequence[dict[str, Any]], floating: bool) -> list[str]:
    """A note where a robot that is bolted down was found to stand under turned gravity.

    Args:
        effects: the contract's list.
        floating: whether the base is free.
    """
    turns = [entry["parameters"] for entry in effects if entry["effect"] == "ground_slope" and not floating]
    return [
        f"gravity comes from {math.degrees(math.hypot(*(p['value'] for p in turn.values()))):.1f} degrees off its "
        "declared direction: the mount is not level. Level it, or keep the corrected model's gravity"
        for turn in turns
    ]


def unseen_notes(
    session: Session, effects: Sequence[Effect], horizon: float, rule: Verdicts | None = None
) -> list[str]:
    """A note for each rollout that was not fitted with windows of `horizon` [s] far further off than any fitted one."""
    rule = rule or Verdicts()
    errors = window_errors(session, effects, horizon, session.steps[0])
    fitted = [i for i in session.train if i not in session.accept and i in errors]
    if not fitted:
        return []
    bound = rule.unseen * max(errors[i][0] for i in fitted)
    notes = []
    for i in sorted(set(errors) - set(fitted)):
        far = int((errors[i] > bound).sum())
        if far:
            times = errors[i][0] / bound * rule.unseen
            notes.append(
                f"{session.ids([i])[0]}: {far} of {len(errors[i])} windows with up to {times:.0f} times the "
                "largest error of the fitted ones. An effect acts there that the fitted rollouts do not excite: it is "
                "neither identified nor excluded. Record more of such motion."
            )
    return notes


def worse_horizons(error: dict[str, Any], rule: Verdicts) -> list[str]:
    """A line for every horizon and measure at which the corrected model errs more than the declared one."""
    return [
        f"WORSE after {horizon} s: the RMS error of the {what} is {before:.3g} {unit} with the declared model and "
        f"{after:.3g} {unit} with the corrected one. Do not predict over that horizon with it."
        for horizon, what, unit, before, after in worse_rows(error, rule)
    ]


def told_horizon(block: Mapping[str, Any]) -> str | None:
    """The horizon that the first sentences are about: 0.2 s, else the first that the data reach."""
    return "0.2" if "0.2" in block else next(iter(block), None)


def unexplained_error(document: Mapping[str, Any], rule: Verdicts) -> list[str]:
    """Lines on joint errors far above the noise that the effects, if any were found, do not explain."""
    sizes = far_off(document["error"]["after"], document["error"]["floor"], rule)
    if document["effects"]:
        return [f"The corrected model still errs by {size}: the effects found do not explain that." for size in sizes]
    return [f"The model errs by {size}, and no effect of the catalogue explains it." for size in sizes]


def far_off(error: Mapping[str, Any], floor: Mapping[str, Any], rule: Verdicts) -> list[str]:
    """Position errors of one block that are far above the noise, in words."""
    horizon, sizes = told_horizon(error), list[str]()
    if horizon is None:
        return []
    for what, unit, scale, key in position_rows(error[horizon]):
        value, noise = (pick(block.get(horizon, {}), key).get("value") for block in (error, floor))
        if value is not None and noise and value > rule.large * noise:
            times = number(value / noise, 2)
            size = f"{number(scale * value)} {unit} in its {what} after {horizon} s"
            sizes.append(f"{size}, {times} times the noise floor")
    return sizes


def what_is_left(document: Mapping[str, Any], rule: Verdicts) -> str:
    """The sentence on what the tests of the residual saw; no comfort where the error itself is large."""
    left = document["unexplained"]
    if left["description"]:
        return left["description"]
    if unexplained_error(document, rule):
        return "no significant structure in the residual, yet the error is far above the noise floor"
    if left["p"] < rule.trace:
        return "significant structure in the residual, but too small to matter"
    return "no significant structure in the residual"


def nothing_seen(document: Mapping[str, Any], joint: str, rule: Verdicts) -> str:
    """Sentence on a joint whose missing torque is not significant: no comfort where it errs by much."""
    quiet = "no significant structure"
    if document["missing_torque"][joint]["p"] < rule.trace:
        quiet = "significant structure, but too small or not confirmed on other rollouts"
    horizon = told_horizon(document["error"])
    if horizon is None:
        return quiet
    value, noise = (
        document[part].get(horizon, {}).get("joint_pos_rmse", {}).get("per_joint", {}).get(joint, {}).get("value")
        for part in ("error", "floor")
    )
    if value is None or not noise or value <= rule.large * noise:
        return quiet
    return f"{quiet}, yet the error after {horizon} s is {number(value / noise, 2)} times the noise floor"
