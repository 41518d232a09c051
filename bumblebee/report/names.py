"""Names of policies on the page, and their order: what came along apart from what this loop made."""

import re

from bumblebee.report.results import Json, LoopResults

BASE, SHIPPED = "base", "shipped"


def label(results: LoopResults, policy: str) -> str:
    """`base (shipped)`, `experts-r0, compensated`, `control r1: declared model`: a policy's name with what it is."""
    if policy == SHIPPED:
        return "shipped policy"
    if policy == BASE and results.began != "scratch":
        return f"base ({_origin(results)})"
    if found := re.fullmatch(r"control-(declared|delta)-r(\d+)", policy):
        return f"control r{found[2]}: {'declared model' if found[1] == 'declared' else 'delta alone'}"
    return policy.replace("-compensated", ", compensated")


def reference(evaluation: Json) -> str:
    """The policy that the loop began with: the shipped one where it was evaluated by itself, else the base policy."""
    return SHIPPED if any(entry["policy"] == SHIPPED for entry in evaluation["results"]) else BASE


def same_files(evaluation: Json, first: str, second: str) -> bool:
    """Whether the evaluation says that both are the same files, directly or by way of the base policy."""

    def told(a: str, b: str) -> bool:
        return any(c["from"] == a and c["to"] == b and c.get("unchanged") for c in evaluation["comparisons"])

    return told(first, second) or (told(first, BASE) and told(BASE, second))


def _origin(results: LoopResults) -> str:
    there = reference(results.evaluation) == SHIPPED
    trained_on = not same_files(results.evaluation, SHIPPED, BASE) if there else results.base_trained_on
    return f"{results.began}, trained on" if trained_on else results.began


def ladder(results: LoopResults) -> list[str]:
    """Policies in the order of the loop: untrained, shipped, base, all experts by round, generalist; no controls."""
    names = _evaluated(results)
    experts = sorted((n for n in names if re.match(r"experts-r\d+", n)), key=_turn)
    return [n for n in ("untrained", SHIPPED, BASE, *experts, "generalist") if n in names]


def everyone(results: LoopResults) -> list[str]:
    """The ladder with each round's controls behind that round's experts."""
    order, names = [], _evaluated(results)
    controls = [n for n in names if re.fullmatch(r"control-\w+-r\d+", n)]
    for name in ladder(results):
        order.append(name)
        if found := re.fullmatch(r"experts-(r\d+)", name):
            order += [c for c in controls if c.endswith(f"-{found[1]}")]
    return order + [c for c in controls if c not in order]


def last_policy(results: LoopResults) -> str:
    """The loop's last policy: the generalist, else the last round's experts."""
    return [name for name in ladder(results) if not name.endswith("-compensated")][-1]


def pair(evaluation: Json, first: str, second: str, engine: str, split: str = "all") -> Json | None:
    """The paired comparison of the second policy against the first; None where there is none."""
    wanted = {"from": first, "to": second, "engine": engine, "split": split}
    return next((c for c in evaluation["comparisons"] if all(c[key] == value for key, value in wanted.items())), None)


def _evaluated(results: LoopResults) -> list[str]:
    return list(dict.fromkeys(entry["policy"] for entry in results.evaluation["results"]))


def _turn(name: str) -> tuple[int, str]:
    found = re.match(r"experts-r(\d+)", name)
    return (int(found[1]) if found else 0, name)
