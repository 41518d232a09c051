"""How much of the removable error is gone, and what is left in units of the task, on windows that took no part.

The removable share is (before - after) / (before - floor) of the RMS errors; its interval draws whole rollouts again,
the same ones before and after. The ends of the robot's chains (a gripper, feet) are placed by the joints' measured and
simulated positions, in the frame of the base.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bumblebee.diagnosis.report.prediction_error import HorizonWindows, Residuals, widened, with_interval
from bumblebee.diagnosis.simulation import Plant, members, pick
from bumblebee.diagnosis.thresholds.report import Matters
from bumblebee.effects.units import joint_unit


@dataclass(frozen=True, eq=False)
class Ends:
    """Residuals of the same windows with the declared and with the corrected model."""

    cuts: HorizonWindows
    before: Residuals
    after: Residuals


def removed(ends: Ends, error: Mapping[str, Any], rule: Matters, seed: int = 0) -> dict[str, list[dict[str, Any]]]:
    """Horizon -> an entry for the joints, or one for hinges and one for slides.

    Args:
        ends: the windows' residuals.
        error: the document's block, for the noise floor.
        rule: thresholds.
        seed: of the bootstrap.
    """
    kinds, plant = members(ends.cuts.plant), ends.cuts.plant
    out: dict[str, list[dict[str, Any]]] = {}
    for horizon, part in ends.cuts.windows.items():
        pair = [_positions(ends.cuts, raw[horizon]) for raw in (ends.before, ends.after)]
        good = np.isfinite(pair[0]).all(axis=1) & np.isfinite(pair[1]).all(axis=1)
        if not good.any():
            continue
        for kind, columns in kinds.items():
            key = ("joint_pos_rmse", kind if len(kinds) > 1 else "")
            floor = pick(error["floor"].get(horizon, {}), key).get("value")
            squares = np.stack([(p[good][:, columns] ** 2).mean(axis=1) for p in pair])
            entry = {"what": f"{kind}s" if len(kinds) > 1 else "joints", "unit": joint_unit("rad", kind == "slide")}
            entry |= _share(squares, part.rollout[good], floor, (rule.noise, ends.cuts.rule.resamples), seed)
            out.setdefault(horizon, []).append(entry)
    return out if plant.joints else {}


def _positions(cuts: HorizonWindows, raw: np.ndarray) -> np.ndarray:
    """(W, J) of the joints' positions."""
    return raw[:, 0, cuts.layout.slices["joint_pos"]]


def _share(
    squares: np.ndarray, groups: np.ndarray, floor: float | None, rule: tuple[float, int], seed: int
) -> dict[str, Any]:
    """RMS before and after of squares (2, W), and the share of the removable error that is gone, with its interval.

    The share is None where the declared model is at the noise floor: there is nothing to remove. Windows of a lone
    rollout are drawn in the place of rollouts.
    """
    least, resamples = rule
    alone = len(np.unique(groups)) < 2
    names, index = np.unique(np.arange(len(groups)) if alone else groups, return_inverse=True)
    sums = np.stack([np.bincount(index, row) for row in squares])
    counts = np.bincount(index).astype(float)
    before, after = np.sqrt(sums.sum(axis=1) / counts.sum())
    out: dict[str, Any] = {"before": float(before), "after": float(after), "floor": floor, "share": None, "ci95": None}
    if floor is None or before <= least * floor:
        return out
    out["share"] = min(float((before - after) / (before - floor)), 1.0)  # below the floor is at it
    if len(names) < 2:
        return out
    draws = np.random.default_rng(seed).integers(0, len(names), size=(resamples, len(names)))
    each = np.sqrt(sums[:, draws].sum(axis=2) / counts[draws].sum(axis=1))
    fair = each[0] > least * floor
    if fair.sum() > resamples // 2:
        shares = (each[0] - each[1])[fair] / (each[0] - floor)[fair]
        low, high = widened(out["share"], np.quantile(shares, [0.025, 0.975]), len(names))
        out["ci95"] = [min(low, 1.0), min(high, 1.0)]
    return out


def effectors(ends: Ends, horizon: str, seed: int = 0) -> list[dict[str, Any]]:
    """Distance [m] between where the joints measured and where those simulated put the end of every chain.

    The end is a site of the last body, or its centre of mass; before and after with intervals, largest first.
    """
    plant = ends.cuts.plant
    tips = _tips(plant)
    if not tips or horizon not in ends.cuts.windows:
        return []
    part = ends.cuts.windows[horizon]
    measured = part.measured[:, 0, ends.cuts.layout.slices["joint_pos"]]
    pair = [_positions(ends.cuts, raw[horizon]) for raw in (ends.before, ends.after)]
    good = np.isfinite(pair[0]).all(axis=1) & np.isfinite(pair[1]).all(axis=1)
    if not good.any():
        return []
    places = [_placed(plant, tips, measured[good] - off[good]) for off in (np.zeros_like(measured), *pair)]
    squares = [((place - places[0]) ** 2).sum(axis=2) for place in places[1:]]  # (W, tips)
    out = []
    for k, tip in enumerate(tips):
        rng = np.random.default_rng(seed)
        before, after = (
            with_interval(square[:, k], part.rollout[good], rng, ends.cuts.rule.resamples) for square in squares
        )
        out.append({"what": "end", "where": tip.name, "unit": "m", "before": before["value"]} | after)
    return sorted(out, key=lambda entry: -(entry["value"] or 0.0))


@dataclass(frozen=True)
class _Tip:
    name: str
    body: int
    site: int
    """-1: the centre of mass."""


def _tips(plant: Plant) -> list[_Tip]:
    """The moving bodies without children that a measured joint carries."""
    model = plant.model
    parents = set(model.body_parentid[1:].tolist())
    carrying = {int(model.jnt_bodyid[model.joint(name).id]) for name in plant.joints}
    out = []
    for body in range(1, model.nbody):
        if body in parents or not _ancestors(model, body) & carrying:
            continue
        sites = np.flatnonzero(model.site_bodyid == body)
        site = int(sites[0]) if len(sites) else -1
        name = (model.site(site).name if site >= 0 else "") or model.body(body).name or f"body {body}"
        out.append(_Tip(name, body, site))
    return out


def _ancestors(model: mujoco.MjModel, body: int) -> set[int]:
    """A body and all that carry it."""
    found = set()
    while body:
        found.add(body)
        body = int(model.body_parentid[body])
    return found


def _placed(plant: Plant, tips: Sequence[_Tip], joints: np.ndarray) -> np.ndarray:
    """(W, tips, 3) [m] for joint positions (W, J), the base and what is not measured where the model has them."""
    data, out = mujoco.MjData(plant.model), np.empty((len(joints), len(tips), 3))
    for k, row in enumerate(joints):
        data.qpos[:] = plant.model.qpos0
        data.qpos[plant.qpos] = row
        mujoco.mj_kinematics(plant.model, data)
        for i, tip in enumerate(tips):
            out[k, i] = data.site_xpos[tip.site] if tip.site >= 0 else data.xipos[tip.body]
    return out
