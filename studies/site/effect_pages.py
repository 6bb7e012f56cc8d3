"""The catalogue of effects, from the effects themselves; ``python -m studies.site.effect_pages`` writes the page."""

import inspect

from belt_sim.api.simulate import Model, model_named
from belt_sim.diagnosis.forward import ONLY_WHEN_NAMED
from belt_sim.effects.base import Effect, library, title_of
from belt_sim.io import ROOT
from belt_sim.line.hooks import HOOKS, overrides
from belt_sim.model import ANALYTIC
from studies.application import show_help

PAGE = ROOT / "docs" / "effects.md"
CAN, HAS, CANNOT = "yes", "built in", "-"
#: columns by heading; grid and membrane represent the same effects
COLUMNS = {name: name for name in ANALYTIC} | {"mujoco_rope": "mujoco_rope", "mujoco_grid, mujoco_flex": "mujoco_flex"}


def cell(model: Model, effect: type[Effect]) -> str:
    """Whether ``model`` can represent ``effect``, has it built in already, or refuses it."""
    if effect.id in getattr(model, "contains", ()):
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


def written() -> str:
    """The page with both of its parts anew."""
    parts = {"effects": "\n".join(text(e) for e in library().values()), "models": table()}
    page = PAGE.read_text(encoding="utf-8")
    for name, part in parts.items():
        before, rest = page.split(f"<!-- written: {name} -->\n", 1)
        page = f"{before}<!-- written: {name} -->\n{part}<!-- end -->\n{rest.split('<!-- end -->' + chr(10), 1)[1]}"
    return page


if __name__ == "__main__":
    show_help(__doc__)
    PAGE.write_text(written(), encoding="utf-8")
