"""The map of the motions that a person can explore: its block, and its rows in few letters.

Its script is this project's own, some 7 kB: a plotting library would bring megabytes into every report, needs more than
the page's policy allows, and draws no stick figure beside a point.
"""

import pandas as pd

from bumblebee.report.charts.figures import PALETTE
from bumblebee.report.page import Block, image
from bumblebee.report.results import Json

CHOICES = (("cluster", "cluster"), ("split", "split"), ("family", "family"), ("licence", "licence of the source"))
"""Columns that the points can be coloured by, and the page's names of them."""
_FULL = 1000  # of each axis, in the page


def map_block(points: pd.DataFrame, summary: Json, still: str, alt: str, player: str = "") -> Block:
    """The block; without scripts it is the picture `still` with its `alt`.

    Args:
        points: data/clusters/map.parquet.
        summary: data/clusters/summary.json.
        still: a `data:` URI of the same as a picture.
        alt: what the picture shows, in words.
        player: markup of the 3D replays of the motions.
    """
    names = {name: str(row["label"]) for name, row in summary["clusters"].items()}
    form, shares = summary["map"], summary.get("plane_variance") or ()
    picture = image(still, "Motions in the latent plane", "Filled: trained on; open: held out.", alt)
    axes = [f"component {i} ({100 * share:.0f} % of variance)" for i, share in enumerate(shares, 1)]
    where = f"Across: {axes[0]}; up: {axes[1]}. " if axes else ""
    caption = f"{where}Open circles are held out. Point, tap, or use the arrow keys; the search dims all else."
    facts = {
        "bones": ";".join(" ".join(map(str, bone)) for bone in form["bones"]),
        "step": f"{form['step']:.6f}",
        "joints": str(form["joints"]),
        "palette": " ".join(PALETTE),
    }
    return Block(
        "map", text=rows(points, names, form["signs"]), title="Map of the motions", caption=caption, uri=picture.uri,
        alt=picture.alt, facts=facts, choices=CHOICES, player=player,
    )  # fmt: skip


def rows(points: pd.DataFrame, names: dict[str, str], signs: str) -> str:
    """The signs of the poses, then one line a motion, its values between tabs, in the order that map.js reads."""
    x, y = (_scaled(points[axis]) for axis in "xy")
    lines = [signs]
    for i, row in enumerate(points.to_dict("records")):
        called = f"{row['cluster']} {names.get(row['cluster'], '')}"
        values = (
            row["name"], called, x[i], y[i], row["split"], row["family"], row["licence"], f"{row['seconds']:.1f}",
            row["caption_source"], row["caption"],
        )  # fmt: skip
        lines.append("\t".join([*(" ".join(str(value).split()) for value in values), row["poses"]]))
    return "\n".join(lines)


def _scaled(values: pd.Series) -> list[int]:
    span = float(values.max() - values.min())
    return [round(_FULL * float(value - values.min()) / span) if span else _FULL // 2 for value in values]
