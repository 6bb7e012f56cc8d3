"""The directive ``names`` (a Sphinx extension): what a page lists by name, as autodoc documents it.

``python -m studies.site.reference`` writes the names, a line each, for docs/reference.md unbuilt.
"""

import inspect
import re
from importlib import import_module
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive, directives
from docutils.statemachine import StringList
from sphinx.application import Sphinx

from belt_sim.io import ROOT
from studies.application import show_help

PAGE = ROOT / "docs" / "reference.md"
_BLOCK = re.compile(r"^```\{names\} (\S+)\n(?::members:\n)?(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: str) -> list[tuple[str, list[str]]]:
    """Module and names of every block of the directive, in order."""
    return [(module, listed.split()) for module, listed in _BLOCK.findall(page)]


def kind(module: str, name: str) -> str:
    """The directive of autodoc for ``module.name``, whose name may have dots."""
    place, _, last = f"{module}.{name}".rpartition(".")
    found = getattr(import_module(place), last)
    if not inspect.isclass(found):
        return "autofunction"
    return "autoexception" if issubclass(found, Exception) else "autoclass"


def written() -> str:
    """The page with a table above each block: a name a row, and the first sentence of its docstring up to a colon."""
    page = re.sub(r"<!-- written -->.*?<!-- end -->\n\n", "", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    return _BLOCK.sub(lambda found: f"{_table(found[1], found[2].split())}\n\n{found[0]}", page)


def _table(module: str, names: list[str]) -> str:
    lines = ["<!-- written -->", "| name | is |", "| --- | --- |"]
    for name in names:
        place, _, last = f"{module}.{name}".rpartition(".")
        first = " ".join((inspect.getdoc(getattr(import_module(place), last)) or "").split("\n\n", 1)[0].split())
        sentence = re.split(r"[.:;](?:\s|$)", re.sub(r" \([^()]*(\(\))?[^()]*\)", "", first))[0].replace("``", "`")
        lines.append(f"| `{last}` | {sentence.replace('|', chr(92) + '|')} |")
    return "\n".join([*lines, "<!-- end -->"])


class Names(Directive):
    """``{names} MODULE`` in a Markdown page: its names, documented by autodoc; ``:members:`` with what they hold."""

    required_arguments = 1
    has_content = True
    option_spec = {"members": directives.flag}

    def run(self) -> list[nodes.Node]:
        """The nodes of all names."""
        module = self.arguments[0]
        lines = ["```{eval-rst}"]
        for name in " ".join(self.content).split():
            lines.append(f".. {kind(module, name)}:: {module}.{name}")
            lines += ["   :members:"] if "members" in self.options and kind(module, name) == "autoclass" else []
        here = nodes.section()
        here.document = self.state.document
        self.state.nested_parse(StringList([*lines, "```"], source=str(PAGE)), self.content_offset, here)
        return here.children


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_directive("names", Names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    show_help(__doc__)
    PAGE.write_text(written(), encoding="utf-8")
