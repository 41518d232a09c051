"""Score of a diagnosis: names, places, sizes and intervals against the truth, and the error that is left."""

import re
from collections.abc import Sequence
from typing import Any

from bumblebee.stand_in.undeclared.kinds import KINDS

Entry = dict[str, Any]


def score(truth: Sequence[Entry], document: dict[str, Any]) -> dict[str, Any]:
    """Compare the contract's document with the truth's entries."""
    found = document["effects"]
    hits = [next((i for i, f in enumerate(found) if _same(t, f)), None) for t in truth]
    exact = [next((i for i, f in enumerate(found) if _named(t, f["effect"], f["where"])), None) for t in truth]
    owned = {i for i, f in enumerate(found) for t in truth if _same(t, f) or _part(t, f)}
    sizes = [_size(t, found[i]) for t, i in zip(truth, exact, strict=True) if i is not None]
    return {
        "named": [_label(f) for f in found],
        "found": [i is not None for i in hits],
        "exact": [i is not None for i in exact],
        "top": bool(found) and any(_same(t, found[0]) for t in truth),
        "place": [any(_place(t, f) for f in found) for t in truth],
        "top_place": bool(found) and any(_place(t, found[0]) for t in truth),
        "spurious": len(found) - len(owned),
        "alarm": bool(found) and not truth,
        "class_sizes": [len(f.get("equivalent", [])) for f in found],
        "sizes": [s for s in sizes if s],
        "outside": _outside(truth, document),
    }


def _same(truth: Entry, found: Entry) -> bool:
    """By name and place, itself or as a member of the class that the diagnosis says it cannot tell apart."""
    members = [found, *found.get("equivalent", [])]
    return any(_named(truth, m["effect"], m["where"]) for m in members)


def _named(truth: Entry, effect: str, where: Sequence[str]) -> bool:
    return truth["effect"] == effect and _where(truth, where)


def _where(truth: Entry, where: Sequence[str]) -> bool:
    """Whether joint or body are the true ones; for what has no place of its own any place is right."""
    return not truth["where"] or set(truth["where"]) == set(where)


def _part(truth: Entry, found: Entry) -> bool:
    """A name under which a part of the truth is rightly found, or what was found on its joint of a strange effect."""
    kind = KINDS[truth["effect"]]
    if kind.outside and found["effect"] == "discovered":
        return set(truth["where"]) & set(found["where"]) != set()
    return found["effect"] in kind.parts and _where(truth, found["where"])


def _place(truth: Entry, found: Entry) -> bool:
    members = [found, *found.get("equivalent", [])]
    return any(_where(truth, m["where"]) for m in members)


def _size(truth: Entry, found: Entry) -> dict[str, Any] | None:
    """Error of the first parameter that the truth changes, relative to that change; None if called otherwise."""
    shared = [n for n in truth["parameters"] if n in found["parameters"]]
    change = {n: truth["parameters"][n] - truth["nominal"].get(n, 0.0) for n in shared}
    change = {n: c for n, c in change.items() if abs(c) > 1e-12}
    if not change:
        return None
    name = next(iter(change))
    got = found["parameters"][name]
    value, (low, high) = got["value"], got["ci95"]
    wanted = truth["parameters"][name]
    # A stiffness or a limit comes from infinity: there the value itself is the measure.
    scale = min(abs(change[name]), abs(wanted)) if wanted else abs(change[name])
    return {
        "effect": truth["effect"],
        "group": truth["group"],
        "parameter": name,
        "true": wanted,
        "value": value,
        "ci95": [low, high],
        "relative": abs(value - wanted) / scale,
        "covered": bool((low is None or low <= wanted) and (high is None or wanted <= high)),  # it may have no end
    }


def _outside(truth: Sequence[Entry], document: dict[str, Any]) -> dict[str, bool] | None:
    """Verdict on a strange effect: was it flagged, its joint named, what it depends on named."""
    strange = [t for t in truth if KINDS[t["effect"]].outside]
    structure = document.get("unexplained", {})
    discovered = [f for f in document["effects"] if f["effect"] == "discovered"]
    near = [f for f in document["effects"] for t in truth if KINDS[t["effect"]].outside and _part(t, f)]
    near = [f for f in near if f["effect"] != "discovered"]  # a name that the catalogue now has for nearly the same
    flagged = bool(structure.get("significant")) or bool(discovered) or bool(near)
    if not strange:
        return {"flagged": flagged, "place": False, "form": False}
    entry, kind = strange[0], KINDS[strange[0]["effect"]]
    where = set(structure.get("where", [])) | {w for f in (*discovered, *near) for w in f["where"]}
    words = [str(w).lower() for w in structure.get("depends_on", [])] + [_terms(f).lower() for f in discovered]
    place = not entry["where"] or bool(where & set(entry["where"]))
    form = bool(near) or any(_speaks(word, kind.depends) for word in words)
    return {"flagged": flagged, "place": flagged and place, "form": flagged and place and form}


_WORDS = {"q": "position", "v": "velocity", "u": "command target error", "tau": "torque", "t": "time",
          "rested": "history", "slewed": "command target history"}  # fmt: skip


def _terms(found: Entry) -> str:
    """The quantities that discovered terms are made of, as words."""
    terms = found["parameters"].get("terms", [])
    words = []
    for term in terms:
        text = str(term.get("term", term)) if isinstance(term, dict) else str(term)
        words += ["another joint"] if "[" in text else []
        words += [
            _WORDS[symbol] for symbol in re.findall(r"[a-z]+", re.sub(r"\[[^]]*\]", "", text)) if symbol in _WORDS
        ]
    return " ".join(words)


def _speaks(text: str, depends: Sequence[str]) -> bool:
    return any(word in text for word in depends)


def _label(found: Entry) -> str:
    return f"{found['effect']} {' '.join(found['where'])}".strip()


def achieved(before: float, after: float, oracle: float) -> float | None:
    """Share of the achievable error that went, (before - after) / (before - oracle); None where there is none."""
    room = before - oracle
    return float((before - after) / room) if room > 0.02 * before else None
