"""The first sentences of a diagnosis, from its block `summary`: what is gone, what is left, what to trust."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.report.gain_by_horizon import gain_of, leaves_floor, whole_model
from bumblebee.diagnosis.report.html import number
from bumblebee.diagnosis.report.left_out import lost_without
from bumblebee.diagnosis.report.what_matters import BESIDE, CARRY, LEFT, WIDE
from bumblebee.diagnosis.thresholds.report import Matters, ReportThresholds

GROUPS = {
    CARRY: "Carry the gain",
    BESIDE: "Needed beside the others, no gain of their own shown",
    WIDE: "Not to be trusted alone",
}
"""Group of effects -> its title."""
FITTED = "Found on the fitted windows, no gain on held-out data shown"
"""Title of the first two groups in one, where the corrected model is better at no horizon."""


def headline(document: Mapping[str, Any], rules: ReportThresholds) -> list[str]:
    """Sentences in the order in which they matter; none of a document without the block."""
    told, rule = document.get("summary"), rules.matters
    if not told or told["horizon"] is None:
        return []
    lines = [_removed(document, told, rules), _left(told, rule), _structure(told, rule)]
    return [line for line in [*lines, trusted(document, rules)] if line]


def _removed(document: Mapping[str, Any], told: Mapping[str, Any], rules: ReportThresholds) -> str:
    """How much of the removable error is gone, at the horizon that is told first and at the others."""
    horizon = told["horizon"]
    count = told["rollouts"]
    on = f"on {count} held-out rollout{'s' if count > 1 else ''}" if count else "on the fitted rollout"
    parts = [_gone(entry, bool(document["effects"]), rules) for entry in told["removed"].get(horizon, [])]
    if not parts:
        return ""
    others = [
        f"{name} s {', '.join(_percent(e) for e in entries)}"
        for name, entries in told["removed"].items()
        if name != horizon and document["effects"] and all(e["share"] is not None for e in entries)
    ]
    after = f" ({'; '.join(others)})" if others else ""
    return f"After {horizon} s {on}, {' and '.join(parts)}{after}."


def _gone(entry: Mapping[str, Any], corrected: bool, rules: ReportThresholds) -> str:
    """Change of the error of one kind of joint, in words."""
    what, size = entry["what"], f"{sized(entry['before'], entry['unit'])} RMS"
    if entry["share"] is None and entry["floor"] is not None:
        larger = f", the corrected model's is larger ({sized(entry['after'], entry['unit'])})"
        more = larger if leaves_floor(entry, rules) else ""
        return f"the declared model's error of the {what} ({size}) is at the noise floor{more}"
    if not corrected:
        return f"nothing was removed of the error of the {what} ({size})"
    if entry["share"] is None:
        return f"the error of the {what} goes from {_change(entry)}, and no noise floor is known"
    if entry["share"] < 0:
        return f"the error of the {what} is larger: {_change(entry)}"
    return f"{_percent(entry)} of the removable error of the {what} is gone: {_change(entry)}"


def _change(entry: Mapping[str, Any]) -> str:
    noise = f", noise {sized(entry['floor'], entry['unit'])}" if entry["floor"] else ""
    if entry["floor"] and entry["after"] <= entry["floor"]:
        noise = (
            f", at the noise floor: the error of a complete model scatters about {sized(entry['floor'], entry['unit'])}"
        )
    return f"{sized(entry['before'], entry['unit'])} to {sized(entry['after'], entry['unit'])} RMS{noise}"


def _percent(entry: Mapping[str, Any]) -> str:
    ends = f" [{100 * entry['ci95'][0]:.0f}, {100 * entry['ci95'][1]:.0f}]" if entry["ci95"] else ""
    return f"{100 * entry['share']:.0f} %{ends}"


def sized(value: float | None, unit: str) -> str:
    """An error in units of the task: degrees of angles, mm of lengths; `unit` is rad or m."""
    if value is None:
        return "-"
    return f"{number(1e3 * value)} mm" if unit == "m" else f"{number(float(np.degrees(value)), 2)}°"


def _left(told: Mapping[str, Any], rule: Matters) -> str:
    """Joints by what they leave, until most of it is told; then the ends of the chains and the base."""
    joints = [entry for entry in told["left"] if entry["what"] == "joint" and entry["share"] > 0]
    parts, covered = [], 0.0
    for entry in joints[: rule.places]:
        if covered >= rule.told:
            break
        covered += entry["share"]
        parts.append(f"{entry['where']} {sized(entry['value'], entry['unit'])} ({100 * entry['share']:.0f} %)")
    ends = [f"{e['where']} {sized(e['value'], 'm')} off (declared {sized(e['before'], 'm')})" for e in told["ends"]]
    base = [f"base {sized(e['value'], e['unit'])}" for e in told["left"] if e["what"] == "base"]
    listed = ", ".join([*parts, *ends, *base])
    return f"What is left after {told['horizon']} s: {listed}." if listed else ""


def _structure(told: Mapping[str, Any], rule: Matters) -> str:
    """Verdict of the tests of what is left, as a share of its chi-square; what explains hardly anything is listed."""
    said = [entry for entry in told["structure"] if entry["proclaimed"]]
    slight = [entry["where"] for entry in told["structure"] if not entry["proclaimed"]]
    parts = [
        f"{_of_left(entry)}a missing {'force' if entry['unit'] == 'N' else 'torque'} at {entry['where']} "
        f"({number(entry['torque'], 2)} {entry['unit']} RMS, {_on(entry)})"
        for entry in said[: rule.places]
    ]
    text = f"Part of it has structure: {'; '.join(parts)}." if parts else ""
    if slight:
        below = f"below {100 * rule.structure:.0f} % of {LEFT}"
        text += f"{' ' if text else ''}Significant, but {below}: {', '.join(slight)}."
    return text


def _of_left(entry: Mapping[str, Any]) -> str:
    return "" if entry["explains"] is None else f"{100 * entry['explains']:.0f} % of {LEFT}, "


def _on(entry: Mapping[str, Any]) -> str:
    return f"depends on {', '.join(entry['depends_on'])}" if entry["depends_on"] else "on no single quantity"


def trusted(document: Mapping[str, Any], rules: ReportThresholds) -> str:
    """One sentence on what may be read from the effects; of a gain only where there is one at some horizon."""
    told = document["summary"]
    if not told["trust"]:
        return ""
    gain = gain_of(document, rules)
    text = whole_model(gain, bool(document.get("warnings") or document.get("set_aside")))
    if not gain.better and not gain.nothing_to_gain:
        return f"{text}."
    if gain.better:
        carry = [t for t in told["trust"] if t["group"] == CARRY]
        text += f"; its gain comes from {_listed(_named(carry), rules.listing.effects) or 'no single effect'}"
    return f"{text}; {_readable(told['trust'], rules)}."


def _readable(trust: Sequence[Mapping[str, Any]], rules: ReportThresholds) -> str:
    """Which effects are sizes by themselves, and why the others are not."""
    known = [t for t in trust if t["group"] == CARRY and not (t["wide"] or t["alike"] or t.get("bound"))]
    text = f"read as sizes by themselves {_listed(_named(known), rules.listing.effects) or 'none'}"
    if len(known) == len(trust):
        return text
    wide, alike = (sum(t[why] for t in trust) for why in ("wide", "alike"))
    fold = f"{rules.matters.wide:g}-fold"
    why = [f"{wide} have intervals wider than {fold} or with the declared value in them"] if wide else []
    why += [f"{alike} look like another effect"] if alike else []
    bound = sum(bool(t.get("bound")) for t in trust)
    why += [f"{bound} at the end of the values that are tried"] if bound else []
    others = len(trust) - len(known)
    how = f"the other {others} only together" if others > 1 else "the other one only with the rest"
    return f"{text}; take {how}{_in_brackets(why)}"


def _in_brackets(texts: Sequence[str]) -> str:
    return f" ({', '.join(texts)})" if texts else ""


def _named(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    return [f"{e['effect']} on {', '.join(e['where']) or 'the whole robot'}" for e in effects]


def effect_groups(document: Mapping[str, Any], rules: ReportThresholds) -> list[tuple[str, list[dict[str, Any]]]]:
    """Title and effects of every group that has any; effects that differ by their joint alone as one."""
    effects, told = document["effects"], document.get("summary")
    if not told:
        return [("Effects", list(effects))] if effects else []
    titles = dict(GROUPS) if gain_of(document, rules).better else dict.fromkeys(GROUPS, FITTED)
    fold = f"{rules.matters.wide:g}-fold"
    titles[WIDE] = f"{GROUPS[WIDE]}: interval wider than {fold}, or with the declared value in it"
    groups: dict[str, list[dict[str, Any]]] = {title: [] for title in titles.values()}
    for effect, trust in zip(effects, told["trust"], strict=True):
        groups[titles[trust["group"]]].append(effect | {"wide": trust["wide"] and trust["group"] != WIDE})
    return [(title, _together(mine)) for title, mine in groups.items() if mine]


def experiments(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    """Experiments that would tell effects from those that look alike, each once, with the effects that it is for."""
    wanted: dict[str, list[str]] = {}
    for effect in effects:
        for text in effect.get("separate_by", []):
            wanted.setdefault(text, []).extend(_named([effect]))
    return [f"{text} ({_listed(names, 3)})" for text, names in sorted(wanted.items(), key=lambda pair: -len(pair[1]))]


def _together(effects: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Effects of one kind and size, whose joints are told in one line (the steps of like encoders)."""
    out: list[dict[str, Any]] = []
    for effect in effects:
        alike = [e for e in out if _same(e, effect)]
        if alike:
            alike[0]["where"] = [*alike[0]["where"], *effect["where"]]
        else:
            out.append(dict(effect))
    return out


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Alike but for the joint, as far as digits are shown."""
    if not one["parameters"] or not other["where"] or one["effect"] == "discovered":
        return False
    keys = ("effect", "equivalent")
    return all(one[key] == other[key] for key in keys) and _shown(one) == _shown(other)


def _shown(effect: Mapping[str, Any]) -> str:
    sizes = [x for p in effect["parameters"].values() for x in (p["value"], *(p["ci95"] or ()), p["nominal"])]
    return f"{lost_without(effect)} " + " ".join("-" if x is None else f"{x:.4g}" for x in sizes)


def _listed(names: Sequence[str], most: int) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
