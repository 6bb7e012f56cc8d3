"""The analytic models by their names, and the names of all models.

A model has a name and a title, refuses effects that it cannot represent, and runs a case (``AnalyticModel``,
``belt_sim.space.model.SpaceModel``) or gives its late rate alone (``RitzingerFormula``). They are told apart by type
(``isinstance``), never by name. Each analytic model is a span law; run-up, wrap, drive and sensor laws are shared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, get_args

from belt_sim.case import Case
from belt_sim.curves import Curves, Observer
from belt_sim.effects.base import Effect
from belt_sim.effects.pulley import LiftOff
from belt_sim.errors import InputError
from belt_sim.line import span as span_law
from belt_sim.line.hooks import as_indicated
from belt_sim.line.march import KEEP, MARCH_STEP, march_case
from belt_sim.line.spans import ALL_HOOKS, Composition


@dataclass(frozen=True, kw_only=True)
class AnalyticModel(Composition):
    """A linear span law marched in travel, differentiable in every number of a case and of an effect.

    step [m]: of the march; keep [m]: between two rows of curves.csv. Results are found from records that are no further
    apart than KEEP, so that a larger ``keep`` changes none.
    """

    step: float = MARCH_STEP
    keep: float = KEEP

    def run(
        self, case: Case, effects: Sequence[Effect] = (), *, travel: float, observers: Sequence[Observer] = ()
    ) -> Curves:
        """Return the curves over ``travel`` [m] as the instruments indicate them; observers see start and end.

        Effects on the drive change what is commanded, those of the belt and the pulleys the run itself, those of
        encoder and sensors what is read. Raises CannotRepresent, InputError, SimulationError.
        """
        self.admit(effects)
        for observer in observers:
            observer.start(case, travel)
        engine = partial(
            march_case, model=self, effects=effects, step=self.step, keep=min(self.keep, KEEP), driven=True
        )
        curves = as_indicated(engine, case, effects, travel)
        for observer in observers:
            observer.finish(curves)
        return curves


_NO_SPAN = ALL_HOOKS - {"span"}
_LIMP = ALL_HOOKS - {"span", "hold", "bend", "runup", "slide"}
_STRIP = AnalyticModel(name="strip", title="hanging strip", span=span_law.strip, contains=frozenset({"sag_roll"}))
_LIFTED: dict[str, Any] = {"contains": frozenset({"sag_roll", "lift_off"}), "built_in": (LiftOff(strength=1.0),)}

MODELS: dict[str, AnalyticModel] = {
    m.name: m
    for m in (
        AnalyticModel(name="rope", title="limp rope", span=span_law.rope, hooks=_LIMP, moments=False),
        AnalyticModel(name="beam_th1", title="beam, 1st order", span=span_law.beam_first_order, hooks=_NO_SPAN),
        AnalyticModel(name="beam_th2", title="beam, 2nd order", span=span_law.beam_second_order),
        AnalyticModel(name="ernst_beam", title="beam with Ernst's modulus", span=span_law.ernst_beam, hooks=_NO_SPAN),
        _STRIP,
        replace(_STRIP, name="strip_lift_off", title="hanging strip that lifts off", **_LIFTED),
    )
}
#: what a diagnosis holds its own model against
BASE_MODELS = ("beam_th1", "beam_th2", "strip", "strip_lift_off")


def analytic_model(name: str) -> AnalyticModel:
    """Return the analytic model of a name; raise InputError for an unknown one."""
    if name not in MODELS:
        raise InputError("model", name, "", f"use one of {', '.join(MODELS)}")
    return MODELS[name]


ModelName = Literal[
    "rope", "beam_th1", "beam_th2", "ritzinger", "ernst_beam", "strip", "strip_lift_off",
    "mujoco_rope", "mujoco_grid", "mujoco_flex",
]  # fmt: skip
MODEL_NAMES: tuple[str, ...] = get_args(ModelName)
IN_SPACE = {"mujoco_rope": "rope", "mujoco_grid": "grid", "mujoco_flex": "flex"}
ANALYTIC = tuple(name for name in MODEL_NAMES if name not in IN_SPACE)
#: the model that is chosen by how slack the belt is that is simulated or measured
BY_TENSION = "by_tension"
