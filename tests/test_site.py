"""The documentation site; `make check` builds it strictly, so that every link leads somewhere."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from mkdocs.exceptions import PluginError

HOME = Path(__file__).parent.parent
sys.path.insert(0, str(HOME / "docs" / "hooks"))

import pages  # noqa: E402
from settings_page import settings_page  # noqa: E402


def keys_of(page: str) -> dict[str, set[str]]:
    """Names of the rows of every table, by its heading."""
    tables = {}
    for part in page.split("\n## ")[1:]:
        title, _, rest = part.partition("\n")
        tables[title.strip("`")] = {line.split("`")[1] for line in rest.splitlines() if line.startswith("| `")}
    return tables


def test_the_page_of_settings_has_every_key_that_the_demos_file_sets_and_keys_of_tables_in_it():
    tables = keys_of(settings_page())
    for section, keys in yaml.safe_load((HOME / "params.yaml").read_text()).items():
        if isinstance(keys, dict):
            assert set(keys) <= tables[section], section
    assert {"learning_rate", "iterations", "symmetry"} <= tables["PpoConfig"] and "num_worlds" in tables["EnvConfig"]


@pytest.mark.parametrize("tag", ['<script src="https://x.y/z.js">', '<link rel=stylesheet href="//fonts.x.y/f">'])
def test_a_page_that_fetches_from_the_network_is_refused(tag: str):
    page = SimpleNamespace(file=SimpleNamespace(src_uri="a.md"))
    assert pages.on_post_page('<script src="assets/a.js"></script><a href="https://x.y">x</a>', page, None)
    with pytest.raises(PluginError, match=r"a\.md: nothing may come from the network"):
        pages.on_post_page(tag, page, None)


def test_the_name_of_a_page_becomes_a_link_but_not_in_code():
    known = SimpleNamespace(get_file_from_path=lambda uri: uri if uri in {"data.md", "decisions/plan.md"} else None)
    page = SimpleNamespace(file=SimpleNamespace(src_uri="decisions/plan.md"), meta={})
    said = pages.on_page_markdown("`docs/data.md`, `plan.md`, `no.md`\n\n```\n`docs/data.md`\n```\n", page, None, known)
    assert said == "[`docs/data.md`](../data.md), [`plan.md`](plan.md), `no.md`\n\n```\n`docs/data.md`\n```\n"
    assert page.meta["search"]["boost"] < 1
