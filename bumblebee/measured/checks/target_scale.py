"""Check of the targets' scale: those of a motor before its gear, beside positions of the joint behind it.

A servo's target lies near its position. One that is several times the position throughout, in proportion, and beyond
the joint's range belongs to the motor, or has another unit. A soft servo under a feed-forward torque has targets far
from its positions, too; so the declared model is asked, which knows what the torque of such a target does.
"""

import numpy as np

from bumblebee.measured.checks.order import ORDER_LATE
from bumblebee.measured.checks.reversed_command import share_for_multiple, torque_limits
from bumblebee.measured.checks.sign import correlation
from bumblebee.measured.checks.units import is_slide, servo_gains
from bumblebee.measured.checks.view import View

_DEGREES = (40.0, 80.0)  # times the positions of a hinge: 57.3 or nearly, which the rule `degrees` judges
_MM = (500.0, 2000.0)  # of a slide: 1000


def check_target_scale(view: View) -> None:
    """Targets of position servos that are a multiple of the positions: fatal, and only where nothing else explains it.

    Joints without a range, and those that hardly move, are not judged; nor is any where one looks like degrees.
    """
    if view.rollout.joint_target is None or view.rollout.joint_torque_cmd is not None:
        return
    found = _multiples(view)
    if any(_DEGREES[0] < slope < _DEGREES[1] and not is_slide(view, joint) for joint, (slope, _) in found.items()):
        return
    for joint, (slope, fit) in found.items():
        if _model_agrees(view, joint, slope):
            _tell(view, joint, slope, fit)


def _tell(view: View, joint: int, slope: float, fit: float) -> None:
    expected = (
        f"targets at the joint (scale of joint_target in the import's map: one over the gear, about {1 / slope:.2g})"
    )
    most = float(np.abs(view.values("joint_target")[:, joint]).max())
    what = "of the motor, before its gear"
    if is_slide(view, joint) and _MM[0] < slope < _MM[1]:
        what += ", or mm"
    came = f"{slope:.3g} times the positions (correlation {fit:.2f}), up to {most:.3g}: {what}?"
    view.add(view.label("joint_target", joint), None, "target-scale", expected, came, fatal=True)


def _multiples(view: View) -> dict[int, tuple[float, float]]:
    """Servos' joints of a finite range whose targets are a multiple of their positions -> `_multiple`."""
    servos, ranges = servo_gains(view.model), view.ranges()
    judged = [k for k, name in enumerate(view.rollout.joints) if name in servos and np.isfinite(ranges[k]).all()]
    found = {joint: _multiple(view, joint, ranges[joint]) for joint in judged}
    return {joint: one for joint, one in found.items() if one is not None}


def _multiple(view: View, joint: int, limits: np.ndarray) -> tuple[float, float] | None:
    """How many times the positions the targets are, and their correlation; None where they are no multiple."""
    rule, width = view.limits, float(limits[1] - limits[0])
    place, target = view.rollout.joint_pos[:, joint], view.values("joint_target")[:, joint]
    reach = limits + rule.scale_within * width * np.array([-1.0, 1.0])
    outside = [(values < reach[0]) | (values > reach[1]) for values in (place, target)]
    if outside[0].any() or outside[1].mean() < rule.scale_outside or place.std() < rule.scale_motion * width:
        return None
    lags = [0, *(view.window(seconds) for seconds in ORDER_LATE)]
    late = [(place[lag:], target[: len(target) - lag]) for lag in lags]
    fit, best = max((correlation(*pair), k) for k, pair in enumerate(late))
    place, target = late[best]
    through_zero = float(place @ target / (place @ place))
    slope = float(np.cov(place, target)[0, 1] / place.var(ddof=1))
    proportional = abs(slope - through_zero) <= rule.scale_through_zero * through_zero
    found = fit >= rule.scale_correlation and through_zero >= rule.scale_slope and proportional
    return (through_zero, fit) if found else None


def _model_agrees(view: View, joint: int, slope: float) -> bool:
    """Whether the declared model predicts the joint by target / slope, or its servo cannot give what is asked."""
    share = share_for_multiple(view, joint, True, 1 / slope)
    if share is not None:
        return share >= view.limits.scale_model
    kp, _ = servo_gains(view.model)[view.rollout.joints[joint]]
    asked = kp * np.abs(view.values("joint_target")[:, joint] - view.rollout.joint_pos[:, joint])
    return bool(np.median(asked) > view.limits.scale_torque * torque_limits(view)[joint])
