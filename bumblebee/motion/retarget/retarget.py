"""A person's motion onto a robot: low-passed, scaled, fitted over the whole trajectory."""

from itertools import pairwise

import numpy as np

from bumblebee import quaternions
from bumblebee.errors import BadInput
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.retarget.branch import far_note, solve_near
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import SIDES, Robot, this_robot
from bumblebee.motion.retarget.solve import Trajectory
from bumblebee.motion.retarget.targets import Targets, at_rate, targets
from bumblebee.robot.facts import joint_names

VERSION = 3
"""Version of the method: a cached result of another version is made again."""
_MOST_SECONDS = 3600.0
_RATES = (1.0, 1000.0)  # Hz
_REACH = 1000.0  # m from the world's origin
_SHORTEST = 0.03  # m of a thigh or shin: a doll's are longer
LEGS = [(f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in (("hip", "knee"), ("knee", "ankle"))]
_CLIMB = 0.15  # m: more than the floor of a recording drifts, less than a step of stairs
_LEAST = 5  # frames: an acceleration needs three
_LONGEST = 600  # frames fitted at once: a hard place then holds up its own part only
_OVERLAP = 60  # frames that neighbouring parts share, faded from one to the other


def retarget(motion: HumanMotion, fps: float = 50.0, config: RetargetConfig | None = None) -> RawMotion:
    """A person's motion on the G1 at `fps` [Hz].

    Raises:
        BadInput: fewer frames than an acceleration needs, NaN, legs without length.
    """
    config = config or RetargetConfig()
    target = aim(motion, this_robot(), fps, config)
    at = fit(target, this_robot(), config)
    assert this_robot().tree.joints == joint_names()
    notes = (*motion.notes, *fit_notes(at, target, this_robot(), config))
    return RawMotion(
        motion.name, fps, at.root, root_quat(at), at.joint, motion.file, motion.first_row, motion.part, notes
    )


def aim(motion: HumanMotion, robot: Robot, fps: float, config: RetargetConfig) -> Targets:
    """Targets for a robot at `fps` [Hz]."""
    _check(motion)
    positions = at_rate(motion, fps, config.cutoff)
    if len(positions) < _LEAST:
        raise BadInput(motion.where, f"at least {_LEAST} frames at {fps:g} Hz", str(len(positions)))
    return targets(positions, fps, robot, config)


def _check(motion: HumanMotion) -> None:
    """Refuse what no robot can follow, so that nothing after this meets a NaN or divides by nothing."""
    if not _RATES[0] <= motion.fps <= _RATES[1]:
        raise BadInput(motion.where, f"a frame rate from {_RATES[0]:g} to {_RATES[1]:g} Hz", f"{motion.fps:g}")
    frames, seconds = len(motion.positions), len(motion.positions) / motion.fps
    if seconds > _MOST_SECONDS:
        raise BadInput(motion.where, f"a motion of at most {_MOST_SECONDS:g} s", f"{seconds:.0f} s", "Cut it.")
    if frames < 2:
        raise BadInput(motion.where, "at least 2 frames", str(frames))
    bad = np.argwhere(~(np.abs(motion.positions) <= _REACH))  # NaN is not within reach either
    if len(bad):
        frame, number, _ = bad[0]
        came = str(motion.positions[tuple(bad[0])])
        place = f"{motion.where}, {motion.row(int(frame))}, {LANDMARKS[number]}"
        raise BadInput(place, f"a position within {_REACH:g} m", came, f"{len(bad):,} such values in the motion.")
    for a, b in LEGS:
        length = float(np.median(np.linalg.norm(motion.landmark(a) - motion.landmark(b), axis=-1)))
        if length < _SHORTEST:
            raise BadInput(f"{motion.where}, {a} to {b}", f"at least {_SHORTEST:g} m apart", f"{length:.3g} m")


def fit_notes(at: Trajectory, target: Targets, robot: Robot, config: RetargetConfig) -> tuple[str, ...]:
    """Notes on where a robot's motion is another than the person's."""
    return (*_climb(target), *far_note(at, target, robot, config))


def _climb(target: Targets) -> tuple[str, ...]:
    """A note where the floor rises or falls under the person: on the robot's flat floor this is another motion."""
    rise = float(np.ptp(target.floor))
    return (f"the floor under the person moves by {rise:.2f} m, for the robot it is flat",) if rise > _CLIMB else ()


def fit(target: Targets, robot: Robot, config: RetargetConfig) -> Trajectory:
    """The trajectory of any robot that fits the targets, solved in parts that overlap."""
    parts = [solve_near(target.part(start, end), robot, config) for start, end in _parts(len(target.hips))]
    return _joined(parts)


def root_quat(at: Trajectory) -> np.ndarray:
    """The root's orientation (T, 4) wxyz."""
    return quaternions.continuous(quaternions.from_matrices(at.turn))


def _parts(frames: int) -> list[tuple[int, int]]:
    """Where parts of about `_LONGEST` frames start and end; each shares `_OVERLAP` frames with the next."""
    count = max(1, int(np.ceil((frames - _OVERLAP) / (_LONGEST - _OVERLAP))))
    edges = np.linspace(0, max(frames - _OVERLAP, 0), count + 1).round().astype(int)
    return [(int(start), min(int(end) + _OVERLAP, frames)) for start, end in pairwise(edges)]


def _joined(parts: list[Trajectory]) -> Trajectory:
    """One trajectory, faded where two parts overlap."""
    whole = parts[0]
    for after in parts[1:]:
        share = np.linspace(0, 1, _OVERLAP)[:, None]
        share = share * share * (3 - 2 * share)
        first, second = (quaternions.from_matrices(t) for t in (whole.turn[-_OVERLAP:], after.turn[:_OVERLAP]))
        turn = quaternions.slerp(first, second, share[:, 0])
        middle = Trajectory(
            (1 - share) * whole.root[-_OVERLAP:] + share * after.root[:_OVERLAP],
            quaternions.to_matrices(turn),
            (1 - share) * whole.joint[-_OVERLAP:] + share * after.joint[:_OVERLAP],
        )
        pieces = (
            Trajectory(*(a[:-_OVERLAP] for a in whole.arrays())),
            middle,
            Trajectory(*(a[_OVERLAP:] for a in after.arrays())),
        )
        whole = Trajectory(*(np.concatenate(rows) for rows in zip(*(p.arrays() for p in pieces), strict=True)))
    return whole
