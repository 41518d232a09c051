"""Does structure remain in the torque that a model lacks, in which joint, and on what does it depend?

Boosted trees learn each joint's missing torque on the fitted rollouts from everything that it might depend on, and
predict it on the held-out ones. Where nothing is left they predict nothing. The gain is judged over half-second blocks,
one-sided, with a Bonferroni bound over the joints. A quantity matters where exchanging its blocks spoils the
prediction. Beside it a Ljung-Box test says whether what remains follows from what was before.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import chi2, wilcoxon
from scipy.stats import t as student
from sklearn.ensemble import HistGradientBoostingRegressor

from bumblebee.diagnosis.gap.torque_residual import TorqueResidual
from bumblebee.diagnosis.thresholds.gap import Dependence, GainTest, GapThresholds

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
    rule: Dependence = field(default_factory=Dependence, repr=False)
    """What significance goes by."""

    @property
    def significant(self) -> bool:
        """Whether there is structure, and enough of it to matter."""
        return self.p < self.rule.level and self.rms > self.rule.least * self.typical and self.share > 0


def other_joint(name: str) -> str:
    """How a dependence on another joint is called."""
    return f"another joint ({name})"


@dataclass(frozen=True, eq=False)
class _Prediction:
    """What boosted trees foresee on N held-out windows."""

    trees: HistGradientBoostingRegressor
    names: list[str]
    """Of the F columns."""
    x: np.ndarray
    """(N, F) what the trees go by."""
    target: np.ndarray
    """(N,) missing torque, clipped [N m]."""
    said: np.ndarray
    """(N,) what the trees predict [N m]."""
    block: np.ndarray
    """(N,) number of the block that a window lies in."""


def clipped(values: np.ndarray, rule: Dependence) -> np.ndarray:
    """`values` (N,) with outliers, about 2 %, brought nearer; a signal's own long tails stay."""
    middle = np.median(values)
    away = np.abs(values - middle)
    reach = max(rule.clip * 1.4826 * np.median(away), rule.tail * float(np.quantile(away, rule.bulk))) + 1e-12
    return np.clip(values, middle - reach, middle + reach)


def joint_structure(
    train: TorqueResidual, held: TorqueResidual, joint: int, seed: int = 0, rules: GapThresholds | None = None
) -> JointStructure:
    """Test one joint; `train` and `held` share no window."""
    rules = rules or GapThresholds()
    rule = rules.dependence
    names, x = _features(train, joint, rule.neighbours)
    z = _columns(held, joint, names)
    y, target = clipped(train.missing[:, joint], rule), clipped(held.missing[:, joint], rule)
    centre = y.mean()
    trees = _trees(rule, seed).fit(x, y)
    said = trees.predict(z)
    p, gain = gain_test(target - centre, target - said, held.block, rules.gain_test)
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
        ljung_box=_ljung_box(target - centre, held.rollout, rule),
        rule=rule,
    )
    if not found.significant:
        return found
    return replace(found, depends_on=_important(_Prediction(trees, names, z, target, said, held.block), seed, rules))


def _trees(rule: Dependence, seed: int) -> HistGradientBoostingRegressor:
    return HistGradientBoostingRegressor(
        max_iter=rule.iterations,
        learning_rate=rule.learning_rate,
        max_leaf_nodes=rule.leaves,
        min_samples_leaf=rule.leaf_windows,
        l2_regularization=rule.ridge,
        random_state=seed,
    )


def gain_test(before: np.ndarray, after: np.ndarray, block: np.ndarray, rule: GainTest) -> tuple[float, float]:
    """One-sided p that `after` (N,) is closer to zero than `before`, over blocks, and the mean gain.

    By the mean and by Wilcoxon's ranks, the better of both doubled: a weak effect shows in few blocks, and the gain of
    a strong one is so skewed that its mean says little, though all blocks agree.
    """
    gain = np.bincount(block, before**2 - after**2)
    count = np.bincount(block)
    gain, count = gain[count > 0], count[count > 0]
    mean = gain.sum() / count.sum()
    if len(gain) < rule.fewest_blocks:
        return 1.0, float(mean)
    if mean <= 0:
        return 1.0, float(mean)
    spread = np.sqrt(((gain - mean * count) ** 2).sum() * len(gain) / (len(gain) - 1)) / count.sum()
    by_mean = float(student.sf(mean / max(spread, 1e-30), len(gain) - 1))
    by_rank = float(wilcoxon(gain / count, alternative="greater", zero_method="zsplit").pvalue)
    return min(1.0, 2 * min(by_mean, by_rank)), float(mean)


