"""The catalogue of effects, from the effects themselves: directives ``effects`` and ``models`` (a Sphinx extension)."""

import inspect
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.nodes import nested_parse_with_titles

from belt_sim.api.simulate import model_named
from belt_sim.diagnosis.forward import ONLY_WHEN_NAMED
from belt_sim.effects.base import Effect, library, title_of
from belt_sim.line.hooks import HOOKS, overrides
from belt_sim.model import ANALYTIC, Model, SteadyModel

CAN, HAS, CANNOT = "yes", "built in", "-"
#: columns by heading; grid and membrane represent the same effects
COLUMNS = {name: name for name in ANALYTIC} | {"mujoco_rope": "mujoco_rope", "mujoco_grid, mujoco_flex": "mujoco_flex"}


def cell(model: Model | SteadyModel, effect: type[Effect]) -> str:
    """Whether ``model`` can represent ``effect``, has it built in already, or refuses it."""
    if isinstance(model, Model) and effect.id in model.contains:
        return HAS
    return CANNOT if model.refusal(effect) else CAN


def table() -> str:
    """A Markdown table: an effect a row, its law, a column a model; below it, what is tried only when named."""
    models = [model_named(name) for name in COLUMNS.values()]
    rows = [["effect", "law", *COLUMNS], ["---"] * (len(COLUMNS) + 2)]
    rows += [[name, effect.law, *(cell(m, effect) for m in models)] for name, effect in library().items()]
    named = ", ".join(name for name in library() if name in ONLY_WHEN_NAMED)
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([*lines, "", f"`diagnose` tries these only when they are named: {named}."]) + "\n"


def text(effect: type[Effect]) -> str:
    """An effect as Markdown: what its file says first, its law in words, its source, its numbers."""
    facts = [f"law: {effect.law}", f"parity in yaw: {effect.parity}"]
    if effect.tension_exponent is not None:
        power = f"~ tension^{effect.tension_exponent:g}" if effect.tension_exponent else "does not know the tension"
        facts.append(f"late rate {power}, when tight")
    if effect.on_belt:
        facts.append("belongs to the belt")
    if effect.id in ONLY_WHEN_NAMED:
        facts.append("tried only when named")
    facts.append("hooks: " + ", ".join(f"`{h}`" for h in HOOKS if h in overrides(effect)))
    shown = list(effect.parameters.items())
    left_out = len(shown) - 4 if len(shown) > 8 else 0  # of many alike (harmonics) the first ones
    rows = ["| parameter | unit | meaning | plausible | null |", "| --- | --- | --- | --- | --- |"]
    for name, p in shown[: 4 if left_out else None]:
        low, high = p.plausible
        rows.append(f"| `{name}` | {p.unit} | {p.meaning} | {low:g} to {high:g} | {p.null:g} |")
    numbers = "\n".join(rows) + (f"\n\nand {left_out} more of this kind." if left_out else "")
    parts = [f"## {effect.id}", f"**{title_of(effect)}.**", inspect.getdoc(effect) or "", "; ".join(facts) + "."]
    return "\n\n".join([*parts, f"Source: {effect.reference}.", numbers]) + "\n"


class Effects(Directive):
    """``{effects}`` in a Markdown page: a section for every effect of the library."""

    def texts(self) -> Iterator[tuple[str, str]]:
        """What to put there: pieces of Markdown, each with a name for messages."""
        yield from ((f"effect {e.id}", text(e)) for e in library().values())

    def run(self) -> list[nodes.Node]:
        """The nodes of all pieces."""
        here = nodes.section()
        here.document = self.state.document
        for source, markdown in self.texts():
            nested_parse_with_titles(self.state, StringList(markdown.splitlines(), source=source), here)
        return here.children


class Models(Effects):
    """``{models}`` in a Markdown page: which model can represent which effect."""

    def texts(self) -> Iterator[tuple[str, str]]:
        """The table of models and effects."""
        yield "model x effect table", table()


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_directive("effects", Effects)
    app.add_directive("models", Models)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
