"""The diagnosis as plain text for a terminal."""

from typing import Any


def summary(document: dict[str, Any]) -> str:
    """Effects with intervals, error before, after and floor, what is left."""
    lines = []
    for e in document["effects"]:
        for name, p in e["parameters"].items():
            interval = f"[{p['ci95'][0]:.4g}, {p['ci95'][1]:.4g}]"
            place = ", ".join(e["where"])
            lines.append(
                f"  {e['effect']:<18} {place:<28} {name} = {p['value']:.4g} {interval} {p['unit']}"
                f" (declared {p['nominal']:.4g}), explains {100 * e['explains']:.0f} %"
            )
            if e["equivalent"]:
                same = ", ".join(f"{s['effect']} on {', '.join(s['where'])}" for s in e["equivalent"][:4])
                lines.append(f"  {'':<18} cannot be told from: {same}")
    lines = ["effects:", *lines] if lines else ["no effect found"]
    lines.append(f"{'joint_pos_rmse [rad]':<24}{'before':>12}{'after':>12}{'floor':>12}")
    for horizon in document["error"]["before"]:
        row = [document["error"][k][horizon]["joint_pos_rmse"]["value"] for k in ("before", "after", "floor")]
        lines.append(f"  {horizon + ' s':<22}" + "".join(f"{v:>12.5f}" if v is not None else f"{'-':>12}" for v in row))
    left = document["unexplained"]
    lines.append(f"unexplained: {left['description'] or 'nothing that these tests can see'} (p = {left['p']:.2g})")
    lines += [f"note: {note}" for note in document.get("notes", [])]
    lines += [f"unidentifiable: {', '.join(u['where'])}: {u['why']}" for u in document.get("unidentifiable", [])]
    return "\n".join(lines)


def gap_table(block: dict[str, Any]) -> str:
    """Error by horizon and joint."""
    lines = []
    for horizon, measures in block.items():
        lines.append(f"after {horizon} s:")
        for name, entry in measures.items():
            if name == "windows":
                lines.append(f"  windows {entry['value']}, diverged {entry['diverged']}")
                continue
            value = "-" if entry["value"] is None else f"{entry['value']:.5g}"
            lines.append(f"  {name:<18} {value}")
            ranked = sorted(entry.get("per_joint", {}).items(), key=lambda item: -(item[1]["value"] or 0.0))
            lines += [f"    {joint:<28} {e['value']:.5g}" for joint, e in ranked[:8] if e["value"] is not None]
    return "\n".join(lines)
