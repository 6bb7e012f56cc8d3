"""Scene: a case as MJCF that runs in plain MuJoCo, to look at, edit and run again."""

from typing import TYPE_CHECKING, Any

from belt_sim.case import Case
from belt_sim.config import case_asked
from belt_sim.errors import InputError
from belt_sim.use_cases.asked import model_of

if TYPE_CHECKING:
    from mujoco import MjSpec


def scene(case: Case | None = None, *, model: Any = "mujoco_flex", **settings: Any) -> "MjSpec":
    """The scene of ``case`` (in SI), or of the case that ``settings`` describe as for ``simulate``, not yet compiled.

    MuJoCo's contacts carry the belt; ``simulate(model={"name": ..., "scene": spec})`` runs it, edited or not.
    """
    if case is not None and settings:
        name, value = next(iter(settings.items()))
        raise InputError(name, value, "", "give either a case or its settings")
    case = case_asked(**settings) if case is None else case
    from belt_sim.mujoco3d.model import SpaceModel
    from belt_sim.mujoco3d.run.simulate import contact_scene

    chosen = model_of(model)
    if not isinstance(chosen, SpaceModel):
        raise InputError("model", chosen.name, "", "use mujoco_flex, mujoco_grid or mujoco_rope")
    return contact_scene(case, chosen.belt, chosen.options)


def scene_text(case: Case, model: Any) -> str:
    """The same as MJCF, commented."""
    from belt_sim.mujoco3d.mujoco_4 import compiled, mjcf
    from belt_sim.mujoco3d.rolling_contact.scene import STORY

    spec = scene(case, model=model)
    compiled(spec)
    return mjcf(spec, STORY)
