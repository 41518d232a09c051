"""Tables of trials: rates, errors and differences paired by motion, with intervals over motions."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from bumblebee.evaluation.intervals import Estimate, mean_by_motion, motion_means, sign_flip_test, wilson

RATES = {"success": "success", "success_local": "own place", "success_upright": "pelvis rule"}
SPLITS = {"train": "trained", "test": "held out"}


def rate(rows: pd.DataFrame, column: str) -> Estimate:
    """Mean over motions of a motion's share of successes, with Wilson's interval at the effective number of motions.

    That number is what the shares' variance between motions makes of the binomial one; where none or all succeed, it is
    the number of motions.
    """
    shares = motion_means(rows[column].to_numpy(float), rows["motion"].to_numpy())
    count, value = len(shares), float(shares.mean())
    variance = float(shares.var(ddof=1)) / count if count > 1 else 0.0
    effective = min(value * (1 - value) / variance, len(rows)) if variance > 0 else count
    return Estimate(value, *wilson(value * effective, effective), len(rows), count)


def estimate(rows: pd.DataFrame, column: str) -> Estimate:
    """Mean over motions of a column, its pieces and seeds being one motion's."""
    return mean_by_motion(rows[column].to_numpy(float), rows["motion"].to_numpy())


def difference(rows: pd.DataFrame, first: str, second: str, column: str = "success") -> tuple[Estimate, float]:
    """First arm less second, paired by piece, seed and robot, with the p-value of sign flips over motions."""
    keys = ["seed", "robot", "name"]
    pair = [rows[rows["arm"] == arm].set_index(keys)[[column, "motion"]].sort_index() for arm in (first, second)]
    away = pair[0][column].astype(float) - pair[1][column].astype(float)
    motion = pair[0]["motion"].to_numpy()
    return mean_by_motion(away.to_numpy(), motion), sign_flip_test(motion_means(away.to_numpy(), motion))


def methods_table(rows: pd.DataFrame, names: Mapping[str, str], title: str) -> str:
    """A row for each arm that was tried and split: success by three rules, and errors until the loss.

    Args:
        rows: trials, the arm of each in `arm`.
        names: arm -> its name in the table, in order.
        title: head of the first column.
    """
    lines = head([title, "motions", "n", *RATES.values(), "MPJPE [rad]", "MPKPE [mm]", "MPKPE, own place [mm]"])
    for split, which in SPLITS.items():
        for arm, told in names.items():
            own = rows[(rows["arm"] == arm) & (rows["split"] == split)]
            if own.empty:
                continue
            cells = [told, which, str(own["motion"].nunique()), *(cell(rate(own, column), 2) for column in RATES)]
            cells += [cell(estimate(own, "mpjpe_rad"), 3)]
            cells += [cell(estimate(own, column), 0) for column in ("mpkpe_mm", "mpkpe_local_mm")]
            lines.append(line(cells))
    return "\n".join(lines) + "\n"


def head(cells: Sequence[str]) -> list[str]:
    """The two first lines of a Markdown table."""
    return [line(cells), "|" + "---|" * len(cells)]


def line(cells: Sequence[str]) -> str:
    """A row of a Markdown table."""
    return "| " + " | ".join(cells) + " |"


def cell(value: Estimate, digits: int) -> str:
    """A value with its interval."""
    if not np.isfinite(value.value):
        return "-"
    span = f" [{value.low:.{digits}f}, {value.high:.{digits}f}]" if np.isfinite(value.low) else ""
    return f"{value.value:.{digits}f}{span}"


def signed(value: Estimate) -> str:
    """A difference with its interval."""
    return f"{value.value:+.3f} [{value.low:+.3f}, {value.high:+.3f}]"


def relative(change: dict[str, float]) -> str:
    """A relative change, an entry of `learning.delta.Gain.change`, with its interval."""
    return f"{change['relative']:+.3f} [{change['low']:+.3f}, {change['high']:+.3f}]"


def motions_of(table: pd.DataFrame, by: str) -> list[str]:
    """The motion of each rollout of a table of errors, in the order of the rollouts' names."""
    (_, one), *_ = table.groupby([by, "horizon"])
    return one.sort_values("rollout")["motion"].tolist()
