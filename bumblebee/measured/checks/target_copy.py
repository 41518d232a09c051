"""Check that targets are commands: those that repeat the encoders' readings say nothing of what the drives were told.

Imitation-learning datasets often fill the action with the measured position of the same or of the next row. No servo
follows exactly, however stiff, in every row of a motion, and no command has the noise of the encoder.
"""

import numpy as np

from bumblebee.measured.checks.units import driven_joints
from bumblebee.measured.checks.view import View
from bumblebee.measured.conditions import INSISTED

RULE = "target-copy"
_ROWS = {0: "the same row", 1: "the next row", -1: "the row before"}
_ROUNDING = 2 * float(np.finfo(np.float32).eps)  # of a value, or rad (m): float32 and a change of units
_EXPECTED = "targets that the drives were sent"
_DO = (
    "Log the targets that the drives were sent (by a leader, a policy, a controller); to have these taken for commands "
    f"all the same, import with --set {'='.join(INSISTED)}."
)


def check_target_copy(view: View) -> None:
    """Driven joints whose targets equal the positions of the same or a neighbouring row throughout: fatal.

    A joint is judged once it has moved in as many rows as the check of frozen channels asks for.
    """
    rollout = view.rollout
    name, value = INSISTED
    insisted = (rollout.meta.get("conditions") or {}).get(name) == value
    if rollout.joint_target is None or rollout.joint_torque_cmd is not None or insisted:
        return
    driven = driven_joints(view.model)
    for joint in (k for k, joint in enumerate(rollout.joints) if joint in driven):
        place, target = rollout.joint_pos[:, joint], rollout.joint_target[:, joint]
        moved = int((np.abs(np.diff(place)) > _rounding(place[1:])).sum())
        if moved < view.lasting:
            continue
        row = next((row for shift, row in _ROWS.items() if _equal(place, target, shift)), None)
        if row is not None:
            came = f"the targets are the measured positions of {row}, in every row"
            view.add(view.label("joint_target", joint), None, RULE, _EXPECTED, came, fatal=True, do=_DO)


def _equal(place: np.ndarray, target: np.ndarray, shift: int) -> bool:
    """Whether targets (T,) are the positions (T,) of `shift` rows later; the rows without a partner are left out."""
    later, earlier = slice(max(shift, 0), len(place) + min(shift, 0)), slice(max(-shift, 0), len(place) - max(shift, 0))
    place, target = place[later], target[earlier]
    return bool((np.abs(target - place) <= _rounding(place)).all())


def _rounding(values: np.ndarray) -> np.ndarray:
    return _ROUNDING * np.maximum(np.abs(values), 1.0)
