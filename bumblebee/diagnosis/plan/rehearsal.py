"""Runs simulated whole, under the declared model with some effects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bumblebee.diagnosis.plan.config import Gain
from bumblebee.diagnosis.plan.machine import Machine, at_rest
from bumblebee.diagnosis.plan.motions import Motion
from bumblebee.diagnosis.simulation import Layout, Plant, Variation, Windows, cut, residuals, vary
from bumblebee.measured.rollout import Rollout
from bumblebee.quaternions import conjugate, from_rotation_vector, rotate
from bumblebee.sim.effects import Effect
from bumblebee.sim.servo import servos_of

_BEFORE = 3  # ticks of a window's source before its start: what a delayed command is looked up in
_TOGETHER = 16  # runs simulated at once: memory


@dataclass(frozen=True, eq=False)
class Rehearsed:
    """R runs seen T times, on the joints J; NaN from where a simulation diverged."""

    position: np.ndarray
    """(R, T, J) true positions [rad, m]."""
    reading: np.ndarray
    """(R, T, D) what sensors without noise say, signals as in `layout`."""
    quat: np.ndarray | None
    """(R, T, 4) wxyz of the base."""
    torque: np.ndarray
    """(R, T, J) what the servos ask for before any limit [N m, N]."""
    layout: Layout

    @property
    def velocity(self) -> np.ndarray:
        """(R, T, J) [rad/s, m/s]."""
        return self.reading[..., self.layout.slices["joint_vel"]]

    def qpos(self, plant: Plant, rest: np.ndarray) -> np.ndarray:
        """(R, T, nq) states of the declared model; what no sensor reads is as in `rest` (nq,)."""
        out = np.broadcast_to(rest, (*self.position.shape[:2], len(rest))).copy()
        out[..., plant.qpos] = self.position
        if self.quat is not None:
            out[..., plant.base_qpos : plant.base_qpos + 3] = self.reading[..., self.layout.slices["base_pos"]]
            out[..., plant.base_qpos + 3 : plant.base_qpos + 7] = self.quat
        return out

    def qvel(self, plant: Plant) -> np.ndarray:
        """(R, T, nv) velocities of the declared model."""
        out = np.zeros((*self.position.shape[:2], plant.model.nv))
        out[..., plant.dof] = self.velocity
        if self.quat is not None:
            v, parts = plant.base_dof, self.layout.slices
            out[..., v : v + 3] = rotate(self.quat, self.reading[..., parts["base_lin_vel"]])
            out[..., v + 3 : v + 6] = self.reading[..., parts["base_ang_vel"]]
        return out


def rehearse(
    machine: Machine,
    motions: Sequence[Motion],
    effects: Sequence[Effect],
    step: float,
    settle: float,
    between: bool = False,
) -> Rehearsed:
    """Simulate the motions in steps of `step` [s], after the start pose was held for `settle` [s].

    T is the motions' ticks, or with `between` the simulation's steps from the first to the last of these.
    """
    parts: list[Rehearsed | None] = [None] * len(motions)
    for gain in dict.fromkeys(m.gain for m in motions):
        plant = machine.driven[gain]
        varied = vary(plant, effects)
        some = [i for i, m in enumerate(motions) if m.gain == gain]
        for first in range(0, len(some), _TOGETHER):
            now = some[first : first + _TOGETHER]
            made = _rehearse(machine, plant, varied, [motions[i] for i in now], step, settle, between)
            for k, i in enumerate(now):
                parts[i] = _row(made, k)
    return joined([part for part in parts if part is not None])


def settled(machine: Machine, step: float, settle: float) -> Machine:
    """The machine that begins where the declared one comes to rest under the targets of the start pose."""
    still = np.zeros((2, len(machine.home)))
    hold = Motion(0, "holds", "", Gain(), machine.home, still, np.ones(len(machine.home)))
    state = rehearse(machine, [hold], [], step, settle).qpos(machine.plant, machine.qpos)[0, -1]
    return at_rest(machine, state) if np.isfinite(state).all() else machine


def joined(parts: Sequence[Rehearsed]) -> Rehearsed:
    """Runs of the same length after each other."""
    quats = [p.quat for p in parts if p.quat is not None]
    return Rehearsed(
        np.concatenate([p.position for p in parts]),
        np.concatenate([p.reading for p in parts]),
        np.concatenate(quats) if quats else None,
        np.concatenate([p.torque for p in parts]),
        parts[0].layout,
    )


def _row(made: Rehearsed, k: int) -> Rehearsed:
    quat = None if made.quat is None else made.quat[k : k + 1]
    return Rehearsed(
        made.position[k : k + 1], made.reading[k : k + 1], quat, made.torque[k : k + 1], made.layout
    )  # fmt: skip


def _rehearse(
    machine: Machine,
    plant: Plant,
    varied: Variation,
    motions: Sequence[Motion],
    step: float,
    settle: float,
    between: bool,
) -> Rehearsed:
    before = _BEFORE + round(settle * machine.rate)
    sources = [_source(machine, motion, before) for motion in motions]
    ticks = len(motions[0].shape)
    starts = [(i, _BEFORE, before + ticks - 1) for i in range(len(motions))]
    windows, each = cut(plant, machine.layout, sources, starts, outputs=before + ticks), 1
    if between:
        each = max(1, round(1.0 / (machine.rate * step)))
        windows = _seen_between(windows, ticks, each)
    raw = residuals(plant, machine.layout, windows, [varied], step)[0][:, -((ticks - 1) * each + 1) :]
    reading, quat = -raw, None
    if plant.floating:
        turn = raw[..., machine.layout.slices["base_rot"]]
        quat = conjugate(from_rotation_vector(turn))
    position = reading[..., machine.layout.slices["joint_pos"]] - varied.offset
    velocity = reading[..., machine.layout.slices["joint_vel"]]
    model = varied.model
    servos = servos_of(model, [int(model.joint(name).id) for name in machine.joints])
    targets = np.repeat([m.targets for m in motions], each, axis=1)[:, : position.shape[1]]
    unlimited = np.full(len(machine.joints), np.inf)
    torque = servos.torque(position, velocity, targets * servos.gear, unlimited)
    return Rehearsed(position, reading, quat, torque, machine.layout)


def _seen_between(windows: Windows, ticks: int, each: int) -> Windows:
    """Windows of which the last ticks are seen `each` times as often, by sensors that read nothing."""
    first, last = windows.out_time[:, -ticks], windows.out_time[:, -1]
    fine = first[:, None] + np.linspace(0.0, 1.0, (ticks - 1) * each + 1) * (last - first)[:, None]
    time = np.concatenate((windows.out_time[:, :-ticks], fine), axis=1)
    measured = np.zeros((*time.shape, windows.measured.shape[-1]))
    quat = None if windows.quat is None else np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*time.shape, 4)).copy()
    return replace(windows, out_time=time, measured=measured, quat=quat)


def _source(machine: Machine, motion: Motion, before: int) -> Rollout:
    """The run as a rollout whose readings are zeros, after rest in the start pose; so residuals are readings."""
    targets = np.concatenate((np.repeat(motion.targets[:1], before, axis=0), motion.targets))
    rows, plant = len(targets), machine.driven[motion.gain]
    rest = np.zeros_like(targets)
    rest[:before] = machine.qpos[plant.qpos]
    columns: dict[str, Any] = {"joint_target": targets}
    if plant.floating:
        q = plant.base_qpos
        place, quat = np.zeros((rows, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1))
        place[: _BEFORE + 1], quat[: _BEFORE + 1] = machine.qpos[q : q + 3], machine.qpos[q + 3 : q + 7]
        columns |= {"base_pos": place, "base_quat": quat}
        columns |= {"base_ang_vel": np.zeros((rows, 3)), "base_lin_vel": np.zeros((rows, 3))}
    rest[_BEFORE + 1 :] = 0.0
    time = np.arange(rows) / machine.rate
    return Rollout(f"run{motion.number}", machine.joints, machine.rate, time, rest, np.zeros_like(rest), **columns)
