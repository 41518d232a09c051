"""Sections about the data: motions read and dropped, clusters."""

from bumblebee.report.clusters_figure import elbow_figure, plane_figure
from bumblebee.report.page import Block, Section, heading, image, note, table, text
from bumblebee.report.results import Json, LoopResults
from bumblebee.report.wording import plural, signed

_MOST_ROWS = 12
_TEXTS = {
    "file": "written by you beside the motion",
    "csv": "written by you in a table of captions",
    "humanml3d": "HumanML3D's, of the segments that people described",
    "made": "the embedded library's own, written with its motions",
    "name": "a template filled with the file's name",
    "none": "none",
    "unknown": "of unknown origin",
}
_CIRCULAR = (
    "No agreement with the families is given: families and texts both come from the files' names, so it would compare "
    "the names with themselves."
)


def motions_section(results: LoopResults) -> Section:
    """What was read, what the filter dropped and why."""
    library, drops = results.library, results.drops
    dropped = drops["motion"].nunique() if len(drops) else 0
    held_out = int((library["split"] == "test").sum())
    minutes = library["duration"].sum() / 60
    blocks: list[Block] = [
        text(
            f"{plural(len(library), 'motion')} read ({minutes:.1f} minutes in all, {held_out} held out from training); "
            f"the filter dropped {dropped}, so {len(library) - dropped} are used."
        )
    ]
    families = library.assign(family=library["family"].replace("", "unknown")).groupby("family")
    rows = [
        (str(name), str(len(part)), str(int((part["split"] == "test").sum())), f"{part['duration'].sum():.0f} s")
        for name, part in families
    ]
    blocks.append(table(("family", "motions", "held out", "length"), rows, title="motions by family"))
    sources = library.groupby("licence").size()
    licences = "; ".join(f"{name} ({plural(count, 'motion')})" for name, count in sources.items())
    blocks.append(note(f"Licences: {licences}."))
    if len(drops):
        first = drops.drop_duplicates("motion")
        dropped_rows = [(r["motion"], r["rule"], str(r["explanation"])) for _, r in first.head(_MOST_ROWS).iterrows()]
        caption = f"{len(first) - _MOST_ROWS} more in data/filtered/drops.csv." if len(first) > _MOST_ROWS else ""
        blocks += [
            heading("Dropped by the filter"),
            table(("motion", "rule", "why"), dropped_rows, caption, "dropped motions"),
        ]
    if len(results.skipped):
        reasons = results.skipped.groupby("reason").size().sort_values(ascending=False)
        unread = [(str(reason), str(count)) for reason, count in reasons.head(_MOST_ROWS).items()]
        blocks += [heading("Files that cannot be read yet"), table(("reason", "files"), unread)]
    return Section("motions", "Motions", tuple(blocks))


def clusters_section(results: LoopResults) -> Section:
    """The latent plane, the elbow, the paper's table 2 and the audit."""
    summary = results.clusters
    rows = [
        (
            name,
            str(row["label"]),
            f"{row['clips']} + {row['held_out_clips']}",
            f"{row['speed']:.2f}",
            f"{row['displacement']:.2f}",
            f"{row['z_move']:.1f}" if "z_move" in row else "–",
            str(row["keywords"]) or "–",
        )
        for name, row in summary["clusters"].items()
    ]
    header = ("cluster", "label", "clips + held out", "speed [m/s]", "displacement [m]", "z-move [mm]", "keywords")
    losses = ", ".join(f"{name} {value:.3g}" for name, value in summary["loss"].items())
    plane = plane_figure(results.labels, summary.get("plane_variance"))
    elbow = elbow_figure(results.elbow, summary["k"], summary["suggested_k"])
    blocks = (
        image(
            plane,
            "Motions in the latent plane",
            "First two principal components of the autoencoder's motion latents (no unit); filled: trained on.",
            f"Scatter plot: {plural(len(results.labels), 'motion')} in {plural(summary['k'], 'cluster')}.",
        ),
        image(
            elbow,
            "How K was judged",
            "Spread inside the clusters against their number; the elbow is the point farthest below the chord.",
            f"Line that falls with K; the elbow suggests K = {summary['suggested_k']}, used is K = {summary['k']}.",
        ),
        heading("The clusters"),
        table(header, rows, "Means over the training clips.", "clusters"),
        text(_audit(summary["audit"], summary.get("clips", {}).get("texts", {}))),
        *([text(told)] if (told := _texts(summary)) else []),
        note(f"Autoencoder losses at the end: {losses}."),
    )
    return Section("clusters", "Clusters", blocks)


def _texts(summary: Json) -> str:
    """Where the clips' texts came from, and which of them keywords are taken from."""
    texts = summary["clips"].get("texts", {}) if "clips" in summary else {}
    if not texts:
        return ""
    told = "; ".join(f"{plural(count, 'clip')}: {_TEXTS.get(source, source)}" for source, count in texts.items())
    return f"Texts: {told}. Keywords come from written texts alone, never from names or templates."


def _audit(audit: Json, texts: Json) -> str:
    stability, agreement = audit["stability"], audit["family_ari"]
    words = f"Agreement between restarts {signed(stability['seeds'], 2)}, "
    words += f"between subsamples {signed(stability['subsamples'], 2)}"
    if agreement is not None:
        words += f", with the families {signed(agreement, 2)}"
    words += " (adjusted Rand index: 1 the same, 0 chance). Share of the speed's variance that lies between clusters: "
    words += f"{audit['separation']['speed']:.2f}; in random splits {audit['separation_random_split']['speed']:.2f}."
    if agreement is None:
        return f"{words} {_CIRCULAR}" if "name" in texts else words
    words += " Clips whose text is their file's name are left out of it." if "name" in texts else ""
    together = " The embedded library's families and texts were written together, so this says little of other motions."
    return words + (together if "made" in texts else "")
