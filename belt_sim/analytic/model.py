"""The analytic models by name: each is a span law; run-up, wrap, drive and sensor laws are shared."""

from collections.abc import Sequence
from dataclasses import dataclass

from belt_sim.analytic import steady
from belt_sim.analytic.composition import ALL_HOOKS, Composition
from belt_sim.analytic.march import KEEP, STEP, march_driven
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.base import Effect
from belt_sim.effects.contact import LiftOff
from belt_sim.effects.pipeline import as_indicated
from belt_sim.errors import InputError
from belt_sim.frame import Observer
from belt_sim.laws import span as span_law


@dataclass(frozen=True, kw_only=True)
class AnalyticModel(Composition):
    """A linear span law marched in travel, differentiable in every number of a case and of an effect.

    step [m]: of the march; keep [m]: between two records.
    """

    step: float = STEP
    keep: float = KEEP

    @property
    def outputs(self) -> frozenset[str]:
        """Return the names of the arrays of Curves that it fills."""
        return frozenset({"y", "angle", "moment", "edge_stress", "tilt", "sag"})

    def run(
        self, case: Case, effects: Sequence[Effect] = (), *, travel: float, observers: Sequence[Observer] = ()
    ) -> Curves:
        """Return the curves over ``travel`` [m] as indicated; observers see the start and the finished curves."""
        self.admit(effects)
        for observer in observers:
            observer.start(case, travel)

        def engine(driven: Case, far: float) -> Curves:
            return march_driven(driven, self, effects, travel=far, step=self.step, keep=self.keep)

        curves = as_indicated(engine, case, effects, travel)
        for observer in observers:
            observer.finish(curves)
        return curves

    def steady_rate(self, case: Case) -> float:
        """Return the late drift w = dy/ds without effects [m/m], in closed form."""
        return steady.steady_rate(case, self)


_NO_SPAN = ALL_HOOKS - {"span"}
_LIMP = ALL_HOOKS - {"span", "hold", "bend", "runup", "slide"}

MODELS: dict[str, AnalyticModel] = {
    m.name: m
    for m in (
        AnalyticModel(name="rope", title="limp rope", span=span_law.rope, hooks=_LIMP, moments=False),
        AnalyticModel(name="beam_th1", title="beam, 1st order", span=span_law.beam_first_order, hooks=_NO_SPAN),
        AnalyticModel(name="beam_th2", title="beam, 2nd order", span=span_law.beam_second_order),
        AnalyticModel(name="ernst_beam", title="beam with Ernst's modulus", span=span_law.ernst_beam, hooks=_NO_SPAN),
        AnalyticModel(
            name="strip",
            title="hanging strip",
            span=span_law.strip,
            contains=frozenset({"sag_roll"}),
        ),
        AnalyticModel(
            name="strip_lift_off",
            title="hanging strip that lifts off",
            span=span_law.strip,
            contains=frozenset({"sag_roll", "lift_off"}),
            built_in=(LiftOff(strength=1.0),),
        ),
    )
}


def analytic_model(name: str) -> AnalyticModel:
    """Return the analytic model of a name; raise InputError for an unknown one."""
    if name not in MODELS:
        raise InputError("model", name, "", f"use one of {', '.join(MODELS)}")
    return MODELS[name]
