"""The site is read without a network: a page that would load anything from elsewhere stops the build (a Sphinx
extension). Links that a reader may click are no loads."""

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)
ELSEWHERE = re.compile(r"^\s*(?:[a-z][a-z0-9+.-]*:)?//", re.IGNORECASE)
IN_STYLE = re.compile(r"""(?:url\(\s*|@import\s+)["']?((?:[a-z]+:)?//[^"')\s]+)""", re.IGNORECASE)
#: attributes that make a browser fetch something, by tag; None: of any tag
FETCHED = {None: {"src", "srcset", "poster", "background"}, "link": {"href"}, "object": {"data"}, "use": {"href"}}
#: links of a page's head that say where it stands, and load nothing
NAMES_ONLY = {"canonical", "author", "license", "next", "prev"}


class _Loads(HTMLParser):
    """Collects the addresses that a page loads from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._style = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Addresses in the attributes of one tag."""
        given = {name: value or "" for name, value in attrs}
        self._style = tag == "style"
        self.found += IN_STYLE.findall(given.get("style", ""))
        if tag == "link" and given.get("rel", "") in NAMES_ONLY:
            return
        names = FETCHED[None] | FETCHED.get(tag, set())
        self.found += [v for n, v in given.items() if n in names and ELSEWHERE.match(v)]

    def handle_data(self, data: str) -> None:
        """Addresses in a style sheet that stands in the page."""
        if self._style:
            self.found += IN_STYLE.findall(data)


def loads(html: str) -> list[str]:
    """Addresses elsewhere that a browser would load with this page."""
    parser = _Loads()
    parser.feed(html)
    return parser.found


def loads_of_site(folder: Path) -> dict[str, list[str]]:
    """What every page and style sheet below ``folder`` would load from elsewhere, where there is anything."""
    pages = {p: loads(p.read_text(encoding="utf-8")) for p in folder.rglob("*.html")}
    pages |= {p: IN_STYLE.findall(p.read_text(encoding="utf-8")) for p in folder.rglob("*.css")}
    return {str(p.relative_to(folder)): found for p, found in sorted(pages.items()) if found}


def _watch(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        for page, found in loads_of_site(Path(app.outdir)).items():
            _log.warning("%s loads %s: bring it along", page, ", ".join(found), type="offline")


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("build-finished", _watch)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
