"""The functions of ``bs``, a line each, for docs/reference.md unbuilt: ``python -m studies.site.reference``."""

import inspect
import re

import belt_sim as bs
from belt_sim.io import ROOT

PAGE = ROOT / "docs" / "reference.md"
BEGIN, END = "<!-- functions -->\n", "<!-- end -->"


def table(page: str) -> str:
    """A row for each function that the page names: its first sentence, up to a colon."""
    lines = ["| function | gives |", "| --- | --- |"]
    for name in re.findall(r"^\.\. autofunction:: (\w+)$", page.split("## Machine", 1)[0], re.MULTILINE):
        first = " ".join((inspect.getdoc(getattr(bs, name)) or "").split("\n\n", 1)[0].split())
        sentence = re.split(r"[.:;](?:\s|$)", re.sub(r" \([^()]*(\(\))?[^()]*\)", "", first))[0].replace("``", "`")
        lines.append(f"| `{name}` | {sentence} |")
    return "\n".join(lines) + "\n"


def written() -> str:
    """The page with its table anew."""
    page = PAGE.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN, 1)
    return f"{before}{BEGIN}{table(page)}{END}{rest.split(END, 1)[1]}"


if __name__ == "__main__":
    PAGE.write_text(written(), encoding="utf-8")
