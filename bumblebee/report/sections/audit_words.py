"""The clustering's audit in sentences: what was measured, its interval, and what chance reaches."""

from bumblebee.report.page import Cell
from bumblebee.report.results import Json
from bumblebee.report.wording import plural, signed

_TEXTS = {
    "file": "written by you beside the motion",
    "csv": "written by you in a table",
    "humanml3d": "from HumanML3D",
    "made": "the embedded library's own, written with its motions",
    "name": "a template filled with the file's name",
    "none": "none",
    "unknown": "of unknown origin",
}
_CIRCULAR = (
    "No agreement with the families is given: families and texts both come from the files' names, so it would compare "
    "the names with themselves."
)


def texts(summary: Json) -> str:
    """Where the clips' texts came from, and which of them keywords are taken from."""
    sources = summary.get("clips", {}).get("texts", {})
    if not sources:
        return ""
    told = "; ".join(f"{plural(count, 'clip')}: {_TEXTS.get(source, source)}" for source, count in sources.items())
    return f"Texts: {told}. Keywords come from written texts alone, never from names or templates."


def stability(summary: Json) -> str:
    """Whether the same clips come together again, how far apart the clusters are, and how even."""
    audit = summary["audit"]
    found = audit["stability"]
    if audit.get("method") == "random":
        words = f"Two draws of random clusters agree at {_index(found['seeds'])}"
    else:
        words = f"Agreement between restarts of K-means {_index(found['seeds'])}"
        words += f", between subsamples {_index(found['subsamples'])}"
        if found["retrained"]["n"]:
            words += f", between trainings of the autoencoder with other seeds {_index(found['retrained'])}"
    words += " (adjusted Rand index: 1 the same, 0 chance; in brackets the least and the largest of the pairs)."
    speed, chance = audit["separation"]["speed"], audit["separation_random_split"]["speed"]
    words += f" Share of the speed's variance that lies between clusters: {speed:.2f}; in random splits {chance:.2f}."
    if audit["silhouette"]["value"] is not None:
        words += f" Silhouette {_index(audit['silhouette'])}."
    even = audit["balance"]
    return (
        f"{words} The smallest cluster has {100 * even['smallest']:.0f} %, the largest {100 * even['largest']:.0f} %."
    )


def agreement(summary: Json) -> str:
    """With labels that the clustering never saw: families, and kinds by rules on the motion alone."""
    audit, sources = summary["audit"], summary.get("clips", {}).get("texts", {})
    kinds = audit["kinematic"]
    words = "With kinds by fixed rules on the motion (airborne, travelling, crouching, turning, arms, legs, still): "
    words += f"{_beside(kinds['ari'])}; they look at the same joints and feet as the features, so this says that the "
    words += "latents kept such differences, not that the clusters mean anything."
    if audit["family_ari"] is None:
        return f"{words} {_CIRCULAR}" if "name" in sources else words
    words += f" With the families {_beside(audit['family_ari'])}."
    words += " Clips whose text is their file's name are left out of it." if "name" in sources else ""
    together = " The embedded library's families and texts were written together, so this says little of other motions."
    return words + (together if "made" in sources else "")


def without_texts(summary: Json) -> str:
    """Sentence on what the texts changed."""
    bare = summary["audit"].get("motion_only")
    if not bare:
        return ""
    ours, theirs = (part["separation"]["speed"] for part in (summary["audit"], bare))
    return (
        f"Trained without any text, the same number of clusters agree with these at {_beside(bare['ari'])}. Share of "
        f"the speed's variance between clusters: {ours:.2f} with texts, {theirs:.2f} without; agreement with the kinds "
        f"by rules: {_number(summary['audit']['kinematic']['ari'])} with, {_number(bare['kinematic_ari'])} without."
    )


def retrieval_rows(found: Json) -> list[tuple[str | Cell, ...]]:
    """Both directions: shares with interval and chance, and the median rank."""
    names = {"text_to_motion": "caption finds motion", "motion_to_text": "motion finds caption"}
    return [
        (called, *(_share(found[key][at]) for at in ("R@1", "R@5", "R@10")), _rank(found[key]))
        for key, called in names.items()
    ]


def _share(entry: Json) -> str:
    low, high = entry["ci95"]
    return f"{100 * entry['value']:.0f} % [{100 * low:.0f}, {100 * high:.0f}] (chance {100 * entry['chance']:.0f})"


def _rank(found: Json) -> str:
    entry = found["MedR"]
    low, high = entry["ci95"]
    interval = "" if low is None else f" [{low:g}, {high:g}]"
    return f"{entry['value']:g}{interval} of {found['answers']} (chance {entry['chance']:g})"


def _number(entry: Json) -> str:
    return "–" if entry["value"] is None else signed(entry["value"], 2)


def _index(entry: Json) -> str:
    low, high = entry["ci95"]
    return _number(entry) + ("" if low is None else f" [{signed(low, 2)}, {signed(high, 2)}]")


def _beside(entry: Json) -> str:
    low, high = entry["chance95"]
    chance = "" if low is None else f" (labels in random order {signed(low, 2)} to {signed(high, 2)}, n = {entry['n']})"
    return _index(entry) + chance
