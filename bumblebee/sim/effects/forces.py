"""The equations of effects that act at every physics step, for many worlds at once, beside `mujoco.batch`.

Dry friction that depends on speed or load is a friction loss written anew each step, and strength that fades is a gain
written anew, so that MuJoCo's implicit treatment of both stays. The others are torques added to `qfrc_applied`:

| effect | what is written before a step |
|---|---|
| stribeck_friction | frictionloss + stiction exp(-(v / velocity)^2) |
| load_dependent_friction | frictionloss + (coefficient + difference / 2 sgn(v)) abs(servo torque), sgn smooth at rest |
| torque_speed_limit | forcerange: limit (1 - v / speed) in the direction of motion |
| thermal_fade, strength_drift | gains times 1 - rate int (torque / limit)^2 dt - rate t |
| encoder_delay, encoder_quantisation | the servo's torque at the old, rounded reading instead of the present one |
| command_filter, _rate_limit, _profile | the servo's torque at its set-point (`setpoints.py`), not at the target |
| torque_lag | the servo's torque after dx/dt = (torque - x) / time, instead of the present one |
| torques without a memory (cogging, ...) | what `torque_at` of their file in `bumblebee/effects` gives |
| external_wrench | xfrc_applied |
| hysteresis by Dahl's law | -amplitude z; dz/dt = v / width (1 - sgn(v) z) |
| backlash, series_elasticity, encoder on the joint | the servo's torque also turns the rotor on its own hinge |
| discovered | the terms' sum, as torque or, for `friction(...)`, as frictionloss |
"""

from collections.abc import Iterable

import mujoco
import numpy as np
from mujoco.batch import Batch

from bumblebee.effects.catalogue import CATALOGUE
from bumblebee.effects.setpoints import advance
from bumblebee.sim.effects.hooks import RuntimeHooks, hook_joints
from bumblebee.sim.effects.memory import REMEMBERED, Memory, bent, history_length, steps_held_back
from bumblebee.sim.effects.states import states_of
from bumblebee.sim.servo import Servos, servos_of

_AT_REST = 0.01  # [rad/s, m/s] below which a friction of either direction goes over into the other


