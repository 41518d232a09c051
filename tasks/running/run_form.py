"""Settings, numbers and texts in the form in which a run's page takes them."""

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path

Metric = float | Mapping[int, float]
"""A number, or numbers by their step, which MLflow draws as a curve."""


def metric_name(name: str) -> str:
    """A name that MLflow accepts: no empty part between slashes, no sign it does not know."""
    parts = (re.sub(r"[^\w.\- ]", "_", part).strip() or "unknown" for part in name.split("/"))
    return "/".join(parts)


def fitted(text: str, most: int, where: str) -> str:
    """The text, or its beginning with a word on what is missing and where it is whole."""
    if len(text) <= most:
        return text
    note = f" ... cut here, {len(text):,} characters: whole in {where}"
    return text[: most - len(note)] + note


def flatten(params: object, prefix: str = "") -> dict[str, str]:
    """Nested settings as `a.b` -> text."""
    if params is None:
        return {}
    values = asdict(params) if is_dataclass(params) and not isinstance(params, type) else params
    if not isinstance(values, Mapping):
        return {prefix.rstrip("."): str(values)}
    flat: dict[str, str] = {}
    for key, value in values.items():
        nested = isinstance(value, Mapping) or is_dataclass(value)
        flat |= flatten(value, f"{prefix}{key}.") if nested else {f"{prefix}{key}": str(value)}
    return flat


def by_step(metrics: Mapping[str, Metric]) -> list[tuple[str, int, float]]:
    """(name, step, value) of each number; one that stands alone has the step 0."""
    series = {name: value if isinstance(value, Mapping) else {0: value} for name, value in metrics.items()}
    return [(name, int(step), float(value)) for name, values in series.items() for step, value in values.items()]


def milliseconds(horizon: str) -> int:
    """The step of a number that belongs to a horizon, which is given in seconds."""
    return round(1000 * float(horizon))


def read_curve(path: Path) -> list[tuple[str, int, float]]:
    """(name, step, value) of each number in a CSV file whose first column is the step."""
    points = []
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            columns = list(row.items())
            step = int(float(columns[0][1]))
            for name, text in columns[1:]:
                try:
                    points.append((name, step, float(text)))
                except (TypeError, ValueError):
                    continue
    return [point for point in points if point[2] == point[2]]


def card_settings(folder: Path) -> dict[str, str]:
    """The configuration of the policy's training, where its card has one."""
    card = folder / "card.json"
    return flatten(json.loads(card.read_text()).get("config")) if card.exists() else {}
