"""Words of the pages, and what user pages must not say: ``python -m studies.site.words`` (part of ``make docs``)."""

import re
import sys

from belt_sim.io import ROOT
from studies.application import show_help

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MOST, MOST_OF_README, LONG = 22_000, 600, 1_500
#: pages that may be longer than LONG, and why
REASONS = {"theory.md": "derivations of every law", "how_far.md": "a row for each effect"}
_CODE = re.compile(r"^```.*?^```|`[^`]*`", re.MULTILINE | re.DOTALL)
#: parts that a program writes out of the code
_WRITTEN = re.compile(r"<!-- written.*?<!-- end -->", re.DOTALL)
#: laboratory history; it belongs to studies/ or CHANGELOG.md
FORBIDDEN = {
    "a commit hash": re.compile(r"\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,40}\b"),
    "a commit": re.compile(r"\b(until|since|before|at) commit\b"),
    "a seed": re.compile(r"\bseeds?\b|(?<![\d./])\d{7}\b(?!\.\d)"),
}


def count(text: str) -> int:
    """Words of a page as ``wc -w`` counts them."""
    return len(text.split())


def history(text: str) -> list[str]:
    """What a page says that is laboratory history; commands may have seeds."""
    prose = _CODE.sub("", text)
    found = [f"a commit hash: {m.group()}" for m in FORBIDDEN["a commit hash"].finditer(text)]
    found += [f"{what}: {m.group()}" for what in ("a commit", "a seed") for m in FORBIDDEN[what].finditer(prose)]
    return found


def pages() -> dict[str, str]:
    """The text of each page without what programs have written."""
    return {p.name: _WRITTEN.sub("", p.read_text(encoding="utf-8")) for p in PAGES}


def faults() -> list[str]:
    """Every fault of the pages, a line each."""
    texts = pages()
    found = [f"{name}: {said}" for name, text in texts.items() for said in history(text)]
    found += [f"{n}: {count(t)} words" for n, t in texts.items() if count(t) > LONG and n not in REASONS]
    if count(texts["README.md"]) > MOST_OF_README:
        found.append(f"README.md: {count(texts['README.md'])} words, at most {MOST_OF_README}")
    if (total := sum(map(count, texts.values()))) > MOST:
        found.append(f"all pages: {total} words, at most {MOST}")
    return found


if __name__ == "__main__":
    show_help(__doc__)
    sizes = sorted((count(text), name) for name, text in pages().items())
    print("\n".join(f"{n:6d} {name}" for n, name in sizes))
    print(f"{sum(n for n, _ in sizes):6d} in all")
    sys.exit("\n".join(faults()) or 0)
