"""How often the declared model, told a joint's command the other way round or in another size, predicts it better.

A joint that swings with its neighbours goes against its own torque for seconds, and no regression that is linear in the
state takes all of that away. The declared equations of motion know what neighbours, gravity and gears do. So short
stretches are simulated from the measured state twice, with the command as logged and with its sign changed; where the
two differ most, the command matters most, and there one of them is nearer to what was measured in nearly all stretches.
What the model lacks besides (friction, strength, masses) is in both. Where that is so much that the nearer one misses
by more than the two are apart, the model cannot tell. Contacts are left out: a declared one may be closed where nothing
touches, and then decides on both.

A floating base moves by contacts that no log has, and cannot be simulated so. What a limb that touches nothing asks of
its joint follows from the measured motion alone, though (`free_limb.py`), and that torque is compared instead.
"""

import mujoco
import numpy as np

from bumblebee.measured.checks.free_limb import torque_asked
from bumblebee.measured.checks.units import servo_gains
from bumblebee.measured.checks.view import View

SPAN = 0.06  # s of a stretch: long enough to move beyond the sensors' noise, too short for neighbours to drift off
STRETCHES = 120  # at most, spread over the file
STEP = 5e-4  # s of simulation at most
_COMMAND_ALONE = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION) | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
MATTERS = 0.5  # share of the stretches, those in which the command's sign changes the prediction most


def share_for_reversed(view: View, joint: int, by_target: bool) -> float | None:
    """Share of the stretches that the command reversed predicts better; None where the model cannot tell.

    It is 0 or nearly so where the sign is right, whatever swings the joint, up to a third where the robot balances by
    it; 0.7 and more where the command or the joint is reversed.
    """
    return share_on_limb(view, joint, by_target) if view.floating else share_for_multiple(view, joint, by_target, -1.0)


def share_for_multiple(view: View, joint: int, by_target: bool, factor: float) -> float | None:
    """Share of the stretches that the joint's command times `factor` predicts better than as logged.

    None where the model cannot tell: on a floating base, whose contacts no log has, for a servo of unknown gains, where
    simulations diverge, and where the nearer prediction misses by more than the two are apart.
    """
    model = view.model
    if view.floating or min(view.joint_ids(), default=-1) < 0 or model.nq != len(view.rollout.joints):
        return None
    torque = _Torque(view, by_target)
    if not torque.known[joint]:
        return None
    starts, window = _stretches(view)
    moved = view.rollout.joint_vel[starts + window, joint] - view.rollout.joint_vel[starts, joint]
    plain, other = (_predicted(view, torque, starts, window, joint, sign) for sign in (1.0, factor))
    return _share(moved, plain, other)


def share_on_limb(view: View, joint: int, by_target: bool) -> float | None:
    """Share for a joint of a floating robot, by the torque that its limb asks; None where the robot stands on it."""
    torque = _Torque(view, by_target)
    starts, window = _stretches(view)
    asked = torque_asked(view, joint, starts, window) if torque.known[joint] else None
    if asked is None:
        return None
    plain, other = (_given(view, torque, starts, window, joint, sign) for sign in (1.0, -1.0))
    return _share(asked, plain, other)


def _stretches(view: View) -> tuple[np.ndarray, int]:
    """First rows (N,) of the stretches, and how many rows each has."""
    window = view.window(SPAN)
    return np.unique(np.linspace(0, view.rollout.frames - 1 - window, STRETCHES).astype(int)), window


def _share(measured: np.ndarray, plain: np.ndarray, other: np.ndarray) -> float | None:
    """Share of the stretches (N,) that `other` comes nearer to, of those in which it is furthest from `plain`."""
    apart = np.abs(plain - other)
    good = np.isfinite(apart)
    if good.mean() < MATTERS or not apart[good].any():
        return None
    matters = good & (apart >= np.quantile(apart[good], 1 - MATTERS)) & (apart > 0)
    misses = np.abs(measured - plain)[matters], np.abs(measured - other)[matters]
    if np.median(np.minimum(*misses)) > np.median(apart[matters]):
        return None
    return float((misses[1] < misses[0]).mean())


