"""The section about the motions that were read and dropped."""

from bumblebee.motion.licences.terms import counted, restrictions
from bumblebee.report.page import Block, Section, heading, note, table, text
from bumblebee.report.results import LoopResults
from bumblebee.report.wording import plural

_MOST_ROWS = 12


def motions_section(results: LoopResults) -> Section:
    """Section on what was read, what the filter dropped and why."""
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
    licences = counted(library["licence"])
    named = "; ".join(f"{name} ({plural(count, 'motion')})" for name, count in licences.items())
    blocks.append(note(f"Licences: {named}."))
    blocks += [note(f"{line[0].upper()}{line[1:]}.") for line in restrictions(licences)]
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
        blocks += [heading("Files that gave no motion"), table(("reason", "files"), unread)]
    return Section("motions", "Motions", tuple(blocks))
