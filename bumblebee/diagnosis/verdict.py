"""What must not be overlooked: a correction that is worse, a large error that nothing explains, what was not tested."""

from collections.abc import Mapping
from typing import Any

from bumblebee.diagnosis.page import number
from bumblebee.diagnosis.units import pick, position_rows, rows

_MORE = 1.02  # by so much the error has to be larger to be called worse
FAR = 3.0  # times what sensor noise leaves, from which on an error is called large
_TRACE = 1e-3  # p of what is not called significant for being small, yet is no accident
LONE = (
    "a single rollout: nothing could be held out; errors are those of the fitted data, and no effect was tested on "
    "data that it was not fitted to. Record another run"
)
ALONE = (
    "a single rollout: what the model lacks in its first two thirds was looked for in the rest; whether another run "
    "lacks the same could not be tested. Record another run"
)


def worse_horizons(error: dict[str, Any]) -> list[str]:
    """A line for every horizon and measure at which the corrected model errs more than the declared one."""
    lines = []
    for horizon, measures in error["before"].items():
        for _, unit, scale, key in rows(measures):
            if key[0] not in ("joint_pos_rmse", "base_pos_rmse"):
                continue
            before, after = (pick(error[part].get(horizon, {}), key).get("value") for part in ("before", "after"))
            if before is not None and after is not None and after > _MORE * before:
                what = "base" if key[0].startswith("base") else f"{key[1] or 'joint'}s"
                lines.append(
                    f"WORSE after {horizon} s: the {what} were {scale * before:.3g} {unit} off with the declared model "
                    f"and are {scale * after:.3g} {unit} off with the correction. Do not use it for motions that long."
                )
    return lines


def told_horizon(block: Mapping[str, Any]) -> str | None:
    """The horizon that the first sentences are about: 0.2 s, else the first that the data reach."""
    return "0.2" if "0.2" in block else next(iter(block), None)


def unexplained_error(document: Mapping[str, Any]) -> list[str]:
    """Lines on joint errors far above the noise that the effects, if any were found, do not explain."""
    after, floor = document["error"]["after"], document["error"]["floor"]
    horizon = told_horizon(after)
    if horizon is None:
        return []
    lines = []
    for what, unit, scale, key in position_rows(after[horizon]):
        value, noise = (pick(block.get(horizon, {}), key).get("value") for block in (after, floor))
        if value is None or not noise or value <= FAR * noise:
            continue
        times = number(value / noise, 2)
        size = f"{number(scale * value)} {unit} in its {what} after {horizon} s, {times} times what noise leaves"
        if document["effects"]:
            lines.append(f"The corrected model still errs by {size}: what was found does not explain that.")
        else:
            lines.append(f"The model errs by {size}, and no effect of the catalogue explains it.")
    return lines


def what_is_left(document: Mapping[str, Any]) -> str:
    """The sentence on what the tests of the residual saw; no comfort where the error itself is large."""
    left = document["unexplained"]
    if left["description"]:
        return left["description"]
    if unexplained_error(document):
        return "no structure that these tests can see, yet the error is far above the noise"
    if left["p"] < _TRACE:
        return "traces too slight to count"
    return "nothing that these tests can see"


def beside_noise(after: Mapping[str, Any], noise: Mapping[str, Any], unit: str, scale: float) -> str:
    """How an error compares with what sensor noise alone leaves, in words; empty where that is not known.

    Noise alone leaves an error that is drawn anew with every window: a complete model's lies at the expected value, now
    above it and now below. An error below it is therefore no better than one at it.

    Args:
        after: `value` and `ci95` of the error.
        noise: the same of the block `floor`.
        unit: of what is printed.
        scale: from SI to it.
    """
    value, floor = after.get("value"), noise.get("value")
    if value is None or not floor:
        return ""
    ends = f" [{scale * noise['ci95'][0]:.3g}, {scale * noise['ci95'][1]:.3g}]" if noise.get("ci95") else ""
    expected = f"{scale * floor:.3g}{ends} {unit}"
    if value <= floor:
        return f"no more than sensor noise leaves of a complete model: {expected}, now more, now less"
    return f"sensor noise alone leaves {expected}"


def nothing_seen(document: Mapping[str, Any], joint: str) -> str:
    """What to say of a joint whose missing torque has no structure: no comfort where it errs by much."""
    horizon = told_horizon(document["error"])
    if horizon is None:
        return "nothing that these tests can see"
    value, noise = (
        document[part].get(horizon, {}).get("joint_pos_rmse", {}).get("per_joint", {}).get(joint, {}).get("value")
        for part in ("error", "floor")
    )
    if value is None or not noise or value <= FAR * noise:
        return "nothing that these tests can see"
    return (
        f"no structure that these tests can see, yet {number(value / noise, 2)} times the noise off after {horizon} s"
    )
