"""One convention (sign, unit, order) that is wrong in a whole dataset, told from recordings that are faulty.

A logger writes all its rollouts by one convention. Where a check of it sets aside many of them on the same joint, those
that pass are wrong too: the joint moved too little in them to show it, and what is fitted to them is no effect of the
robot. Faults of single recordings (a dead channel, a lost row) say nothing about the others, however many there are.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.thresholds.dataset import Conventions
from bumblebee.errors import BadInput
from bumblebee.measured.checks import Finding
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.usable import Review


@dataclass(frozen=True)
class _Convention:
    """Verdict of a rule of the checks on a whole logger."""

    remedy: str = ""
    """Setting in the map of an import; empty where the finding says what to do."""
    by_joint: bool = True
    """Whether each joint has its own; False: the check names the worst joint of a column."""
    of_all: bool = True
    """Whether it spoils rollouts that pass the check, too."""


_CONVENTIONS = {
    "target-copy": _Convention(),
    "degrees": _Convention("set angle_unit to deg (of mm: m and a scale of 0.001)", by_joint=False),
    "target-scale": _Convention("set scale of joint_target to one over the gear"),
    "joint-order": _Convention("set the names of joint_pos and of joint_target in one order"),
    "velocity-sign": _Convention("set scale of joint_vel, or of joint_pos, to -1"),
    "response-sign": _Convention("set scale of the command, or of joint_pos and joint_vel, to -1"),
    "quaternion-order": _Convention("set quat_order to xyzw"),
    "velocity-frame": _Convention("set base_ang_vel and base_lin_vel to columns in the base frame"),
    "gyro-sign": _Convention("set base_quat to columns of the rotation from base to world"),
    "velocity-derivative": _Convention(
        "leave joint_vel out, which is then made of joint_pos, or set its scale", of_all=False
    ),
    "range": _Convention("set scale or offset of joint_pos", of_all=False),
}


_DEGREES = {
    "joint_vel": "set scale of joint_vel to 0.01745 on all joints (positions are in rad)",
    "joint_target": "set scale of joint_target to 0.01745 on all joints, of mm to 0.001 (positions are in rad, m)",
    "base_ang_vel": "set gyro_unit to deg",
}
"""Setting where the rule `degrees` is broken in such a column and not in joint_pos."""


@dataclass(frozen=True)
class _Common:
    """A rule that is broken in a large share of the rollouts on the same joints."""

    rule: str
    joints: tuple[str, ...]
    """The joints, or the columns of the base."""
    count: int
    first: Finding
    spoils: bool
    """Whether the rollouts that pass are wrong, too, as far as can be seen."""

    @property
    def remedy(self) -> str:
        """Setting for the map of an import."""
        usual = _CONVENTIONS[self.rule].remedy
        return _DEGREES.get(self.first.column.split("[")[0], usual) if self.rule == "degrees" else usual


def wrong_conventions(
    reviewed: Sequence[tuple[Rollout, Review]], dataset: object, rule: Conventions
) -> tuple[BadInput | None, list[str]]:
    """The error that ends the use of a dataset of one wrong convention, and warnings where that is open.

    Where none passes the checks, what all have in common is the error.

    Args:
        reviewed: every rollout that could be read, with what the checks say of it.
        dataset: its name, for the messages.
        rule: from when on faults are common, and which rollouts speak against it.
    """
    found = sorted(_common(reviewed, rule), key=lambda common: -common.count)
    ends = [common for common in found if common.spoils or common.count == len(reviewed)]
    if ends:
        return _error(ends[0], len(reviewed), dataset), []
    return None, [_warning(common, len(reviewed)) for common in found]


def _common(reviewed: Sequence[tuple[Rollout, Review]], rule: Conventions) -> Iterator[_Common]:
    """Every convention that seems wrong in the share of the rollouts that is asked for."""
    least = max(rule.rollouts, rule.share * len(reviewed))
    for name, convention in _CONVENTIONS.items():
        broken: dict[str, dict[int, Finding]] = {}
        for k, (_, review) in enumerate(reviewed):
            for finding in (f for f in review.fatal if f.rule == name):
                key = finding.column if convention.by_joint else finding.column.split("[")[0]
                broken.setdefault(key, {}).setdefault(k, finding)
        common = {key: found for key, found in broken.items() if len(found) >= least}
        if not common:
            continue
        first = next(iter(common.values()))
        columns = {f.column for found in common.values() for f in found.values()}
        joints = tuple(sorted({column.partition("[")[2].removesuffix("]") or column for column in columns}))
        open_ones = [not _denied(reviewed, name, key, found, rule) for key, found in common.items()]
        spoils = convention.of_all and (any if convention.by_joint else all)(open_ones)
        yield _Common(name, joints, len(set().union(*common.values())), first[min(first)], spoils)


def _denied(
    reviewed: Sequence[tuple[Rollout, Review]], name: str, column: str, broken: Iterable[int], rule: Conventions
) -> bool:
    """Whether a rollout passes the rule `name` in which the column moves as it does where the rule is broken.

    One that the rule doubts is no evidence either way, nor is one that is set aside: not all checks were made of it.
    """
    usual = np.median([_motion(reviewed[k][0], column) for k in broken])
    plain = (
        rollout
        for rollout, review in reviewed
        if not review.fatal and not any(f.rule == name and f.column.startswith(column) for f in review.findings)
    )
    return any(
        _motion(rollout, column) >= rule.moves * usual and (name != "response-sign" or _follows(rollout, column, rule))
        for rollout in plain
    )


def _follows(rollout: Rollout, column: str, rule: Conventions) -> bool:
    """Whether a joint's position changes as its target does; True for torques, which no position follows."""
    if not column.startswith("joint_target"):
        return True
    target, place = _values(rollout, column), _values(rollout, column.replace("joint_target", "joint_pos"))
    period = float(np.median(np.diff(rollout.time)))
    lag = int(np.clip(round(rule.follow_span / period), 1, rollout.frames - 2))
    changes = np.stack([values[lag:, 0] - values[:-lag, 0] for values in (target, place)])
    return bool((changes.std(axis=1) > 0).all() and np.corrcoef(changes)[0, 1] >= rule.follow_correlation)


def _motion(rollout: Rollout, column: str) -> float:
    """Largest standard deviation of a column's values, or of one joint's where the name has it in brackets."""
    return float(_values(rollout, column).std(axis=0).max())


def _values(rollout: Rollout, column: str) -> np.ndarray:
    """(T, width) of a column, (T, 1) of one joint's; zeros for one that was not logged."""
    name, _, joint = column.partition("[")
    values = getattr(rollout, name)
    if values is None:
        return np.zeros((rollout.frames, 1))
    return values[:, [rollout.joints.index(joint.removesuffix("]"))]] if joint else values


def _error(common: _Common, rollouts: int, dataset: object) -> BadInput:
    first = common.first
    came = (
        f"otherwise on {_listed(common.joints)} in {common.count} of {rollouts} rollouts "
        f"(in {first.file}, column {first.column}: {first.came})"
    )
    do = first.do or (
        "That is one convention of the logger or the model, no fault of single recordings: "
        f"{common.remedy} in the import's map, or correct the model; rollouts by another convention "
        "belong in another dataset."
    )
    return BadInput(f"{dataset}: rule {common.rule}", first.expected, came, do)


def _warning(common: _Common, rollouts: int) -> str:
    told = f"{common.count} of {rollouts} rollouts were set aside by rule {common.rule} on {_listed(common.joints)}"
    do = f"if that is one convention of the logger, {common.remedy} in the import's map."
    return f"{told}: {common.first.do or do}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
