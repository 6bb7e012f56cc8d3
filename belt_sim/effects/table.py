"""The model x effect table, computed: ``python -m belt_sim.effects.table`` prints it as the README has it."""

from belt_sim.analytic.model import MODELS, Model
from belt_sim.effects.base import Effect
from belt_sim.effects.library import library
from belt_sim.effects.scene import scene_refusal

BEGIN, END = "<!-- model x effect table -->", "<!-- end -->"
CAN, HAS, CANNOT = "yes", "built in", "-"


def cell(model: Model, effect: type[Effect]) -> str:
    """Whether ``model`` can represent ``effect``, has it built in already, or refuses it."""
    if effect.id in model.contains:
        return HAS
    return CANNOT if model.refusal(effect) else CAN


def table() -> str:
    """A Markdown table: an effect a row, its law, columns for the analytic models, mujoco_rope, and its sisters."""
    header = ["effect", "law", *MODELS, "mujoco_rope", "mujoco_grid, mujoco_flex"]
    rows = [header, ["---"] * len(header)]
    for name, effect in library().items():
        in_space = [CANNOT if scene_refusal(effect, rope=rope) else CAN for rope in (True, False)]
        rows.append([name, effect.law, *(cell(m, effect) for m in MODELS.values()), *in_space])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + "\n"


if __name__ == "__main__":
    print(f"{BEGIN}\n{table()}{END}")
