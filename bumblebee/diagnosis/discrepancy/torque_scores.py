"""Scores of torques that the model lacks on its joints, from whitened windows, ready for any number of questions.

The answers of a window to impulses of torque turn its residual into scores: for each joint and fifth of the window, how
much the cost would fall with a little torque there, and how fast that gain would end. Any formula or table for a torque
along the path is then tested by a few products of small matrices, as the catalogue's candidates are, with all that the
windows say and through contact and servo.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from bumblebee.diagnosis.comparison import z_value
from bumblebee.diagnosis.estimation import project, solve
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.sensitivities import Answers
from bumblebee.diagnosis.thresholds.discrepancy import TorqueScores


@dataclass(frozen=True, eq=False)
class Verdict:
    """Verdict on one group of columns on one joint."""

    z: float
    """The test's p-value as a two-sided standard normal; the smaller one of two tests, see `Evidence.test`."""
    gain: float
    """Fall of the cost over the reduced chi-square: chi-square with as many degrees of freedom as columns."""
    size: np.ndarray
    """(F,) coefficients."""
    error: np.ndarray
    """(F,) standard errors."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """W windows, J joints, S segments a window, M whitened values, B directions already explained."""

    answers: np.ndarray
    """(J, W, S, M) whitened answer to 1 N m on a joint during a segment."""
    left: np.ndarray
    """(W, M) residual with the basis taken out."""
    basis: np.ndarray
    """(B, W, M) nuisances and the columns of what has been found."""
    inverse: np.ndarray
    """(B, B) of the basis's weighted normal matrix."""
    weights: np.ndarray
    """(W,)."""
    score: np.ndarray
    """(J, W, S) weighted product of answers and `left`."""
    normal: np.ndarray
    """(J, W, S, S) weighted products of the answers."""
    cross: np.ndarray
    """(J, W, S, B) weighted products of answers and basis."""
    spread: float
    """Mean square of `left`, weighted: 1 where sensor noise is all that is left."""
    rule: TorqueScores

    @property
    def joints(self) -> int:
        """J."""
        return len(self.answers)

    def with_columns(self, problem: Problem, residual: np.ndarray, columns: np.ndarray) -> "Evidence":
        """Evidence given other columns (F, W, M) and another residual (W, M), weighed as these leave it."""
        basis, inverse = project(problem, columns, self.weights)
        left = residual - np.tensordot(solve(basis, inverse, residual, self.weights), basis, axes=1)
        return make_evidence(problem, self.answers, residual, columns, window_weights(left))

    def unweighted(self, problem: Problem, residual: np.ndarray, columns: np.ndarray) -> "Evidence":
        """Evidence with all windows weighed alike."""
        return make_evidence(problem, self.answers, residual, columns, np.ones_like(self.weights))

    def column(self, joint: int, torque: np.ndarray) -> np.ndarray:
        """Whitened columns (F, W, M) of torques (F, W, S) on a joint."""
        return np.einsum("fws,wsm->fwm", torque, self.answers[joint], optimize=True)

    def gains(self, joint: int, torque: np.ndarray, groups: Sequence[slice]) -> np.ndarray:
        """Fall of the cost (G,) by each group of torques on a joint, in units of the residual's reduced chi-square.

        Args:
            joint: index of the joint.
            torque: (E, W, S) mean torques of all columns [N m] for coefficient 1.
            groups: rows of `torque` that belong together.
        """
        flat = torque.reshape(len(torque), -1)
        wide = np.einsum("ews,wst->ewt", torque, self.normal[joint], optimize=True).reshape(flat.shape)
        total = flat @ self.score[joint].ravel()
        cross = flat @ self.cross[joint].reshape(flat.shape[1], -1)
        shares = cross @ self.inverse
        out = np.zeros(len(groups))
        sizes = np.array([g.stop - g.start for g in groups])
        for count in np.unique(sizes):
            which = np.flatnonzero(sizes == count)
            rows = np.stack([np.arange(groups[k].start, groups[k].stop) for k in which.tolist()])
            raw = np.einsum("gfn,ghn->gfh", wide[rows], flat[rows], optimize=True)
            curvature = raw - np.einsum("gfb,ghb->gfh", shares[rows], cross[rows], optimize=True)
            out[which] = _falls(total[rows], curvature, np.einsum("gff->gf", raw), self.rule)
        return out / max(self.spread, 1.0)

    def test(self, joint: int, torque: np.ndarray) -> Verdict:
        """Test of torques (F, W, S) on a joint, all of them together.

        The gain is compared with chi-square, and the sizes with their errors by how the windows differ (Wald's test);
        the less sure of both counts, for the first trusts the whitening and the second the number of windows.
        """
        rule, flat = self.rule, torque.reshape(len(torque), -1)
        wide = np.einsum("fws,wst->fwt", torque, self.normal[joint], optimize=True)
        normals = np.einsum("fws,gws->wfg", wide, torque, optimize=True)
        cross = flat @ self.cross[joint].reshape(flat.shape[1], -1)
        shares = cross @ self.inverse
        raw = normals.sum(axis=0)
        curvature = raw - shares @ cross.T
        size = np.zeros(len(torque))
        seen = np.diag(curvature) > rule.unexplained * np.diag(raw) + 1e-12
        if not seen.any():
            return Verdict(0.0, 0.0, size, np.full(len(torque), np.inf))
        inverse = np.zeros_like(curvature)
        inverse[np.ix_(seen, seen)] = _inverse(curvature[np.ix_(seen, seen)], rule.rank)
        total = flat @ self.score[joint].ravel()
        size = inverse @ total
        gain = float(total @ size) / max(self.spread, 1.0)
        # Scores of the windows at the estimate, the basis refitted: what they differ by is the sizes' error.
        own = np.einsum("fws,ws->wf", torque, self.score[joint]) - normals @ size
        moved = self.column(joint, torque)
        refit = self.left - np.tensordot(size, moved, axes=1) + np.tensordot(shares.T @ size, self.basis, axes=1)
        own += np.einsum("fws,wsb,b->wf", torque, self.cross[joint], shares.T @ size, optimize=True)
        own -= np.einsum("bwm,wm->wb", self.basis, refit * self.weights[:, None], optimize=True) @ shares.T
        spread = own.T @ own + rule.least_variance * np.diag(np.maximum(np.diag(curvature), 0.0))
        covariance = inverse @ spread @ inverse
        rank = int(np.linalg.matrix_rank(curvature[np.ix_(seen, seen)], rtol=rule.rank, hermitian=True))
        wald = float(size[seen] @ _inverse(covariance[np.ix_(seen, seen)], rule.rank) @ size[seen])
        z = min(chi_z(gain, rank), z_value(wald, rank, len(own)))
        return Verdict(z, gain, size, np.sqrt(np.maximum(np.diag(covariance), 0.0)))

    def lacking(self, joint: int) -> np.ndarray:
        """(W, S) torque [N m] that a joint lacks in every segment, by itself; what noise hides is drawn to zero."""
        normal, score = self.normal[joint], self.score[joint]
        ridge = self.rule.ridge * np.einsum("wss->w", normal)[:, None, None] / normal.shape[1] * np.eye(normal.shape[1])
        return np.linalg.solve(normal + ridge, score[..., None])[..., 0]

    def chi_square(self, joint: int, some: np.ndarray | None = None, spared: int = 0) -> tuple[float, int]:
        """Chi-square of a torque of its own in every segment of every window, and its degrees of freedom.

        Directions that sensor noise hides (whitened answers below a hundredth of the strongest) are left out; `some`
        (W,) bool are the windows that count, all by default, less the `spared` ones that say most.
        """
        values, vectors = np.linalg.eigh(self.normal[joint])
        along = np.einsum("wst,ws->wt", vectors, self.score[joint])
        seen = values > self.rule.visible * values.max()
        if some is not None:
            seen &= some[:, None]
        values = np.where(seen, values, 1.0)
        squares = np.where(seen, along**2 / values / self.weights[:, None], 0.0).sum(axis=1)
        keep = np.argsort(squares)[: max(0, len(squares) - spared)]
        return float(squares[keep].sum()), int(seen[keep].sum())

    def implied(self, joint: int) -> float:
        """RMS [N m] of the torques that a joint's chi-square above noise stands for, if all segments lack alike."""
        value, count = self.chi_square(joint)
        return float(np.sqrt(max(value - count, 0.0) / max(np.einsum("wss->", self.normal[joint]), 1e-30)))


