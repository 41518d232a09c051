"""Every page that is written to disk says first that it loads nothing."""

import ast
from pathlib import Path

import bumblebee
from bumblebee.io.page_policy import policy, policy_tag


def test_scripts_run_only_by_their_hash() -> None:
    assert "script-src" not in policy() and "default-src 'none'" in policy_tag()
    assert policy("a()") != policy("b()") and "script-src 'sha256-" in policy("a()")


def test_every_module_that_makes_a_page_names_the_policy() -> None:
    """Wherever a text begins a page, the module asks for its policy."""
    home = Path(bumblebee.__file__).parent
    makers = [p for p in home.rglob("*.py") if "<!doctype html" in p.read_text().lower()]
    assert len(makers) >= 3
    for path in makers:
        names = {node.id for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Name)}
        assert names & {"policy", "policy_tag"}, path
