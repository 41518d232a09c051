"""The files that the section `filter` names: dependencies of its stage, where they are named."""

from typing import Any, TypeGuard

SHIPPED = "shipped"
"""The policy that comes with BumbleBee, which is code and no file of the user's."""


def files_named(content: dict[str, Any]) -> list[tuple[str, str]]:
    """Keys and paths, from the content of params.yaml as it is, checked or not."""
    section = content.get("filter")
    section = section if isinstance(section, dict) else {}
    policy = section.get("policy")
    source = policy.get("source") if isinstance(policy, dict) else None
    named = (("filter.overrule", section.get("overrule")), ("filter.policy.source", source))
    return [(key, path) for key, path in named if _is_path(path) and path != SHIPPED]


def _is_path(path: Any) -> TypeGuard[str]:
    return isinstance(path, str) and path.isprintable() and bool(path.strip())
