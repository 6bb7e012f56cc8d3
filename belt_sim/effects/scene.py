"""Which effects a 3D scene can have: those that edit it, and those of the instruments and the settings."""

from belt_sim.effects.base import Effect

SHAPERS = ("span", "bend", "yaw", "runup", "slide", "wrap")


def has_scene(effect: Effect | type[Effect]) -> bool:
    """True when the effect changes a 3D scene (``edit_scene``)."""
    return hasattr(effect, "edit_scene")


def scene_refusal(effect: Effect | type[Effect]) -> str | None:
    """Why the 3D models cannot show an effect; None when they can."""
    cls = effect if isinstance(effect, type) else type(effect)
    shapes = any(getattr(cls, h) is not getattr(Effect, h) for h in SHAPERS)
    if shapes and not has_scene(cls):
        return "it has no geometry, so the 3D models refuse it"
    return None
