"""View of a rollout for every check: the rollout, the model's facts about its joints, the limits; and its findings."""

from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from bumblebee.measured.checks.finding import Finding
from bumblebee.measured.checks.thresholds import Thresholds
from bumblebee.measured.rollout import Rollout


@dataclass
class View:
    """One rollout beside its declared model; checks add to `findings` and read what earlier ones found."""

    file: str
    rollout: Rollout
    model: mujoco.MjModel
    contract: dict[str, Any] | None
    limits: Thresholds
    findings: list[Finding] = field(default_factory=list)

    def add(
        self,
        column: str,
        row: int | np.integer | None,
        rule: str,
        expected: str,
        came: str,
        *,
        fatal: bool,
        do: str = "",
    ) -> None:
        """Note a finding."""
        row = None if row is None else int(row)
        self.findings.append(Finding(self.file, column, row, rule, expected, came, bool(fatal), do))

    def found(self, rule: str, column: str = "") -> bool:
        """Whether a rule was broken before, in a column whose name starts so."""
        return any(finding.rule == rule and finding.column.startswith(column) for finding in self.findings)

    def values(self, column: str) -> np.ndarray:
        """A column that is known to be there."""
        values = getattr(self.rollout, column)
        assert values is not None, column
        return values

    def label(self, column: str, joint: int | np.integer) -> str:
        """The column's name with the joint in brackets."""
        return f"{column}[{self.rollout.joints[joint]}]"

    @property
    def period(self) -> float:
        """Median time between rows [s]."""
        return float(np.median(np.diff(self.rollout.time)))

    @property
    def lasting(self) -> int:
        """Rows that a reading must last to count as evidence: those of `freeze_seconds`, at least 10."""
        return max(10, round(self.limits.freeze_seconds / self.period))

    @property
    def floating(self) -> bool:
        """Whether the model has a free base."""
        return bool((self.model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).any())

    def joint_ids(self) -> list[int]:
        """The model's joint id for every column, -1 where the model has no such joint."""
        return [mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in self.rollout.joints]

    def ranges(self) -> np.ndarray:
        """(J, 2) the model's position limits [rad or m]; infinite where there is none."""
        ranges = np.tile([-np.inf, np.inf], (len(self.rollout.joints), 1))
        for row, joint in enumerate(self.joint_ids()):
            if joint >= 0 and self.model.jnt_limited[joint]:
                ranges[row] = self.model.jnt_range[joint]
        return ranges

    def window(self, seconds: float) -> int:
        """Rows that span at least these seconds, 1 to a third of the file."""
        return int(np.clip(np.ceil(seconds / self.period - 1e-6), 1, max(1, (self.rollout.frames - 1) // 3)))


def integral(time: np.ndarray, rate: np.ndarray, window: int) -> np.ndarray:
    """Trapezoidal integral of `rate` (T, ...) over `window` rows, from every row: (T - window, ...)."""
    steps = np.diff(time).reshape(-1, *[1] * (rate.ndim - 1)) * (rate[1:] + rate[:-1]) / 2
    total = np.concatenate([np.zeros_like(rate[:1]), np.cumsum(steps, axis=0)])
    return total[window:] - total[:-window]
