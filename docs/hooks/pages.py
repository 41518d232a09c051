"""Pages of the site that are made: files of the root, the list of decisions, settings; and links between pages.

mkdocs calls the functions by their names. On GitHub a page names another as `docs/data.md`; here that becomes a link.
"""

import posixpath
import re
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

sys.path.insert(0, str(Path(__file__).parent))  # mkdocs loads a hook by its file alone
from settings_page import settings_page

HOME = Path(__file__).parent.parent.parent
ROOT_PAGES = {"contributing.md": "CONTRIBUTING.md", "security.md": "SECURITY.md", "changelog.md": "CHANGELOG.md"}
NAMED = re.compile(r"(?<![\[`])`(?:docs/)?([\w./-]+\.md|reports/|decisions/)`(?![`\]])")
FETCHED = re.compile(r"""<(?:script|img|iframe)[^>]*\ssrc=["']?(?:https?:)?//|<link[^>]*\shref=["']?(?:https?:)?//""")
FOLDERS = {"reports/": "reports/README.md", "decisions/": "decisions/index.md"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that lie elsewhere or are made."""
    for page, source in ROOT_PAGES.items():
        files.append(File.generated(config, page, abs_src_path=str(HOME / source)))
    files.append(File.generated(config, "decisions/index.md", content=decisions()))
    files.append(File.generated(config, "settings.md", content=settings_page()))
    return files


def decisions() -> str:
    """Write the list of all decisions, by their titles."""
    told = [(file.read_text().split("\n", 1)[0].lstrip("# "), file.name) for file in _decisions()]
    rows = "\n".join(f"- [{title}]({name})" for title, name in sorted(told))
    return f"# Decisions\n\nWhy things are as they are, for whoever wants to change them.\n\n{rows}\n"


def _decisions() -> list[Path]:
    return sorted((HOME / "docs" / "decisions").glob("*.md"))


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn names of pages into links, outside of code; decisions come last in a search."""
    if page.file.src_uri.startswith("decisions/"):
        page.meta["search"] = {"boost": 0.3}
    here = posixpath.dirname(page.file.src_uri)

    def linked(match: re.Match[str]) -> str:
        name = {source: made for made, source in ROOT_PAGES.items()}.get(match[1], FOLDERS.get(match[1], match[1]))
        for uri in (name, posixpath.normpath(posixpath.join(here, name))):
            if files.get_file_from_path(uri) is not None:
                return f"[{match[0]}]({posixpath.relpath(uri, here or '.')})"
        return match[0]

    fenced = re.split(r"(^```.*?^```$)", markdown, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if part.startswith("```") else NAMED.sub(linked, part) for part in fenced)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Refuse a page whose scripts, styles or pictures come from the network."""
    if fetched := FETCHED.search(output):
        raise PluginError(f"{page.file.src_uri}: nothing may come from the network, found {fetched[0][:80]}")
    return output
