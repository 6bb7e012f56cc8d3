"""The catalogue of effects, from the effects themselves: the directive ``effects`` (a Sphinx extension)."""

import inspect
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.nodes import nested_parse_with_titles

from belt_sim.effects.base import Effect, overrides
from belt_sim.effects.library import library


def text(effect: type[Effect]) -> str:
    """An effect as reStructuredText: what its file says first, its law in words, its numbers, its hooks."""
    first = (inspect.getmodule(effect).__doc__ or "").strip().splitlines()[0]  # type: ignore[union-attr]
    facts = [f"law: {effect.law}", f"parity in yaw: {effect.parity}"]
    if effect.tension_exponent is not None:
        facts.append(f"late rate ~ tension^{effect.tension_exponent:g}")
    if effect.on_belt:
        facts.append("belongs to the belt")
    if effect.only_when_named:
        facts.append("tried only when named")
    facts.append("hooks: " + ", ".join(f"``{h}``" for h in sorted(overrides(effect))))
    lines = [effect.id, "-" * len(effect.id), "", f"**{first}**", "", inspect.getdoc(effect) or "", ""]
    lines += ["; ".join(facts) + ".", "", f"Source: {effect.reference}.", "", *_numbers(effect)]
    return "\n".join(lines)


def _numbers(effect: type[Effect]) -> list[str]:
    """The parameters as a list-table; of many alike (harmonics) the first ones."""
    shown = list(effect.parameters.items())
    left_out = len(shown) - 4 if len(shown) > 8 else 0
    rows = [("parameter", "unit", "meaning", "plausible", "null")]
    for name, p in shown[: 4 if left_out else None]:
        low, high = p.plausible
        rows.append((f"``{name}``", p.unit, p.meaning, f"{low:g} to {high:g}", f"{p.null:g}"))
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in rows:
        lines += [f"   {'* -' if k == 0 else '  -'} {cell}" for k, cell in enumerate(row)]
    return [*lines, "", f"and {left_out} more of this kind.", ""] if left_out else [*lines, ""]


class Effects(Directive):
    """``{effects}``: a section for every effect of the library."""

    def run(self) -> list[nodes.Node]:
        """The sections."""
        here = nodes.section()
        here.document = self.state.document
        for effect in library().values():
            source = f"effect {effect.id}"
            nested_parse_with_titles(self.state, StringList(text(effect).splitlines(), source=source), here)
        return here.children


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_directive("effects", Effects)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