def _table(data: TorqueResidual, joint: int) -> dict[str, np.ndarray]:
    """Columns (N,) by name; the group that a column belongs to is what stands before its last colon."""
    columns = {
        "position:q": data.q[:, joint],
        "velocity:v": data.v[:, joint],
        "target:u - q": data.u[:, joint] - data.q[:, joint],
        "target:rate": data.rate[:, joint],
        "torque:tau": data.tau[:, joint],
        "time:t": data.t,
    }
    columns |= {f"history:backlash {k}": data.history[:, joint, k] for k in range(data.history.shape[2])}
    for k, name in enumerate(data.joints):
        if k != joint:
            columns |= {f"{other_joint(name)}:q": data.q[:, k], f"{other_joint(name)}:v": data.v[:, k]}
    return columns


def _group(name: str) -> str:
    return name.rsplit(":", 1)[0]


def _columns(data: TorqueResidual, joint: int, names: list[str]) -> np.ndarray:
    """The columns `names` as (N, F)."""
    columns = _table(data, joint)
    return np.stack([columns[name] for name in names], axis=1)


def _features(data: TorqueResidual, joint: int, neighbours: int) -> tuple[list[str], np.ndarray]:
    """Names and values (N, F) of the joint's own columns and of those of the `neighbours` joints that matter most."""
    columns = _table(data, joint)
    own = [name for name in columns if not name.startswith("another joint")]
    y = data.missing[:, joint] - data.missing[:, joint].mean()
    others = [name for name in columns if name.startswith("another joint")]
    tie = {name: abs(float(np.corrcoef(columns[name], y)[0, 1])) if np.ptp(columns[name]) else 0 for name in others}
    best = sorted({_group(name) for name in others}, key=lambda j: -max(tie[f"{j}:q"], tie[f"{j}:v"]))
    names = own + [name for name in others if _group(name) in best[:neighbours]]
    return names, np.stack([columns[name] for name in names], axis=1)


def _important(made: _Prediction, seed: int, rules: GapThresholds) -> tuple[str, ...]:
    """Groups of columns without which the held-out prediction is worse, by how much worse."""
    rng, rule = np.random.default_rng(seed), rules.dependence
    groups = list(dict.fromkeys(_group(name) for name in made.names))
    found = [(*_loss_without(made, group, rng, rules), group) for group in groups]
    largest = max(loss for loss, _, _ in found)
    kept = [f for f in found if f[1] < rule.level / len(groups) and f[0] > rule.part_of_largest * largest]
    return tuple(group for _, _, group in sorted(kept, reverse=True))


def _loss_without(made: _Prediction, group: str, rng: np.random.Generator, rules: GapThresholds) -> tuple[float, float]:
    """Mean loss of the prediction where a group's blocks are exchanged, and the smallest p that it is none."""
    rule, count = rules.dependence, len(made.x)
    order = np.argsort(made.block, kind="stable")
    columns = np.array([k for k, name in enumerate(made.names) if _group(name) == group])
    losses, least = [], 1.0
    for _ in range(rule.exchanges):
        moved = made.x.copy()
        nearest = int(count * rule.shortest_shift)
        shift = int(rng.integers(nearest, int(count * (1 - rule.shortest_shift)) + 1))
        moved[np.ix_(order, columns)] = made.x[np.ix_(np.roll(order, shift), columns)]
        before, after = made.target - made.trees.predict(moved), made.target - made.said
        p, loss = gain_test(before, after, made.block, rules.gain_test)
        losses.append(loss)
        least = min(least, p)
    return float(np.mean(losses)), float(least)


def _ljung_box(values: np.ndarray, rollout: np.ndarray, rule: Dependence) -> float:
    """Ljung and Box's test (1978) at lags from 2 on, within rollouts; neighbours share a reading and are left out."""
    values = values - values.mean()
    power = float((values**2).sum()) + 1e-30
    statistic, used = 0.0, 0
    for lag in range(2, rule.lags + 1):
        same = rollout[lag:] == rollout[:-lag]
        if same.sum() < rule.lag_pairs:
            continue
        r = float((values[lag:] * values[:-lag])[same].sum()) / power * len(values) / same.sum()
        statistic += len(values) * r**2
        used += 1
    return float(chi2.sf(statistic, used)) if used else 1.0