class _Torque:
    """The torques of all joints as the declared drives give them."""

    def __init__(self, view: View, by_target: bool) -> None:
        rollout, gains = view.rollout, servo_gains(view.model)
        self.by_target = by_target
        self.command = view.values("joint_target" if by_target else "joint_torque_cmd")
        self.kp, self.kd = np.array([gains.get(name, (0.0, 0.0)) for name in rollout.joints]).T
        self.limit = torque_limits(view)
        self.known = self.kp > 0 if by_target else np.ones(len(rollout.joints), dtype=bool)

    def at(self, row: int | slice, place: np.ndarray, speed: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """(J,) [N m, N] under the commands of a row times `sign` (J,); (T, J) of several rows."""
        given = sign * self.command[row]
        raw = self.kp * (given - place) - self.kd * speed if self.by_target else given
        return np.clip(raw, -self.limit, self.limit)


def _given(view: View, torque: _Torque, starts: np.ndarray, window: int, joint: int, sign: float) -> np.ndarray:
    """Mean torque (N,) of a drive over the stretches by the measured states, its command times `sign` [N m, N]."""
    rollout, signs = view.rollout, np.full(len(view.rollout.joints), sign)
    rows = torque.at(slice(None), rollout.joint_pos, rollout.joint_vel, signs)[:, joint]
    total = np.concatenate([[0.0], np.cumsum(rows)])
    return (total[starts + window] - total[starts]) / window


def _drives(view: View) -> list[int]:
    """The last actuator on each joint, -1 for none."""
    model = view.model
    on: dict[int, int] = {}
    for a in range(model.nu):
        if int(model.actuator_trntype[a]) == int(mujoco.mjtTrn.mjTRN_JOINT):
            on.setdefault(int(model.actuator_trnid[a, 0]), a)
    return [on.get(j, -1) for j in view.joint_ids()]


def torque_limits(view: View) -> np.ndarray:
    """(J,) largest torques of the drives at the joints [N m, N]; infinite for none."""
    model = view.model
    return np.array(
        [
            abs(model.actuator_gear[a, 0]) * np.abs(model.actuator_forcerange[a]).max()
            if a >= 0 and model.actuator_forcelimited[a]
            else np.inf
            for a in _drives(view)
        ]
    )


def _predicted(view: View, torque: _Torque, starts: np.ndarray, window: int, joint: int, sign: float) -> np.ndarray:
    """Changes (N,) of the joint's velocity over the stretches, its command times `sign`; NaN where they diverge."""
    model, rollout, ids = view.model, view.rollout, view.joint_ids()
    data = mujoco.MjData(model)
    at, dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]
    signs = np.where(np.arange(len(ids)) == joint, sign, 1.0)
    step, flags, integrator = float(model.opt.timestep), int(model.opt.disableflags), int(model.opt.integrator)
    out = np.empty(len(starts))
    try:
        model.opt.disableflags = flags | _COMMAND_ALONE
        model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
        for k, start in enumerate(starts):
            mujoco.mj_resetData(model, data)
            data.qpos[at], data.qvel[dof] = rollout.joint_pos[start], rollout.joint_vel[start]
            _roll(model, data, torque, (start, window), (at, dof, signs), rollout.time)
            out[k] = data.qvel[dof[joint]] - rollout.joint_vel[start, joint]
            if data.warning.number.any():
                out[k] = np.nan
    finally:
        model.opt.timestep, model.opt.disableflags, model.opt.integrator = step, flags, integrator
    return out


def _roll(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    torque: _Torque,
    rows: tuple[int, int],
    layout: tuple[np.ndarray, np.ndarray, np.ndarray],
    time: np.ndarray,
) -> None:
    """Simulate `rows` (first, count) of the log from the state in `data`; `layout` is (qpos, dof, signs) of joints."""
    at, dof, signs = layout
    for row in range(rows[0], rows[0] + rows[1]):
        period = float(time[row + 1] - time[row])
        count = max(1, int(np.ceil(period / STEP)))
        model.opt.timestep = period / count
        for _ in range(count):
            data.qfrc_applied[dof] = torque.at(row, data.qpos[at], data.qvel[dof], signs)
            mujoco.mj_step(model, data)
