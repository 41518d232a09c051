"""The documentation site: every link leads somewhere, and a page needs nothing from the network."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

HOME = Path(__file__).parent.parent
FETCHED = re.compile(r"""<(?:script|img|iframe)[^>]*\ssrc=["']?(?:https?:)?//|<link[^>]*\shref=["']?(?:https?:)?//""")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "-q", "--strict", "-d", str(folder)],
        cwd=HOME, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    return folder


def test_no_page_fetches_a_script_a_font_or_a_picture_from_the_network(site):
    pages = [page for page in site.rglob("*.html") if page.parent != site / "reports" or page.name == "README.html"]
    assert len(pages) > 50
    assert [page.name for page in pages if FETCHED.search(page.read_text())] == []
    assert [style.name for style in site.rglob("*.css") if re.search(r"url\(['\"]?(https?:)?//", style.read_text())] == []
