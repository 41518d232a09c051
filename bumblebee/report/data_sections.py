"""Sections about the data: motions read and dropped, clusters."""

from bumblebee.report.clusters_figure import clusters_figure
from bumblebee.report.page import Block, Section, heading, image, note, table, text
from bumblebee.report.results import LoopResults

_MOST_ROWS = 12


def motions_section(results: LoopResults) -> Section:
    """What was read, what the filter dropped and why."""
    library, drops = results.library, results.drops
    dropped = drops["motion"].nunique() if len(drops) else 0
    held_out = int((library["split"] == "test").sum())
    minutes = library["duration"].sum() / 60
    blocks: list[Block] = [
        text(
            f"{len(library)} motions were read ({minutes:.1f} minutes, {held_out} held out from training); "
            f"the filter dropped {dropped}."
        )
    ]
    families = library.assign(family=library["family"].replace("", "unknown")).groupby("family")
    rows = [
        (str(name), str(len(part)), str(int((part["split"] == "test").sum())), f"{part['duration'].sum():.0f} s")
        for name, part in families
    ]
    blocks.append(table(("family", "motions", "held out", "length"), rows))
    sources = library.groupby("licence").size()
    blocks.append(note("Licences: " + "; ".join(f"{name} ({count} motions)" for name, count in sources.items()) + "."))
    if len(drops):
        first = drops.drop_duplicates("motion")
        dropped_rows = [(r["motion"], r["rule"], str(r["explanation"])) for _, r in first.head(_MOST_ROWS).iterrows()]
        caption = f"{len(first) - _MOST_ROWS} more in data/filtered/drops.csv." if len(first) > _MOST_ROWS else ""
        blocks += [heading("Dropped"), table(("motion", "rule", "why"), dropped_rows, caption)]
    if len(results.skipped):
        reasons = results.skipped.groupby("reason").size().sort_values(ascending=False)
        unread = [(str(reason), str(count)) for reason, count in reasons.head(_MOST_ROWS).items()]
        blocks += [heading("Files that cannot be read yet"), table(("reason", "files"), unread)]
    return Section("motions", "Motions", tuple(blocks))


def clusters_section(results: LoopResults) -> Section:
    """The latent plane, the elbow, the paper's table 2 and the audit."""
    summary = results.clusters
    picture = clusters_figure(results.labels, results.elbow, summary["k"], summary["suggested_k"])
    rows = [
        (
            name,
            str(row["label"]),
            f"{row['clips']} + {row['held_out_clips']}",
            f"{row['speed']:.2f}",
            f"{row['displacement']:.2f}",
            f"{row['z_move']:.1f}" if "z_move" in row else "–",
            str(row["keywords"]),
        )
        for name, row in summary["clusters"].items()
    ]
    header = ("cluster", "label", "clips + held out", "speed [m/s]", "displacement [m]", "z-move [mm]", "keywords")
    audit, stability = summary["audit"], summary["audit"]["stability"]
    agreement = audit["family_ari"]
    words = f"Agreement between restarts {stability['seeds']:.2f}, between subsamples {stability['subsamples']:.2f}"
    if agreement is not None:
        words += f", with the families {agreement:.2f}"
    words += " (adjusted Rand index, 1 = the same). Share of the speed's variance that lies between clusters: "
    words += f"{audit['separation']['speed']:.2f}, in random splits {audit['separation_random_split']['speed']:.2f}."
    losses = ", ".join(f"{name} {value:.3g}" for name, value in summary["loss"].items())
    blocks = (
        image(picture, "Left: first two principal components of the motion latents. Right: how K was judged."),
        table(header, rows),
        text(words),
        note(f"Autoencoder losses at the end: {losses}."),
    )
    return Section("clusters", "Clusters", blocks)
