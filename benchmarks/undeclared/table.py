"""The table of the benchmark: each measure for ours and for every rival, with interval and count, beside the levels."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.undeclared.stats import bootstrap, wilson
from bumblebee.stand_in.undeclared.kinds import KINDS

Row = dict[str, Any]
RIVALS = ("fit_everything", "ridge", "pace", "delta")
_FIVE, _WEAK, _STRONG = (3.5, 9.0), (0.0, 3.5), (9.0, np.inf)
_DASH = "-"
_DRAWN = ("single", "pair", "triple")


def table(rows: Sequence[Row]) -> str:
    """Markdown: measures by method, then by robot, then the kinds that were missed."""
    good = [r for r in rows if "ours" in r]
    parts = [_head(rows, good), _measures(good), _conditions(good), _kinds(good), _outside_kinds(good)]
    return "\n\n".join(part for part in parts if part)


def _head(rows: Sequence[Row], good: Sequence[Row]) -> str:
    stamps = sorted({f"version {r['version']}, seed {r['seed']}, suite {r['suite']}" for r in rows})
    commits = defaultdict(int)
    for r in rows:
        commits[r["commit"]] += 1
    robots = defaultdict(int)
    for r in good:
        robots[r["robot"]] += 1
    lost = [r for r in rows if "ours" not in r]
    text = [f"Suite: {'; '.join(stamps)}. Commits (cases): {', '.join(f'{c} ({n})' for c, n in commits.items())}."]
    text.append(f"Cases scored: {len(good)} ({', '.join(f'{k} {n}' for k, n in sorted(robots.items()))}).")
    if lost:
        why = defaultdict(int)
        for r in lost:
            why[r.get("failed", r.get("skipped", "?"))[:70]] += 1
        text.append("Not scored: " + "; ".join(f"{n} x {w}" for w, n in why.items()) + ".")
    broken = sum("broke" in r for r in good)
    if broken:
        text.append(f"Diagnoses that broke, counted as naming nothing: {broken}.")
    return "\n".join(text)


def share(hits: Sequence[bool]) -> str:
    """As `82 % [70, 90] 41/50`."""
    if not len(hits):
        return _DASH
    low, high = wilson(sum(hits), len(hits))
    return f"{100 * np.mean(hits):.0f} % [{100 * low:.0f}, {100 * high:.0f}] {sum(hits)}/{len(hits)}"


def number(values: Sequence[float], scale: float = 1.0, unit: str = "", statistic: Callable = np.median) -> str:
    """As `1.2 % [0.9, 1.6] n 40`; the median unless told otherwise."""
    if not len(values):
        return _DASH
    if len(values) < 2:
        return f"{scale * statistic(values):.3g}{unit} n 1"
    low, high = bootstrap(values, statistic)
    return f"{scale * statistic(values):.3g}{unit} [{scale * low:.2g}, {scale * high:.2g}] n {len(values)}"


def _between(rows: Sequence[Row], group: str, bounds: tuple[float, float]) -> list[Row]:
    return [r for r in rows if r["group"] == group and all(bounds[0] <= t["ratio"] < bounds[1] for t in r["truth"])]


def _measures(good: Sequence[Row]) -> str:
    """residual.md's measures; rivals on the cases where they ran."""
    lines = ["| measure | good | excellent | ours | " + " | ".join(RIVALS) + " |", "|" + "---|" * (4 + len(RIVALS))]
    for name, levels, measure in _MEASURES:
        cells = [measure(good, "ours")]
        for rival in RIVALS:
            own = [r for r in good if rival in r.get("rivals", {}) and "failed" not in r["rivals"][rival]]
            cells.append(measure(own, rival))
        lines.append(f"| {name} | {levels[0]} | {levels[1]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _marks(row: Row, method: str) -> Row:
    return row["ours"] if method == "ours" else row["rivals"][method]


Measure = Callable[[Sequence[Row], str], str]


def _of(group: str, bounds: tuple[float, float], mark: str) -> Measure:
    """Share of a group's cases of some size that have `mark`, of each effect in them."""

    def measure(rows: Sequence[Row], method: str) -> str:
        if method == "delta":  # it names nothing
            return _DASH
        return share([bool(np.all(_marks(r, method)[mark])) for r in _between(rows, group, bounds)])

    return measure


def _sizes(groups: tuple[str, ...]) -> Measure:
    """Relative error of the sizes of ours."""
    return lambda rows, method: number(
        [s["relative"] for r in rows if method == "ours" for s in r["ours"]["sizes"] if s["group"] in groups], 100, " %"
    )


def _covers(rows: Sequence[Row], method: str) -> str:
    return share([s["covered"] for r in rows if method == "ours" for s in r["ours"]["sizes"]])


def _alarms(rows: Sequence[Row], method: str) -> str:
    return _DASH if method == "delta" else share([_marks(r, method)["alarm"] for r in rows if r["group"] == "null"])


def _outside(group: str, mark: str) -> Measure:
    """Share of a group's cases of which ours says this of what is left."""
    return lambda rows, method: (
        share([r["ours"]["outside"][mark] for r in rows if r["group"] == group]) if method == "ours" else _DASH
    )


def _spurious(rows: Sequence[Row], method: str) -> str:
    if method == "delta":
        return _DASH
    drawn = [r for r in rows if r["group"] in _DRAWN and r["truth"]]
    return number([_marks(r, method)["spurious"] / len(r["truth"]) for r in drawn], statistic=np.mean)


def _gained(statistic: Callable) -> Measure:
    """Share of the error that could be removed, over the cases where that is known."""

    def measure(rows: Sequence[Row], method: str) -> str:
        shares = [_achieved(r, method) for r in rows if r["group"] in _DRAWN]
        return number([s for s in shares if s is not None], statistic=statistic)

    return measure


def _seconds(rows: Sequence[Row], method: str) -> str:
    return number([_marks(r, method)["seconds"] for r in rows], 1, " s")


_NONE = ("", "")
_MEASURES: tuple[tuple[str, tuple[str, str], Measure], ...] = (
    ("single, top-1 up to its class, 5x", ("85 %", "95 %"), _of("single", _FIVE, "top")),
    ("the same, 2x", _NONE, _of("single", _WEAK, "top")),
    ("the same, 20x", _NONE, _of("single", _STRONG, "top")),
    ("single found at all, 5x", _NONE, _of("single", _FIVE, "found")),
    ("joint or link right, 5x", ("90 %", "97 %"), _of("single", _FIVE, "top_place")),
    ("size, relative error, joint", ("5 %", "2 %"), _sizes(("joint", "sensor"))),
    ("size, relative error, mass and contact", ("15 %", "5 %"), _sizes(("mass", "contact"))),
    ("95 % interval covers", ("85-99 %", "92-98 %"), _covers),
    ("false alarms on nulls", ("5 %", "1 %"), _alarms),
    ("structure claimed on nulls", _NONE, _outside("null", "flagged")),
    ("spurious effects beside each true one", ("0.15", "0.05"), _spurious),
    ("both of two found", ("70 %", "90 %"), _of("pair", (0.0, np.inf), "found")),
    ("all of three found", _NONE, _of("triple", (0.0, np.inf), "found")),
    ("achievable error removed, held out, median", ("0.85", "0.97"), _gained(np.median)),
    ("the same, mean", _NONE, _gained(np.mean)),
    ("outside the catalogue: flagged", ("90 %", "98 %"), _outside("outside", "flagged")),
    ("outside: its form right", ("50 %", "75 %"), _outside("outside", "form")),
    ("time, one core", ("5 min", "1 min"), _seconds),
)


def _achieved(row: Row, method: str) -> float | None:
    """On cases at 5x and more, where the oracle is known."""
    if not row["truth"] or min(t["ratio"] for t in row["truth"]) < _FIVE[0]:
        return None
    return row.get("achieved") if method == "ours" else row["rivals"][method].get("achieved")


def _conditions(good: Sequence[Row]) -> str:
    """Ours by robot, noise and rollouts."""
    lines = [
        "| cases | top-1 at 5x | nulls with an alarm | spurious for each | intervals that cover | time |",
        "|---|---|---|---|---|---|",
    ]
    splits: list[tuple[str, Callable[[Row], bool]]] = [
        *[(robot, lambda r, robot=robot: r["robot"] == robot) for robot in sorted({r["robot"] for r in good})],
        *[(f"noise x{n:g}", lambda r, n=n: r["noise"] == n) for n in sorted({r["noise"] for r in good})],
        *[(f"{n} rollouts", lambda r, n=n: r["rollouts"] == n) for n in sorted({r["rollouts"] for r in good})],
    ]
    measures = {name: measure for name, _, measure in _MEASURES}
    names = ("single, top-1 up to its class, 5x", "false alarms on nulls", "spurious effects beside each true one",
             "95 % interval covers", "time, one core")  # fmt: skip
    for name, keep in splits:
        rows = [r for r in good if keep(r)]
        lines.append(f"| {name} | " + " | ".join(measures[m](rows, "ours") for m in names) + " |")
    return "\n".join(lines)


def _kinds(good: Sequence[Row]) -> str:
    """Each kind of the catalogue at 5x and more, singles only: found, and what was named instead."""
    lines = ["| kind, 3.5x and more | found | top | named instead |", "|---|---|---|---|"]
    for name, kind in KINDS.items():
        rows = [
            r for r in good if r["group"] == "single" and r["kinds"] == [name] and r["truth"][0]["ratio"] >= _FIVE[0]
        ]
        if kind.outside or not rows:
            continue
        missed = defaultdict(int)
        for r in rows:
            if not all(r["ours"]["found"]):
                missed[", ".join(n.split(" ")[0] for n in r["ours"]["named"]) or "nothing"] += 1
        found, top = sum(all(r["ours"]["found"]) for r in rows), sum(r["ours"]["top"] for r in rows)
        instead = "; ".join(f"{n} x {m}" for m, n in sorted(missed.items(), key=lambda x: -x[1])[:4])
        lines.append(f"| {name} | {found}/{len(rows)} | {top}/{len(rows)} | {instead} |")
    return "\n".join(lines)


def _outside_kinds(good: Sequence[Row]) -> str:
    lines = [
        "| outside the catalogue | flagged | joint right | form right | named from the catalogue |",
        "|---|---|---|---|---|",
    ]
    for name, kind in KINDS.items():
        rows = [r for r in good if r["kinds"] == [name] and kind.outside]
        if not rows:
            continue
        marks = [sum(r["ours"]["outside"][m] for r in rows) for m in ("flagged", "place", "form")]
        forced = sum(any(not n.startswith("discovered") for n in r["ours"]["named"]) for r in rows)
        lines.append(f"| {name} | " + " | ".join(f"{m}/{len(rows)}" for m in marks) + f" | {forced}/{len(rows)} |")
    return "\n".join(lines) if len(lines) > 2 else ""
