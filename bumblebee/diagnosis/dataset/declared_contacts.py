"""Contacts that the declared model closes in measured poses although nothing touches there.

MuJoCo lets neighbouring links overlap, but not where the upper one stands still in the world: without its freejoint a
robot's base pushes against the links that hang on it. Other models overlap by construction. Which contacts are real
the logs tell: short windows that start where one is closed are simulated with it and without any.
"""

import copy
from collections.abc import Iterable, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    Windows,
    choose_starts,
    cut,
    make_plants,
    residuals,
    select,
    vary,
)
from bumblebee.diagnosis.thresholds.dataset import DeclaredContacts
from bumblebee.measured.rollout import Rollout

Pair = tuple[int, int]


def without_contradicted(
    spec: mujoco.MjSpec,
    plant: Plant,
    layout: Layout,
    rollouts: Sequence[Rollout],
    sigma: np.ndarray,
    rule: DeclaredContacts,
) -> tuple[mujoco.MjSpec, list[str], list[str]]:
    """The model without the closed contacts that the logs contradict; a warning on these and a note on the others.

    Of a floating base those between its own links are asked, else those with the world, too. Where no contact is left
    out the spec itself comes back.

    Args:
        spec: the declared model.
        plant: made of it.
        layout: readings that are compared.
        rollouts: as read.
        sigma: (D,) noise of every signal.
        rule: how many poses are looked at.
    """
    periods = [float(np.median(np.diff(r.time))) for r in rollouts]
    span = max(plant.thresholds.windows.first_output, *periods)
    starts = choose_starts(rollouts, range(len(rollouts)), span, rule.windows, plant.thresholds.windows)
    closed = _closed(spec.compile(), plant, np.array([rollouts[i].joint_pos[k] for i, k, _ in starts]))
    if not closed:
        return spec, [], []
    bare_spec = _without(spec, closed)
    bare, _ = make_plants(bare_spec, rollouts, "declared model", plant.thresholds)
    windows = cut(bare, layout, rollouts, starts, outputs=1)
    names = {pair: (bare_spec.bodies[pair[0]].name, bare_spec.bodies[pair[1]].name) for pair in closed}
    kept = [p for p, depth in closed.items() if _predicts(bare, layout, select(windows, depth > 0), sigma, names[p])]
    notes = [f"{_CLOSED} that stay, as the logs are predicted no worse with them: {_listed(names[p] for p in kept)}"]
    gone = {pair: depth for pair, depth in closed.items() if pair not in kept}
    if not gone:
        return spec, [], notes
    deepest = 1000 * max(depth.max() for depth in gone.values())
    excluded = "".join(f'<exclude body1="{names[p][0]}" body2="{names[p][1]}"/>' for p in gone)
    warning = (
        f"{_CLOSED} that the logs contradict are left out (up to {deepest:.2g} mm deep; MuJoCo exempts neighbours of a "
        f"floating base, not of a fixed one): {_listed(names[p] for p in gone)}. The model says so itself with "
        f"<contact>{excluded}</contact> in it{_named_first(spec, gone)}."
    )
    return _without(spec, gone), [warning], notes if kept else []


_CLOSED = "declared contacts closed in measured poses"


def _named_first(spec: mujoco.MjSpec, pairs: Iterable[Pair]) -> str:
    """Names that bodies need before an exclusion can speak of them; empty where all have one."""
    nameless = sorted({b for pair in pairs for b in pair if not spec.bodies[b].name})
    return "".join(f', its body number {b} named "body_{b}"' for b in nameless)


def _listed(pairs: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{one} with {other}" for one, other in pairs)


def _closed(model: mujoco.MjModel, plant: Plant, poses: np.ndarray) -> dict[Pair, np.ndarray]:
    """Pairs of bodies -> how deep (W,) [m] they are in each other in joint positions (W, J); 0 where they are not."""
    data = mujoco.MjData(model)
    found: dict[Pair, np.ndarray] = {}
    for row, pose in enumerate(poses):
        data.qpos[:] = model.qpos0
        data.qpos[plant.qpos] = pose - plant.offset
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        for contact in data.contact:
            bodies = sorted(int(model.geom_bodyid[g]) for g in contact.geom if g >= 0)
            still = [b for b in bodies if model.body_weldid[b] == 0]
            if len(bodies) == 2 and contact.dist < contact.includemargin and not (plant.floating and still):
                depth = found.setdefault((bodies[0], bodies[1]), np.zeros(len(poses)))
                depth[row] = max(depth[row], contact.includemargin - contact.dist)
    return found


def _without(spec: mujoco.MjSpec, pairs: Iterable[Pair]) -> mujoco.MjSpec:
    """A copy without contacts of these pairs of bodies, which get names."""
    spec = spec.copy()
    for pair in pairs:
        for b in pair:
            spec.bodies[b].name = spec.bodies[b].name or f"body_{b}"
        spec.add_exclude(bodyname1=spec.bodies[pair[0]].name, bodyname2=spec.bodies[pair[1]].name)
    return spec


def _predicts(bare: Plant, layout: Layout, windows: Windows, sigma: np.ndarray, names: Sequence[str]) -> bool:
    """Whether windows are predicted no worse with the contact of two bodies alone than without any.

    It is worse where the sum of squares is larger and most windows are further off: a real contact may lose by the
    noise of a start that lies inside the other body, or in the many windows in which it bears nothing.
    """
    none = vary(bare, [])
    models = [_touching(model, names) for model in none.models]
    alone = replace(none, model=models[0], others=tuple(models[1:]))
    left = residuals(bare, layout, windows, [none, alone], float(bare.model.opt.timestep))[:, :, -1] / sigma
    without, with_it = np.nan_to_num((left**2).sum(axis=-1), nan=np.inf)
    nearer, further = (with_it < without).sum(), (with_it > without).sum()
    return bool(with_it.sum() <= without.sum() or nearer >= further)


def _touching(model: mujoco.MjModel, names: Sequence[str]) -> mujoco.MjModel:
    """A copy in which two bodies touch each other again: the world is excluded from itself instead."""
    model = copy.copy(model)
    one, other = sorted(int(model.body(name).id) for name in names)
    model.exclude_signature[model.exclude_signature == (one << 16) + other] = 0
    return model
