"""The torque that the declared model lacks, joint by joint: the tests of what a diagnosis leaves, nothing fitted.

The windows, their whitening and the tests are those of `diagnose`, so that both say the same of the same logs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.discrepancy import JointActivity, LackOfFit, lack_of_fit
from bumblebee.diagnosis.estimation import gauss_newton
from bumblebee.diagnosis.prepare import Material, gather
from bumblebee.diagnosis.residuals import window_weights
from bumblebee.diagnosis.thresholds.gap import Naming


@dataclass(frozen=True, eq=False)
class MissingTorque:
    """Missing torque of the declared model by the tests, on J joints."""

    left: LackOfFit
    material: Material
    """Windows and candidates that it was tested on; nothing is said of its joints that never move."""

    def cloud(self, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and missing torque [N m], (N,) each, of a joint in every segment of the fitted windows."""
        data, evidence = self.left.scene.data, self.left.scene.evidence
        q, v = (data.path.mean(values[..., joint]).ravel() for values in (data.q, data.v))
        return q, v, evidence.lacking(joint).ravel()

    def entries(self, units: dict[str, dict[str, str]], rule: Naming | None = None) -> dict[str, dict[str, Any]]:
        """Joint -> its torque, and what that goes with; first where it explains most of what the windows show.

        The size is that of the torques which a joint lacks by itself, whatever their form: far from a fit the basis
        functions' sizes are no more than first guesses.
        """
        implied = self.left.scene.evidence.implied
        rows = [(k, j, implied(k)) for k, j in enumerate(self.left.joints) if j.joint not in self.material.still]
        return {
            j.joint: {
                "unit": units[j.joint]["torque"],
                "mean": self.constant(k),
                "structured_rms": rms,
                "drive_rms": j.typical,
                "significant": j.significant,
                "p": j.p,
                "excess": j.excess,
                "depends_on": self.quantities(k, rule or Naming()) if j.significant else [],
            }
            for k, j, rms in sorted(rows, key=lambda row: -row[1].significant * row[1].excess)
        }

    def quantities(self, joint: int, rule: Naming) -> list[str]:
        """Quantities that the torque of a joint that lacks one depends on, the most important first.

        By the basis functions that were found beyond doubt on the fitted windows. That their sizes are the same on
        others, as a diagnosis asks, is too much where nothing was fitted and sensitivities are the declared model's.
        """
        found = [f for f in self.left.sought.found if f.joint == joint]
        sizes = [float(np.sqrt((np.einsum("fws,f->ws", f.torque, f.verdict.size) ** 2).mean())) for f in found]
        some = [f for f, size in zip(found, sizes, strict=True) if size > rule.part_of_largest * max(sizes)]
        named = dict.fromkeys(quantity for f in some for quantity in f.function.on)
        return list(named or self.left.joints[joint].depends_on)

    def constant(self, joint: int) -> float:
        """The constant torque [N m] that explains most of what a joint lacks."""
        evidence = self.left.scene.evidence
        return float(evidence.test(joint, np.ones((1, *evidence.score[joint].shape))).size[0])


def missing_torque(session: Session, config: DiagnosisConfig, say: Callable[[str], None]) -> MissingTorque:
    """Test the declared model; `BadInput` where no rollout has a stretch as long as a window."""
    with threadpool_limits(1, user_api="blas"):
        material = gather(session, config, np.random.default_rng(config.seed), say)
        problem = material.problem
        fit = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0]))
        left = lack_of_fit(problem, material.holdout.problem, fit, JointActivity(material.typical, material.still))
    return MissingTorque(left, material)
