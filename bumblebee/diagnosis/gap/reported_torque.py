"""The drive's own torque against what the model's drive would give: gain, bias and delay, joint by joint.

Where a log has `joint_torque`, the drive and the mechanics behind it can be told apart: what is wrong in the reported
torque is the drive's (gain, delay, limit); what is wrong although the torque is right is friction, inertia or load.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.simulation import Plant, command_inputs, plant_servos
from bumblebee.diagnosis.thresholds.gap import ReportedTorque
from bumblebee.measured.rollout import Rollout


def reported_torque(
    plant: Plant, rollouts: Sequence[Rollout], rule: ReportedTorque | None = None
) -> dict[str, dict[str, float]]:
    """Joint -> gain, bias [N m], delay [s] and correlation of the reported torque on the declared drive's.

    Empty where no rollout has `joint_torque`. The delay is the shift, up to `rule.latest`, at which both agree best.
    """
    rule = rule or ReportedTorque()
    some = [r for r in rollouts if r.joint_torque is not None and r.frames >= rule.fewest]
    if not some:
        return {}
    period = float(np.median([np.median(np.diff(r.time)) for r in some]))
    shifts = np.arange(0, max(1, int(rule.latest / period)) + 1)
    out = {}
    for j, name in enumerate(plant.joints):
        if plant.actuator[j] < 0:
            continue
        best = max((_fit(_pairs(plant, some, j, int(k))) | {"delay": float(k * period)} for k in shifts), key=_tie)
        if np.isfinite(best["correlation"]):
            out[name] = best
    return out


def _tie(entry: dict[str, float]) -> float:
    return entry["correlation"] if np.isfinite(entry["correlation"]) else -2.0


def _pairs(plant: Plant, rollouts: Sequence[Rollout], joint: int, shift: int) -> tuple[np.ndarray, ...]:
    """The model's torque, `shift` rows earlier, and the reported one."""
    model, reported = [], []
    for r in rollouts:
        servos = plant_servos(plant.of(r))
        control = servos.controls(command_inputs(plant, r))
        torque = servos.torque(r.joint_pos - plant.offset, r.joint_vel, control)[:, joint]
        model.append(torque[: len(torque) - shift])
        reported.append(np.asarray(r.joint_torque)[shift:, joint])
    return np.concatenate(model), np.concatenate(reported)


def _fit(pair: tuple[np.ndarray, ...]) -> dict[str, float]:
    x, y = pair
    spread = x.std()
    if spread < 1e-9 or y.std() < 1e-9:
        return {"gain": float("nan"), "bias": float(y.mean()), "correlation": float("nan")}
    correlation = float(np.corrcoef(x, y)[0, 1])
    gain = correlation * y.std() / spread
    return {"gain": float(gain), "bias": float(y.mean() - gain * x.mean()), "correlation": correlation}
