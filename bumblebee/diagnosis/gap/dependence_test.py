"""Does structure remain in the torque that a model lacks, in which joint, and on what does it depend?

Boosted trees learn each joint's missing torque on the fitted rollouts from everything that it might depend on, and
predict it on the held-out ones. Where nothing is left they predict nothing. The gain is judged over half-second blocks,
one-sided, with a Bonferroni bound over the joints. A quantity matters where exchanging its blocks spoils the
prediction. Beside it a Ljung-Box test says whether what remains follows from what was before.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, wilcoxon
from scipy.stats import t as student
from sklearn.ensemble import HistGradientBoostingRegressor

from bumblebee.diagnosis.gap.torque_residual import TorqueResidual
from bumblebee.diagnosis.report import measured_curve

LEVEL = 0.01
_LEAST = 0.01  # share of a joint's typical torque below which structure is not worth a word
_CLIP, _TAIL = 5.0, 1.5  # robust standard deviations, and reach of the bulk: rare impacts must not decide
_LAGS = 10
_NEIGHBOURS = 6  # other joints that are looked at, those that the residual goes with most
QUANTITIES = ("position", "velocity", "target", "torque", "time", "history")


@dataclass(frozen=True)
class JointStructure:
    """What is left in one joint."""

    joint: str
    p: float
    """Of the held-out gain, Bonferroni over the joints."""
    share: float
    """Share of the held-out residual's variance that is predicted."""
    rms: float
    """RMS of the prediction [N m]."""
    typical: float
    """RMS torque of the joint's servo, or of what was commanded [N m]."""
    depends_on: tuple[str, ...]
    """Quantities of `QUANTITIES` and "another joint (NAME)", the most important first."""
    ljung_box: float
    """p that the held-out residual does not follow from its own past."""

    @property
    def significant(self) -> bool:
        """Whether there is structure, and enough of it to matter."""
        return self.p < LEVEL and self.rms > _LEAST * self.typical and self.share > 0


def other_joint(name: str) -> str:
    """How a dependence on another joint is called."""
    return f"another joint ({name})"


def clipped(values: np.ndarray) -> np.ndarray:
    """`values` (N,) with the 2 % of outliers brought nearer; a signal's own long tails stay."""
    middle = np.median(values)
    away = np.abs(values - middle)
    reach = max(_CLIP * 1.4826 * np.median(away), _TAIL * float(np.quantile(away, 0.98))) + 1e-12
    return np.clip(values, middle - reach, middle + reach)


def joint_structure(train: TorqueResidual, held: TorqueResidual, joint: int, seed: int = 0) -> JointStructure:
    """Test one joint; `train` and `held` share no window."""
    names, x = _features(train, joint)
    _, z = _features(held, joint, names)
    y, target = clipped(train.missing[:, joint]), clipped(held.missing[:, joint])
    centre = y.mean()
    trees = HistGradientBoostingRegressor(
        max_iter=60, learning_rate=0.1, max_leaf_nodes=8, min_samples_leaf=40, l2_regularization=10.0, random_state=seed
    ).fit(x, y)
    said = trees.predict(z)
    p, gain = gain_test(target - centre, target - said, held.block)
    power = float(((target - centre) ** 2).mean())
    drive = np.concatenate((train.tau[:, joint], held.tau[:, joint]))
    lacking = np.concatenate((train.missing[:, joint], held.missing[:, joint]))
    found = JointStructure(
        joint=held.joints[joint],
        p=min(1.0, p * len(held.joints)),
        share=gain / max(power, 1e-30),
        rms=float(np.sqrt(((said - centre) ** 2).mean())),
        typical=float(max(np.sqrt((drive**2).mean()), np.abs(np.median(lacking)), 1e-9)),
        depends_on=(),
        ljung_box=_ljung_box(target - centre, held),
    )
    if not found.significant:
        return found
    depends = _important(trees, names, z, target, said, held, seed)
    return JointStructure(**{**found.__dict__, "depends_on": depends})


def gain_test(before: np.ndarray, after: np.ndarray, block: np.ndarray) -> tuple[float, float]:
    """One-sided p that `after` (N,) is closer to zero than `before`, over blocks, and the mean gain.

    By the mean and by Wilcoxon's ranks, the better of both doubled: a weak effect shows in few blocks, and the gain of
    a strong one is so skewed that its mean says little, though all blocks agree.
    """
    gain = np.bincount(block, before**2 - after**2)
    count = np.bincount(block)
    gain, count = gain[count > 0], count[count > 0]
    mean = gain.sum() / count.sum()
    if len(gain) < 5:
        return 1.0, float(mean)
    if mean <= 0:
        return 1.0, float(mean)
    spread = np.sqrt(((gain - mean * count) ** 2).sum() * len(gain) / (len(gain) - 1)) / count.sum()
    by_mean = float(student.sf(mean / max(spread, 1e-30), len(gain) - 1))
    by_rank = float(wilcoxon(gain / count, alternative="greater", zero_method="zsplit").pvalue)
    return min(1.0, 2 * min(by_mean, by_rank)), float(mean)


