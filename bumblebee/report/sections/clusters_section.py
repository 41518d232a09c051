"""The section about the clusters: the map, the elbow, the paper's table 2, and what the audit found."""

from bumblebee.report.charts.clusters_figure import elbow_figure, plane_figure
from bumblebee.report.charts.motion_map import map_block
from bumblebee.report.page import Block, Section, heading, image, note, table, text
from bumblebee.report.results import Json, LoopResults
from bumblebee.report.sections.audit_words import agreement, retrieval_rows, stability, texts, without_texts
from bumblebee.report.wording import plural

_COLUMNS = (
    ("displacement", "disp. [m]", 2),
    ("z_move", "z-move [mm]", 2),
    ("speed", "speed [m/s]", 3),
    ("joint", "joint [rad/s]", 3),
    ("lower_joint", "lower", 3),
    ("upper_joint", "upper", 3),
)
"""Columns of the paper's table 2: key, heading, digits."""


def clusters_section(results: LoopResults) -> Section:
    """All of it."""
    summary = results.clusters
    blocks: list[Block] = []
    if summary.get("method") == "random":
        blocks.append(
            text("These clusters were drawn at random, of equal sizes: a control, to see what clustering is worth.")
        )
    blocks += [*_pictures(results), heading("The clusters"), _table(summary)]
    blocks += [text(told) for told in (texts(summary),) if told]
    blocks += [heading("Are they meaningful?"), text(stability(summary)), text(agreement(summary))]
    blocks += [text(told) for told in (without_texts(summary),) if told]
    blocks += _retrieval(summary)
    losses = ", ".join(f"{name} {value:.3g}" for name, value in summary["loss"].items())
    blocks.append(note(f"Autoencoder losses at the end: {losses}."))
    return Section("clusters", "Clusters", tuple(blocks))


def _pictures(results: LoopResults) -> list[Block]:
    summary = results.clusters
    still = plane_figure(results.labels, summary.get("plane_variance"))
    alt = f"Scatter plot: {plural(len(results.labels), 'motion')} in {plural(summary['k'], 'cluster')}."
    if results.points is not None and "map" in summary:
        plane = map_block(results.points, summary, still, alt, results.players.get("motions", ""))
    else:
        caption = "First two principal components of the autoencoder's motion latents (no unit); filled: trained on."
        plane = image(still, "Motions in the latent plane", caption, alt)
    suggested, bend = summary["suggested_k"], summary.get("elbow", {})
    said = f"suggests K = {suggested}" if suggested else "is not there: the curve bends nowhere"
    rule = f" The elbow {said}" + (f", by {bend['rule']}." if bend else ".")
    elbow = image(
        elbow_figure(results.elbow, summary["k"], suggested),
        "How K was judged",
        "Spread inside the clusters against their number." + rule,
        f"Line that falls with K; the elbow {said}, used is K = {summary['k']}.",
    )
    return [plane, elbow]


def _table(summary: Json) -> Block:
    header = ("cluster", "clips + held out", *(name for _, name, _ in _COLUMNS), "keywords")
    rows = [
        (
            f"{name} {row['label']}",
            f"{row['clips']} + {row['held_out_clips']}",
            *(f"{row[key]:.{digits}f}" if key in row else "–" for key, _, digits in _COLUMNS),
            str(row["keywords"]) or "–",
        )
        for name, row in summary["clusters"].items()
    ]
    return table(header, rows, "Means over the training clips; the columns of the paper's table 2.", "clusters")


def _retrieval(summary: Json) -> list[Block]:
    found = summary.get("retrieval")
    if not found:
        return []
    header = ("held-out pairs", "R@1", "R@5", "R@10", "median rank")
    few = " So few clips say little." if found["few"] else ""
    caption = (
        f"{plural(found['captions'], 'caption')} and {plural(found['windows'], 'window')} of "
        f"{plural(found['clips'], 'clip')} that no training saw; 95 % intervals over clips; at the end what chance "
        f"reaches.{few}"
    )
    return [heading("Text finds motion"), table(header, retrieval_rows(found), caption, "retrieval")]
