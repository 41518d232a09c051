"""Contacts along a simulated run: bodies that come too close, feet that let go, and the support of a standing robot."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds.plan import SafetyMargins
from bumblebee.sim.effects import Effect
from bumblebee.sim.nearness import colliding, touching_from

_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
_NO_SERVOS = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)


@dataclass(frozen=True)
class Clash:
    """Why a run is refused, and which bodies are to blame; none: the robot as a whole."""

    reason: str
    bodies: tuple[int, ...] = ()


class Surroundings:
    """The declared model with every colliding geometry awake, and which of them are near each other at rest.

    And the level surfaces that a diagnosis found, each with the point of the robot that touches it.
    """

    def __init__(self, plant: Plant, rest: np.ndarray, rule: SafetyMargins, effects: Sequence[Effect] = ()) -> None:
        self.model = touching_from(plant.model, max(rule.clearance, rule.touch))
        self.rule, self._floating = rule, plant.floating
        awake = colliding(self.model)
        self.model.geom_contype[awake], self.model.geom_conaffinity[awake] = 1, 1
        self.model.body_contype[:], self.model.body_conaffinity[:] = 1, 1  # bodies that no geometry wakes are left out
        self.model.opt.disableflags &= ~_NO_CONTACTS
        self._data = mujoco.MjData(self.model)
        self.has_geometry = bool((awake & (self.model.body_weldid[self.model.geom_bodyid] != 0)).any())
        # The same robot moved by torques instead of its servos, for what the floor must bear.
        self._pushed = copy.copy(plant.model)
        self._pushed.opt.disableflags |= _NO_SERVOS
        self._forces, self._dof = mujoco.MjData(self._pushed), plant.dof
        self._place(rest)
        self._touching = {_pair(c) for c in self._contacts() if c.dist < rule.touch}
        self._near = {_pair(c) for c in self._contacts()} - self._touching
        self.feet = self._touching_world() if plant.floating else {}
        self._feet_at = {b: self._data.xpos[b, :2].copy() for b in self.feet}
        self._base = int(self.model.jnt_bodyid[self.model.dof_jntid[plant.base_dof]]) if plant.floating else 0
        self._up = self._data.xmat[self._base].reshape(3, 3)[2].copy() if plant.floating else None
        self._surfaces = [self._surface(e) for e in effects if e.effect == "surface_contact"]
        points = [p for some in self.feet.values() for p in some]
        self.radius = inner_radius(np.array(points)) if points else 0.0

    def weighing(self, other: mujoco.MjModel) -> "Surroundings":
        """Surroundings of a robot whose bodies weigh what those of another model do; a fixed base asks for none."""
        if not self._floating:
            return self
        heavy = copy.copy(self)
        heavy.model, heavy._pushed = copy.copy(self.model), copy.copy(self._pushed)
        for model in (heavy.model, heavy._pushed):
            for body in (b for b in range(1, model.nbody) if model.body(b).name):
                theirs = other.body(model.body(body).name).id
                for field in ("body_mass", "body_ipos", "body_iquat", "body_inertia"):
                    getattr(model, field)[body] = getattr(other, field)[theirs]
            mujoco.mj_setConst(model, mujoco.MjData(model))
        heavy._data, heavy._forces = mujoco.MjData(heavy.model), mujoco.MjData(heavy._pushed)
        return heavy

    def clash(self, qpos: np.ndarray, qvel: np.ndarray, torque: np.ndarray) -> Clash | None:
        """The first thing wrong along states (n, nq), (n, nv) of joints that are driven with `torque` (n, J)."""
        if not self.has_geometry and not self._floating and not self._surfaces:
            return None
        for q, v, tau in zip(qpos, qvel, torque, strict=True):
            self._place(q)
            found = (self._unsteady() if self._floating else None) or self._too_near() or self._too_low()
            found = found or (self._out_of_support(q, v, tau) if self._floating else None)
            if found:
                return found
        return None

    def _place(self, qpos: np.ndarray) -> None:
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        mujoco.mj_collision(self.model, self._data)

    def _contacts(self) -> list[mujoco.MjContact]:
        return [self._data.contact[k] for k in range(self._data.ncon)]

    def _too_near(self) -> Clash | None:
        model = self.model
        for c in self._contacts():
            one, other = (int(model.geom_bodyid[g]) for g in c.geom)
            least = self.rule.touch if _pair(c) in self._near else self.rule.clearance
            if c.dist >= least or _pair(c) in self._touching or self._adjacent(one, other):
                continue
            if {one, other} & set(self.feet) and 0 in (model.body_weldid[one], model.body_weldid[other]):
                continue
            names = " and ".join(model.body(b).name or f"body {b}" for b in (one, other))
            return Clash(f"{names} come closer than {1000 * least:.0f} mm", (one, other))
        return None

    def _surface(self, effect: Effect) -> tuple[int, np.ndarray, float]:
        """Body, point (3,) [m] in its frame and how low [m] it may come: at rest on the surface, no lower than that."""
        height, *point, _ = effect.values()
        body, at = int(self.model.body(effect.where[0]).id), np.array(point)
        return body, at, min(height + self.rule.clearance, self._height(body, at) - self.rule.touch)

    def _height(self, body: int, point: np.ndarray) -> float:
        return float(self._data.xpos[body, 2] + self._data.xmat[body, 6:9] @ point)

    def _too_low(self) -> Clash | None:
        for body, point, least in self._surfaces:
            if self._height(body, point) < least:
                name = self.model.body(body).name
                return Clash(f"{name} comes too near to the surface that the diagnosis found", (body,))
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

    def _out_of_support(self, qpos: np.ndarray, qvel: np.ndarray, torque: np.ndarray) -> Clash | None:
        """Centre of mass or zero-moment point too near the edge of the support.

        On a level floor the zero-moment point is the centre of pressure: the mean place of the floor's normal forces.
        """
        least = self.rule.support * self.radius
        support = np.array([p for some in self._touching_world().values() for p in some])
        if inside_by(self._data.subtree_com[self._base, :2], support) < least:
            return Clash(f"the centre of mass comes within {1000 * least:.0f} mm of the edge of the support")
        pressure, weight = self._pressure(qpos, qvel, torque)
        if weight < self.rule.weight:
            return Clash(f"the floor carries less than {100 * self.rule.weight:.0f} % of the weight")
        if inside_by(pressure, support) < least:
            return Clash(f"the zero-moment point comes within {1000 * least:.0f} mm of the edge of the support")
        return None

    def _pressure(self, qpos: np.ndarray, qvel: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, float]:
        """Centre of pressure (2,) [m], and the normal forces as a share of the weight."""
        model, data, force = self._pushed, self._forces, np.zeros(6)
        data.qpos[:], data.qvel[:], data.qfrc_applied[self._dof] = qpos, qvel, torque
        mujoco.mj_forward(model, data)
        total, moment = 0.0, np.zeros(2)
        for k in range(data.ncon):
            bodies = model.body_weldid[model.geom_bodyid[data.contact[k].geom]]
            if (bodies == 0).any():
                mujoco.mj_contactForce(model, data, k, force)
                total, moment = total + force[0], moment + force[0] * data.contact[k].pos[:2]
        weight = model.body_subtreemass[self._base] * float(np.linalg.norm(model.opt.gravity))
        return moment / max(total, 1e-9), total / weight


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
