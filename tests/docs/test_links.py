"""Every link of a page leads to a file and a heading that are there, also in GitHub's view of the raw page."""

import re
from pathlib import Path

import pytest
from pages import name

from belt_sim.io import ROOT

_FENCE = re.compile(r"^(`{3,}).*?^\1", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
PAGES = [
    *ROOT.glob("*.md"),
    *(p for room in ("docs", "models", "studies") for p in sorted((ROOT / room).rglob("*.md"))),
]


def slug(heading: str) -> str:
    """The anchor that GitHub gives a heading: its text in lower case without punctuation, blanks as dashes."""
    words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    return re.sub(r"[^\w\- ]", "", words.strip().lower()).replace(" ", "-")


def anchors(path: Path) -> set[str]:
    """Anchors of a page on GitHub; headings that are alike are numbered from the second on."""
    found: dict[str, int] = {}
    for heading in _HEADING.findall(_FENCE.sub("", path.read_text(encoding="utf-8"))):
        found[slug(heading)] = found.get(slug(heading), 0) + 1
    return {f"{s}-{k}" if k else s for s, count in found.items() for k in range(count)}


def dead(path: Path) -> list[str]:
    """Links of a page, other than to the network, that lead nowhere."""
    text = re.sub(r"`[^`\n]*`", "", _FENCE.sub("", path.read_text(encoding="utf-8")))
    lost = []
    for link in _LINK.findall(text):
        if "://" in link or link.startswith("mailto:"):
            continue
        file, _, anchor = link.partition("#")
        to = path.parent / file if file else path
        if not to.exists() or (anchor and to.suffix == ".md" and anchor not in anchors(to)):
            lost.append(link)
    return lost


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_link_leads_somewhere(page):
    assert not dead(page)


def test_slugs_are_githubs():
    assert slug("1. The verdict") == "1-the-verdict"
    assert slug('"Tighten the belt"') == "tighten-the-belt"
    assert slug("scene, view") == "scene-view"
    assert slug("A [link](a.md) and `code_x`") == "a-link-and-code_x"


def test_a_dead_link_is_found(tmp_path):
    (tmp_path / "b.md").write_text("# Title\n\n## Twice\n\n## Twice\n", encoding="utf-8")
    page = tmp_path / "a.md"
    page.write_text("[a](b.md#twice-1) [b](#gone) [c](c.md) [d](b.md#title) `[e](f.md)`\n", encoding="utf-8")
    assert dead(page) == ["#gone", "c.md"]
