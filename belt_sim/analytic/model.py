"""The analytic models by name: each is a span law; run-up, wrap, drive and sensor laws are shared."""

from collections.abc import Callable
from dataclasses import dataclass

from belt_sim.case import Case
from belt_sim.effects.base import Effect
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.laws import span as span_law

#: hooks of Effect that a march can honour
ALL_HOOKS = frozenset({"settings", "span", "bend", "yaw", "runup", "slide", "wrap", "encoder", "sensor"})


@dataclass(frozen=True, kw_only=True)
class Model:
    """A named composition of laws.

    span: Case -> Span; hooks: the laws it lets effects change; contains: ids of effects it has built in;
    marches: whether it gives curves (Ritzinger's formula gives a steady rate only); moments: whether its spans bear
    bending moments that an effect may answer to.
    """

    name: str
    title: str
    span: Callable[[Case], span_law.Span]
    hooks: frozenset[str] = ALL_HOOKS
    contains: frozenset[str] = frozenset()
    marches: bool = True
    moments: bool = True

    def refusal(self, effect: Effect | type[Effect]) -> str | None:
        """Why this model cannot represent ``effect``; None when it can."""
        if effect.id in self.contains:
            return f"model {self.name} has {effect.id} built in already"
        if not self.marches:
            return f"model {self.name} is a formula for the steady rate and reads no effects"
        cls = effect if isinstance(effect, type) else type(effect)
        if cls.last and not self.moments:
            return f"the spans of model {self.name} bear no moment for {effect.id} to answer to"
        used = {h for h in ALL_HOOKS if getattr(cls, h) is not getattr(Effect, h)}
        missing = used - self.hooks
        if missing:
            return f"model {self.name} has no {'/'.join(sorted(missing))} law for {effect.id} to change"
        return None

    def admit(self, effects) -> None:
        """Raise CannotRepresent for the first effect that this model cannot honour."""
        for effect in effects:
            reason = self.refusal(effect)
            if reason:
                raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out or use model=beam_th2 or strip")


_NO_SPAN = ALL_HOOKS - {"span"}

MODELS: dict[str, Model] = {
    m.name: m
    for m in (
        Model(
            name="rope",
            title="limp rope",
            span=span_law.rope,
            hooks=ALL_HOOKS - {"span", "bend", "runup", "slide"},
            moments=False,
        ),
        Model(name="beam_th1", title="beam, 1st order", span=span_law.beam_first_order, hooks=_NO_SPAN),
        Model(name="beam_th2", title="beam, 2nd order", span=span_law.beam_second_order),
        Model(
            name="ritzinger",
            title="Ritzinger's edge ropes",
            span=span_law.beam_first_order,
            hooks=frozenset(),
            marches=False,
        ),
        Model(
            name="ernst_beam",
            title="beam with Ernst's modulus",
            span=span_law.ernst_beam,
            hooks=_NO_SPAN,
        ),
        Model(
            name="strip",
            title="hanging strip (sag-roll coupling)",
            span=span_law.strip,
            contains=frozenset({"sag_roll"}),
        ),
    )
}


def analytic_model(name: str) -> Model:
    """The model of that name; raises InputError for an unknown one."""
    if name not in MODELS:
        raise InputError("model", name, "", f"use one of {', '.join(MODELS)}")
    return MODELS[name]