def _falls(total: np.ndarray, curvature: np.ndarray, raw: np.ndarray, rule: TorqueScores) -> np.ndarray:
    """(G,) falls of the cost for scores (G, F) and matrices (G, F, F); `raw` (G, F) their diagonals without a basis."""
    diagonal = np.einsum("gff->gf", curvature)
    scale = np.where(diagonal > rule.unexplained * raw + 1e-12, 1.0 / np.sqrt(np.maximum(diagonal, 1e-30)), 0.0)
    values, vectors = np.linalg.eigh(curvature * scale[:, :, None] * scale[:, None, :])
    along = np.einsum("gfh,gf->gh", vectors, total * scale)
    seen = values > rule.rank * np.maximum(values[:, -1:], 1e-12)
    return np.where(seen, along**2 / np.where(seen, values, 1.0), 0.0).sum(axis=1)


def _inverse(matrix: np.ndarray, rank: float) -> np.ndarray:
    """Pseudo-inverse of a normal matrix (F, F) whose rows may have different units."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    return np.linalg.pinv(matrix * np.outer(scale, scale), rcond=rank, hermitian=True) * np.outer(scale, scale)


def chi_z(value: float, count: int) -> float:
    """A chi-square of `count` degrees of freedom as a two-sided standard normal."""
    log_p = float(chi2.logsf(min(value, 1200.0), count))
    return float(norm.isf(np.exp(max(log_p, -600.0)) / 2))


def make_evidence(
    problem: Problem, answers: np.ndarray, residual: np.ndarray, columns: np.ndarray, weights: np.ndarray
) -> Evidence:
    """Scores of `residual` (W, M) conditional on the problem's nuisances and `columns` (F, W, M).

    Args:
        problem: windows and nuisances.
        answers: (J, W, S, M) whitened, see `joint_answers`.
        residual: (W, M) whitened, nuisances not taken out.
        columns: (F, W, M) of the effects that were found, (0, W, M) for none.
        weights: (W,) of the windows.
    """
    basis, inverse = project(problem, columns, weights)
    left = residual - np.tensordot(solve(basis, inverse, residual, weights), basis, axes=1)
    heavy = answers * weights[None, :, None, None].astype(np.float32)
    return Evidence(
        answers=answers,
        left=left,
        basis=basis,
        inverse=inverse,
        weights=weights,
        score=np.einsum("jwsm,wm->jws", heavy, left, optimize=True),
        normal=np.matmul(heavy, answers.transpose(0, 1, 3, 2)).astype(float),
        cross=np.matmul(heavy, basis.transpose(1, 2, 0)[None].astype(np.float32)).astype(float),
        spread=float((weights[:, None] * left**2).mean() / weights.mean()),
        rule=problem.thresholds.discrepancy.torque_scores,
    )


def joint_answers(problem: Problem, answers: Answers) -> np.ndarray:
    """(J, W, S, M) whitened answers of the joints to 1 N m."""
    raw = answers.torque[problem.plant.dof]
    white = problem.whitener(raw.reshape(-1, *raw.shape[2:]), centre=False)
    shape = (*raw.shape[:2], *white.shape[1:])
    return white.reshape(shape).transpose(0, 2, 1, 3).astype(np.float32)
