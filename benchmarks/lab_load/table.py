"""The table of what look-ups took."""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence

from benchmarks.lab_load.users import Sample


def quantile(values: Sequence[float], share: float) -> float:
    """The smallest value that so large a share of them does not exceed."""
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]


def table(samples: Iterable[Sample], arms: Sequence[str]) -> str:
    """Markdown: a row for each kind of look-up and one for all, columns by arm; what failed is no fast answer."""
    by: dict[tuple[str, str], list[Sample]] = defaultdict(list)
    for sample in samples:
        by[sample.what, sample.arm].append(sample)
        by["all", sample.arm].append(sample)
    kinds = [*sorted({what for what, _ in by} - {"all"}), "all"]
    heads = [head for arm in arms for head in (f"{arm}: p50", "p99", "look-ups", "errors")]
    lines = [f"| [ms] | {' | '.join(heads)} |", f"|---|{'---|' * len(heads)}"]
    for what in kinds:
        cells = [cell for arm in arms for cell in row(by[what, arm])]
        lines.append(f"| {what} | {' | '.join(cells)} |")
    return "\n".join(lines)


def row(samples: Sequence[Sample]) -> list[str]:
    """p50 and p99 of what was answered [ms], the number of look-ups and of errors."""
    answered = [1000 * sample.seconds for sample in samples if not sample.error]
    figures = [f"{quantile(answered, share):.0f}" for share in (0.5, 0.99)] if answered else ["-", "-"]
    return [*figures, str(len(samples)), str(len(samples) - len(answered))]
