"""Contacts along a simulated run: bodies that come too close, feet that let go, and the support of a standing robot."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds.plan import SafetyMargins

_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


@dataclass(frozen=True)
class Clash:
    """Why a run is refused, and which bodies are to blame; none: the robot as a whole."""

    reason: str
    bodies: tuple[int, ...] = ()


class Surroundings:
    """The declared model with every colliding geometry awake, and which of them are near each other at rest."""

    def __init__(self, plant: Plant, rest: np.ndarray, rule: SafetyMargins) -> None:
        self.model = copy.copy(plant.model)
        self.rule, self._floating = rule, plant.floating
        awake = (self.model.geom_contype | self.model.geom_conaffinity) != 0
        self.model.geom_contype[awake], self.model.geom_conaffinity[awake] = 1, 1
        self.model.geom_margin[:] = max(rule.clearance, rule.touch)
        self.model.opt.disableflags &= ~_NO_CONTACTS
        self._data = mujoco.MjData(self.model)
        self.has_geometry = bool((awake & (self.model.body_weldid[self.model.geom_bodyid] != 0)).any())
        self._place(rest)
        self._known = {_pair(c) for c in self._contacts()}
        self.feet = self._touching_world() if plant.floating else {}
        self._feet_at = {b: self._data.xpos[b, :2].copy() for b in self.feet}
        self._base = int(self.model.jnt_bodyid[self.model.dof_jntid[plant.base_dof]]) if plant.floating else 0
        self._up = self._data.xmat[self._base].reshape(3, 3)[2].copy() if plant.floating else None
        points = [p for some in self.feet.values() for p in some]
        self.radius = inner_radius(np.array(points)) if points else 0.0

    def clash(self, qpos: np.ndarray, qvel: np.ndarray, period: float) -> Clash | None:
        """The first thing wrong along states (n, nq), (n, nv), `period` s apart."""
        if not self.has_geometry and not self._floating:
            return None
        carried: list[_Carried] = []
        for q, v in zip(qpos, qvel, strict=True):
            self._place(q)
            if found := (self._unsteady() if self._floating else None) or self._too_near():
                return found
            if self._floating:
                carried.append(self._carried(v))
        return self._out_of_support(carried, period) if self._floating else None

    def _place(self, qpos: np.ndarray) -> None:
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        mujoco.mj_collision(self.model, self._data)

    def _carried(self, qvel: np.ndarray) -> "_Carried":
        data, base = self._data, self._base
        data.qvel[:] = qvel
        mujoco.mj_comVel(self.model, data)
        mujoco.mj_subtreeVel(self.model, data)
        points = [p for some in self._touching_world().values() for p in some]
        return _Carried(
            data.subtree_com[base].copy(), data.subtree_linvel[base].copy(), data.subtree_angmom[base].copy(),
            np.array(points), float(np.mean([c.pos[2] for c in self._contacts()])),
        )  # fmt: skip

    def _contacts(self) -> list[mujoco.MjContact]:
        return [self._data.contact[k] for k in range(self._data.ncon)]

    def _too_near(self) -> Clash | None:
        model = self.model
        for c in self._contacts():
            one, other = (int(model.geom_bodyid[g]) for g in c.geom)
            if c.dist >= self.rule.clearance or _pair(c) in self._known or self._adjacent(one, other):
                continue
            if {one, other} & set(self.feet) and 0 in (model.body_weldid[one], model.body_weldid[other]):
                continue
            names = " and ".join(model.body(b).name or f"body {b}" for b in (one, other))
            return Clash(f"{names} come closer than {1000 * self.rule.clearance:.0f} mm", (one, other))
        return None

    def _adjacent(self, one: int, other: int) -> bool:
        """Whether one hangs on the other; what hangs on the world may still hit the floor."""
        model = self.model
        a, b = int(model.body_weldid[one]), int(model.body_weldid[other])
        above = {int(model.body_weldid[model.body_parentid[a]]): b, int(model.body_weldid[model.body_parentid[b]]): a}
        return a == b or any(parent == child and parent != 0 for parent, child in above.items())

    def _touching_world(self) -> dict[int, list[np.ndarray]]:
        """Bodies in contact with the world -> the points (2,) [m]."""
        out: dict[int, list[np.ndarray]] = {}
        for c in self._contacts():
            bodies = [int(self.model.geom_bodyid[g]) for g in c.geom]
            moving = [b for b in bodies if self.model.body_weldid[b] != 0]
            if len(moving) == 1 and c.dist < self.rule.touch:
                out.setdefault(moving[0], []).append(np.array(c.pos[:2]))
        return out

    def _unsteady(self) -> Clash | None:
        """A base that tilts, a foot that lets go or slides."""
        touching = self._touching_world()
        up = self._data.xmat[self._base].reshape(3, 3)[2]
        if np.arccos(np.clip(up @ self._up, -1, 1)) > self.rule.tilt:
            return Clash(f"the base tilts by more than {self.rule.tilt:g} rad")
        for foot, place in self._feet_at.items():
            name = self.model.body(foot).name or f"body {foot}"
            if foot not in touching:
                return Clash(f"{name} lifts off")
            if np.linalg.norm(self._data.xpos[foot, :2] - place) > self.rule.slide:
                return Clash(f"{name} slides by more than {1000 * self.rule.slide:.0f} mm")
        return None

    def _out_of_support(self, carried: Sequence["_Carried"], period: float) -> Clash | None:
        """Centre of mass or zero-moment point too near the edge of the support.

        The zero-moment point is where the floor's forces must act for the whole robot's momentum and angular momentum
        to change as they do (Vukobratovic).
        """
        least = self.rule.support * self.radius
        centre = np.array([c.centre for c in carried])
        moment = centre[:, :2].copy()
        if len(carried) > 2:
            rate = np.gradient(np.array([c.velocity for c in carried]), period, axis=0)
            turn = np.gradient(np.array([c.angular for c in carried]), period, axis=0)
            mass = float(self.model.body_subtreemass[self._base])
            lift = float(np.linalg.norm(self.model.opt.gravity)) + rate[:, 2]
            height = centre[:, 2] - np.array([c.floor for c in carried])
            moment[:, 0] -= height * rate[:, 0] / lift + turn[:, 1] / (mass * lift)
            moment[:, 1] -= height * rate[:, 1] / lift - turn[:, 0] / (mass * lift)
        for name, path in (("centre of mass", centre[:, :2]), ("zero-moment point", moment)):
            for point, c in zip(path, carried, strict=True):
                if inside_by(point, c.support) < least:
                    return Clash(f"the {name} comes within {1000 * least:.0f} mm of the edge of the support")
        return None


@dataclass(frozen=True, eq=False)
class _Carried:
    """A standing robot at one time."""

    centre: np.ndarray
    """(3,) centre of mass [m]."""
    velocity: np.ndarray
    """(3,) of it [m/s]."""
    angular: np.ndarray
    """(3,) angular momentum about it [kg m^2/s]."""
    support: np.ndarray
    """(n, 2) points in contact with the floor [m]."""
    floor: float
    """Their height [m]."""


def _pair(contact: mujoco.MjContact) -> tuple[int, int]:
    one, other = sorted(int(g) for g in contact.geom)
    return one, other


def hull(points: np.ndarray) -> np.ndarray:
    """Corners (m, 2) of the convex hull of points (n, 2), counter-clockwise (Andrew's monotone chain)."""
    order = sorted({(float(x), float(y)) for x, y in points})
    if len(order) < 3:
        return np.array(order).reshape(-1, 2)

    def half(rows: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        out: list[tuple[float, float]] = []
        for p in rows:
            while len(out) > 1 and _turn(out[-2], out[-1], p) <= 0:
                out.pop()
            out.append(p)
        return out[:-1]

    return np.array(half(order) + half(order[::-1]))


def inside_by(point: np.ndarray, points: np.ndarray) -> float:
    """Distance [m] of a point (2,) from the edge of the hull of points (n, 2), negative outside or without an area."""
    corners = hull(points) if len(points) else points
    if len(corners) < 3:
        return -np.inf
    edges = np.roll(corners, -1, axis=0) - corners
    normal = np.stack((-edges[:, 1], edges[:, 0]), axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)
    return float(((point - corners) * normal).sum(axis=1).min())


def inner_radius(points: np.ndarray) -> float:
    """Distance [m] of the middle of the hull of points (n, 2) from its edge; 0 for no area."""
    corners = hull(points)
    return max(0.0, inside_by(corners.mean(axis=0), points)) if len(corners) > 2 else 0.0


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
