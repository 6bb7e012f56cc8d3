"""The model x effect table, computed for the site: which model can represent which effect."""

from belt_sim.diagnosis.readings.candidates import ONLY_WHEN_NAMED
from belt_sim.effects.base import Effect, library
from belt_sim.model import ANALYTIC, Model, SteadyModel, model_named

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