def _features(data: TorqueResidual, joint: int, names: list[str] | None = None) -> tuple[list[str], np.ndarray]:
    """Columns by name; the group that a column belongs to is what stands before its colon."""
    columns = {
        "position:q": data.q[:, joint],
        "velocity:v": data.v[:, joint],
        "target:u - q": data.u[:, joint] - data.q[:, joint],
        "target:rate": data.rate[:, joint],
        "torque:tau": data.tau[:, joint],
        "time:t": data.t,
    }
    columns |= {f"history:play {k}": data.history[:, joint, k] for k in range(data.history.shape[2])}
    for k, name in enumerate(data.joints):
        if k != joint:
            columns |= {f"{other_joint(name)}:q": data.q[:, k], f"{other_joint(name)}:v": data.v[:, k]}
    if names is None:
        own = [name for name in columns if not name.startswith("another joint")]
        y = data.missing[:, joint] - data.missing[:, joint].mean()
        others = [name for name in columns if name.startswith("another joint")]
        tie = {name: abs(float(np.corrcoef(columns[name], y)[0, 1])) if np.ptp(columns[name]) else 0 for name in others}
        best = sorted({name.rsplit(":", 1)[0] for name in others}, key=lambda j: -max(tie[f"{j}:q"], tie[f"{j}:v"]))
        names = own + [name for name in others if name.rsplit(":", 1)[0] in best[:_NEIGHBOURS]]
    return names, np.stack([columns[name] for name in names], axis=1)


def _important(
    trees: HistGradientBoostingRegressor,
    names: list[str],
    z: np.ndarray,
    target: np.ndarray,
    said: np.ndarray,
    held: TorqueResidual,
    seed: int,
) -> tuple[str, ...]:
    """Groups of columns without which the held-out prediction is worse, by how much worse."""
    rng = np.random.default_rng(seed)
    groups = list(dict.fromkeys(name.rsplit(":", 1)[0] for name in names))
    order = np.argsort(held.block, kind="stable")
    found = []
    for group in groups:
        columns = [k for k, name in enumerate(names) if name.rsplit(":", 1)[0] == group]
        losses, worst = [], 1.0
        for _ in range(3):
            moved = z.copy()
            shift = int(rng.integers(len(z) // 4, 3 * len(z) // 4 + 1))
            moved[np.ix_(order, np.array(columns))] = z[np.ix_(np.roll(order, shift), np.array(columns))]
            p, loss = gain_test(target - trees.predict(moved), target - said, held.block)
            losses.append(loss)
            worst = min(worst, p)
        found.append((float(np.mean(losses)), float(worst), group))
    largest = max(loss for loss, _, _ in found)
    kept = [f for f in found if f[1] < LEVEL / len(groups) and f[0] > 0.1 * largest]
    return tuple(group for _, _, group in sorted(kept, reverse=True))


def _ljung_box(values: np.ndarray, held: TorqueResidual) -> float:
    """Ljung and Box's test (1978) at lags 2 to 10, within rollouts; neighbours share a reading and are left out."""
    values = values - values.mean()
    power = float((values**2).sum()) + 1e-30
    statistic, used = 0.0, 0
    for lag in range(2, _LAGS + 1):
        same = held.rollout[lag:] == held.rollout[:-lag]
        if same.sum() < 30:
            continue
        r = float((values[lag:] * values[:-lag])[same].sum()) / power * len(values) / same.sum()
        statistic += len(values) * r**2
        used += 1
    return float(chi2.sf(statistic, used)) if used else 1.0


def joint_curves(data: TorqueResidual, joint: int) -> dict[str, list[list[float]]]:
    """Curves over the joint's own velocity, position, torque and time, by their name and unit."""
    y = clipped(data.missing[:, joint])
    over = {
        "velocity [rad/s]": data.v[:, joint],
        "position [rad]": data.q[:, joint],
        "torque [N m]": data.tau[:, joint],
        "time [s]": data.t,
    }
    return {name: measured_curve(x, y, data.block) for name, x in over.items() if np.ptp(x) > 0}
