"""Which effects a 3D scene can have: those that edit it, and those of the instruments and the settings."""

from belt_sim.effects.base import Effect

#: laws that act through the belt's width
THROUGH_WIDTH = ("span", "runup", "slide")
SHAPERS = ("span", "bend", "yaw", "runup", "slide", "wrap")


def has_scene(effect: Effect | type[Effect]) -> bool:
    """True when the effect changes a 3D scene (``edit_scene``)."""
    return hasattr(effect, "edit_scene")


def scene_refusal(effect: Effect | type[Effect], *, rope: bool = False) -> str | None:
    """Why the 3D models cannot show an effect; None when they can.

    rope: asks for mujoco_rope, whose belt has no width: what acts through the width, answers to the belt's moment or
    bends the belt itself would do nothing there.
    """
    cls = effect if isinstance(effect, type) else type(effect)
    if _changes(cls, SHAPERS) and not has_scene(cls):
        return "it has no geometry, so the 3D models refuse it"
    if rope and has_scene(cls) and (_changes(cls, THROUGH_WIDTH) or cls.last or cls.on_belt):
        return "it acts through the width or the moment of the belt, and a rope has neither"
    return None


def _changes(cls: type[Effect], laws: tuple[str, ...]) -> bool:
    return any(getattr(cls, law) is not getattr(Effect, law) for law in laws)