class StepHooks:
    """Hooks that run beside one batch; call `reset` after its worlds were reset and `apply` before each step."""

    def __init__(self, hooks: RuntimeHooks, model: mujoco.MjModel, batch: Batch, servos: Servos | None = None) -> None:
        """`servos` are those of the worlds where they differ; by default `model`'s."""
        self._h, self._batch = hooks, batch
        self.servos = servos_of(model, hook_joints(model)) if servos is None else servos
        self._step = float(model.opt.timestep)
        count, joints = batch.nsim, len(hooks.joints)
        self._time, self._heat = np.zeros(count), np.zeros((count, joints))
        self._lagged = np.zeros((count, joints))
        self._fresh = np.ones(count, dtype=bool)
        self._back = history_length(hooks, self._step)
        self._past_q = np.zeros((count, self._back, joints))
        self._past_v = np.zeros((count, self._back, joints))
        self._held_back = steps_held_back(model, self.servos)
        self._past_u = np.zeros((count, int(np.ceil(self._held_back.max(initial=0.0))), joints))
        self._kept = states_of(hooks.terms)
        self._states = np.zeros((count, len(self._kept)))
        self._bent = np.zeros((count, len(hooks.hysteresis)))
        self._setpoint, self._pace = np.zeros((count, joints)), np.zeros((count, joints))
        terms = [term for _, _, term in hooks.terms]
        self._fading, self._running_out, self._late = hooks.has("gain"), hooks.has("limit"), hooks.has("feedback")
        self._shaping, self._loading = hooks.has("target"), bool(hooks.load_friction.any())
        self._rubbing = hooks.has("loss") or any(term.rubs for term in terms)
        self._driving = any(term.drives for term in terms)
        # A servo that nothing here asks for is not computed: on a small robot it costs as much as the physics.
        self._heating = bool(hooks.thermal.any())
        self._asking = self._late or self._shaping or self._loading or self._heating or bool(hooks.rotors or terms)
        self._pushing = self._late or self._shaping or hooks.has("torque") or any(not term.rubs for term in terms)
        fields = ["actuator_gainprm", "actuator_biasprm"] * self._fading
        fields += ["dof_frictionloss"] * self._rubbing + ["actuator_forcerange"] * self._running_out
        # Fields of the model that are written, with a row for each world.
        self._written: dict[str, np.ndarray] = {name: batch.expand(name) for name in fields}
        self._bound = {name: batch.bind(name) for name in ("qpos", "qvel", "ctrl", "qfrc_applied")}
        self.rebase(("dof_frictionloss", "actuator_gainprm", "actuator_biasprm"))

    def rebase(self, fields: Iterable[str]) -> None:
        """Take the worlds' present values of some fields (randomised ones, say) as those that the hooks act upon."""
        for name in fields:
            if name == "dof_frictionloss" and self._rubbing:
                self._loss0 = self._written[name][:, self.servos.dof].copy()
            elif name == "actuator_gainprm" and self._fading:
                self._gain0 = self._written[name].copy()
            elif name == "actuator_biasprm" and self._fading:
                self._bias0 = self._written[name].copy()

    def reset(self, ids: np.ndarray, memory: Memory | None = None) -> None:
        """Worlds `ids` (n,) begin anew, with a memory (n worlds) or at rest."""
        self._time[ids] = 0.0 if memory is None else memory.time
        self._heat[ids] = 0.0 if memory is None else memory.heat
        q, v = self._readings()
        self._past_q[ids], self._past_v[ids] = q[ids][:, None], v[ids][:, None]
        if memory is not None and memory.position is not None and self._back > 0:
            self._past_q[ids], self._past_v[ids] = memory.position, memory.velocity
        control = self.servos.controls(self._bound["ctrl"])[ids]
        self._setpoint[ids], self._pace[ids], self._past_u[ids] = control, 0.0, control[:, None]
        target = self.servos.given(control)
        for k, s in enumerate(self._kept):
            self._states[ids, k] = s.first(target[:, s.column])
        if memory is not None and memory.states is not None:
            self._states[ids] = memory.states
        self._bent[ids] = 0.0 if memory is None or memory.bent is None else memory.bent
        self._fresh[ids] = memory is None or memory.torque is None
        if memory is not None and memory.torque is not None:
            self._lagged[ids] = memory.torque
        for body, wrench in self._h.wrench:
            self._batch.bind("xfrc_applied")[ids, body] = wrench

    def read(self) -> np.ndarray:
        """Positions (n, J) as the encoders read them now: late, off and rounded."""
        h, back = self._h, self._back
        q = self._readings()[0]
        if back:
            path, at = np.concatenate((self._past_q, q[:, None]), axis=1), h.encoder_delay / self._step
            low, share, columns = np.floor(at).astype(int), at - np.floor(at), np.arange(q.shape[1])
            newer, older = path[:, back - low, columns], path[:, np.maximum(back - low - 1, 0), columns]
            q = newer + share * (older - newer)
        q = q + h.encoder_offset
        size = np.where(h.encoder_step > 0, h.encoder_step, 1.0)
        return np.where(h.encoder_step > 0, np.round(q / size) * size, q)

    @property
    def applied(self) -> np.ndarray:
        """Torque (n, J) [N m] beside MuJoCo's own servo in the last step."""
        return self._bound["qfrc_applied"][:, self.servos.dof]

    def state_dict(self) -> dict[str, np.ndarray]:
        """All that it remembers."""
        return {name: np.copy(getattr(self, f"_{name}")) for name in REMEMBERED}

    def load_state_dict(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what `state_dict` gave."""
        for name in REMEMBERED:
            getattr(self, f"_{name}")[:] = saved[name]

    def _readings(self) -> tuple[np.ndarray, np.ndarray]:
        return self._bound["qpos"][:, self.servos.qpos], self._bound["qvel"][:, self.servos.dof]

    def apply(self) -> None:
        """Write everything that the next physics step needs."""
        h, servos = self._h, self.servos
        q, v = self._readings()
        told = servos.controls(self._bound["ctrl"])
        told = _aged(self._past_u, told, self._held_back) if self._past_u.shape[1] else told
        u = self._shaped(told) if self._shaping else told
        for k, s in enumerate(self._kept):
            self._states[:, k] = s.at(self._states[:, k], servos.given(u)[:, s.column], self._time, self._step)
        strength = self._fade() if self._fading else 1.0
        limit = self._torque_limit(v) if self._running_out else servos.limit
        now = torque = np.zeros_like(q)
        if self._asking:
            reach = limit / np.maximum(strength, 1e-9)
            now = strength * servos.torque(q, v, told, reach)  # what MuJoCo's own servo does
            torque = strength * servos.torque(q, v, u, reach) if self._shaping else now
            torque = self._delayed(q, v, u, strength, limit, torque) if self._late else torque
        if self._rubbing:
            loss = self._loss0 + self._extra_loss(v, torque) + self._discovered(q, v, u, torque, rubs=True)
            self._written["dof_frictionloss"][:, servos.dof] = np.maximum(loss, 0.0)
        if self._pushing:
            applied = torque - now + self._discovered(q, v, u, torque, rubs=False)
            if self._driving:
                wanted = self.servos.torque(q, v, u, limit + np.inf)
                asked = wanted + self._discovered(q, v, u, torque, rubs=False, drives=True)
                applied += np.clip(asked, -limit, limit) - np.clip(wanted, -limit, limit)
            for column, law, values in h.laws:
                applied[:, column] += CATALOGUE[law].torque_at(q[:, column], v[:, column], *values)
            for k, (column, amplitude, _) in enumerate(h.hysteresis):
                applied[:, column] -= amplitude * self._bent[:, k]
            self._bound["qfrc_applied"][:, servos.dof] = applied
        for column, dof in h.rotors:
            self._bound["qfrc_applied"][:, dof] = torque[:, column]
        for k, (column, _, width) in enumerate(h.hysteresis):
            self._bent[:, k] = bent(self._bent[:, k], self._step * v[:, column], width)
        for k, s in enumerate(self._kept):
            self._states[:, k] = s.after(self._states[:, k], v[:, s.column], self._step)
        self._time += self._step
        if self._heating:
            self._heat += self._step * (torque / np.where(np.isfinite(servos.limit), servos.limit, 1.0)) ** 2

    def _extra_loss(self, v: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Dry friction (n, J) [N m] that depends on speed or load."""
        h = self._h
        loss = h.stiction[:, 0] * np.exp(-((v / h.stiction[:, 1]) ** 2))
        if self._loading:
            share = h.load_friction[:, 0] + 0.5 * h.load_friction[:, 1] * np.tanh(v / _AT_REST)
            loss += np.maximum(share, 0.0) * np.abs(torque)
        return loss

    def _discovered(
        self, q: np.ndarray, v: np.ndarray, u: np.ndarray, torque: np.ndarray, rubs: bool, drives: bool = False
    ) -> np.ndarray | float:
        """Sum (n, J) of the discovered terms that are losses, of those that act in the drive, or of other torques."""
        if not self._h.terms:
            return 0.0
        out = np.zeros_like(q)
        given = self.servos.given(u)
        names = self._h.joints
        for column, coefficient, term in self._h.terms:
            if (term.rubs, term.drives) != (rubs, drives):
                continue
            values = {"q": q[:, column], "v": v[:, column], "u": given[:, column], "tau": torque[:, column]}
            values["t"] = self._time
            values |= {s.key: self._states[:, k] for k, s in enumerate(self._kept) if s.column == column}
            for other in term.others:
                k = names.index(other)
                values |= {f"q[{other}]": q[:, k], f"v[{other}]": v[:, k], f"tau[{other}]": torque[:, k]}
            out[:, column] += coefficient * term(values)
        return out

    def _shaped(self, told: np.ndarray) -> np.ndarray:
        """Set-points (n, J) that the servos follow, of the controls that they are told: the mean over the step."""
        h, step, scale = self._h, self._step, np.maximum(np.abs(self.servos.gear), 1e-12)
        mean, at, pace = told, told, self._pace
        for kind, some, values in (
            ("command_filter", h.filter_time > 0, (h.filter_time,)),
            ("command_rate_limit", np.isfinite(h.target_rate), (h.target_rate * scale,)),
            ("command_profile", np.isfinite(h.profile[:, 0]), (h.profile[:, 0] * scale, h.profile[:, 1] * scale)),
        ):
            if some.any():
                usable = [np.where(some, value, 1.0) for value in values]
                area, then, speed = advance(kind, usable, self._setpoint, self._pace, told, step)
                mean, at = np.where(some, area / step, mean), np.where(some, then, at)
                pace = np.where(some, speed, pace)
        self._setpoint, self._pace = at, pace
        return mean

    def _fade(self) -> np.ndarray:
        h, servos = self._h, self.servos
        strength = np.maximum(1.0 - h.drift * self._time[:, None] - h.thermal * self._heat, 0.0)
        has = servos.actuator >= 0
        a = servos.actuator[has]
        self._written["actuator_gainprm"][:, a, 0] = strength[:, has] * self._gain0[:, a, 0]
        self._written["actuator_biasprm"][:, a, :3] = strength[:, has, None] * self._bias0[:, a, :3]
        return strength

    def _torque_limit(self, v: np.ndarray) -> np.ndarray:
        """Limits (n, J) of torques that drive the motion; those that brake keep the full one."""
        servos, speed = self.servos, self._h.speed_limit
        finite = np.isfinite(servos.limit).all(axis=tuple(range(servos.limit.ndim - 1)))
        some = np.isfinite(speed) & finite & (servos.actuator >= 0)
        left = np.clip(1.0 - np.abs(v) / (speed * servos.supply), 0.0, 1.0)
        forward, backward = np.where(v > 0, left, 1.0), np.where(v < 0, left, 1.0)
        a, force = servos.actuator[some], (servos.limit / np.maximum(np.abs(servos.gear), 1e-12))[..., some]
        written = self._written["actuator_forcerange"]
        written[:, a, 0], written[:, a, 1] = -force * backward[:, some], force * forward[:, some]
        return np.where(some, servos.limit * left, servos.limit)

    def _delayed(
        self,
        q: np.ndarray,
        v: np.ndarray,
        u: np.ndarray,
        strength: np.ndarray | float,
        limit: np.ndarray,
        now: np.ndarray,
    ) -> np.ndarray:
        """The servo's torque from old and rounded readings, after its lag, (n, J)."""
        h = self._h
        seen_q, seen_v = self._feedback(q, v)
        rounded = h.encoder_step > 0
        if rounded.any():
            size = np.where(rounded, h.encoder_step, 1.0)
            seen_q = np.where(rounded, np.round((seen_q + h.encoder_offset) / size) * size - h.encoder_offset, seen_q)
        wanted = now
        if rounded.any() or self._back:
            wanted = strength * self.servos.torque(seen_q, seen_v, u, limit / np.maximum(strength, 1e-9))
        if not h.torque_lag.any():
            return wanted
        before = np.where(self._fresh[:, None], wanted, self._lagged)
        self._fresh[:] = False
        keep = np.exp(-self._step / np.maximum(h.torque_lag, 1e-9))
        self._lagged = keep * before + (1.0 - keep) * wanted
        return np.where(h.torque_lag > 0, self._lagged, wanted)

    def _feedback(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and velocities (n, J) as old as the encoders' delay; linear between steps."""
        if not self._back:
            return q, v
        at = self._h.encoder_delay / self._step
        return _aged(self._past_q, q, at), _aged(self._past_v, v, at)


def _aged(past: np.ndarray, present: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Values (n, J) of so many `steps` (J,) ago, linear between them; the `past` (n, L, J) goes on by one step."""
    back, low, columns = past.shape[1], np.floor(steps).astype(int), np.arange(len(steps))
    path = np.concatenate((past, present[:, None]), axis=1)
    newer, older = path[:, back - low, columns], path[:, np.maximum(back - low - 1, 0), columns]
    past[:] = path[:, 1:]
    return newer + (steps - low) * (older - newer)
