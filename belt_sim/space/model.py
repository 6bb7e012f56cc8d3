"""The belt in three dimensions as a model: which effects it can show, and its runs as the instruments see them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.curves import Curves, Observer
from belt_sim.effects.base import Effect
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.line.hooks import IN_MARCH, as_indicated, call_hook, overrides
from belt_sim.scene_parts import SceneParts
from belt_sim.space.options import BELTS, CONTACTS, ENGINES, OBEYED, WATCHED, Options, fit_options, refuse_unobeyed
from belt_sim.units import N_PER_MM2, two_digits
from belt_sim.validity import limits

if TYPE_CHECKING:
    from belt_sim.space.run import BatchEngine, Computed

#: engines on JAX, which run many cases at once: in time by MuJoCo MJX; without inertia
BATCH_ENGINES = tuple(name for name in ENGINES if name != "native")
_TITLES = {"rope": "particle rope in 3D", "grid": "grid of bonded particles in 3D", "flex": "membrane belt in 3D"}
#: dt times the rate of the stiffest mode, at most: an explicit step bears no more, and what presses a line is explicit.
#: Runs broke off from 2.45 on
FOLDS = 2.0
#: of the tension, by which a line that is nearly slack may be pressed: with stations 8 mm apart one at 0.13 folded
_SLACKER = 0.2
_NO_OPTIONS = ("engine", "contact", "scene")  # settings that are fields of the model
_THROUGH_WIDTH = ("span", "hold", "runup", "slide")  # hooks of effects that act through it, which a rope does not have


@dataclass(frozen=True, kw_only=True)
class SpaceModel:
    """A 3D belt: "rope", "grid" or "flex".

    engine: "native" (MuJoCo, step by step in time), "mjx" (MuJoCo MJX, in time and in batches) or "quasi_static"
    (static equilibria in JAX, in batches); contact: one of CONTACTS; scene: the path of an MJCF or an MjSpec that is
    run instead of the case's own, carried by contacts.
    """

    belt: str = "flex"
    options: Options = field(default_factory=Options)
    engine: str = "native"
    contact: str = CONTACTS[0]
    scene: Any = None
    name: str = field(init=False, repr=False, compare=False)
    title: str = field(init=False, repr=False, compare=False)
    contains: frozenset[str] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name, given, known in (
            ("model.contact", self.contact, CONTACTS), ("engine", self.engine, ENGINES), ("belt", self.belt, BELTS)
        ):  # fmt: skip
            if given not in known:
                raise InputError(name, given, "", f"use {' or '.join(known)}")
        if self.scene is not None and self.contact == CONTACTS[0]:
            object.__setattr__(self, "contact", CONTACTS[1])
        # a belt with weight and width hangs, tilts and shears by itself
        contains = frozenset[str]() if self.belt == "rope" else frozenset({"sag_roll", "shear"})
        vars(self).update(name=f"mujoco_{self.belt}", title=_TITLES[self.belt], contains=contains)

    @staticmethod
    def from_settings(belt: str, settings: Mapping[str, Any]) -> "SpaceModel":
        """From the numbers of a configuration; raises InputError for one that is no option."""
        own = {name: settings[name] for name in _NO_OPTIONS if settings.get(name)}
        if "scene" in own and own.get("contact") == CONTACTS[0]:
            raise InputError("model.contact", CONTACTS[0], "", "leave it out: contacts carry the belt of model.scene")
        numbers = {name: value for name, value in settings.items() if name not in _NO_OPTIONS}
        return SpaceModel(belt=belt, options=Options.from_settings(numbers), **own)

    def refusal(self, effect: Effect | type[Effect]) -> str | None:
        """Why the 3D belt cannot show an effect; None when it can."""
        if effect.id in self.contains:
            return f"model {self.name} has {effect.id} built in already"
        in_scene = overrides(effect, ("scene",))
        if overrides(effect, IN_MARCH) and not in_scene:
            return "it has no geometry, so the 3D models refuse it"
        through = overrides(effect, _THROUGH_WIDTH) or effect.on_belt or effect.needs
        rope = self.belt == "rope" and in_scene and through
        return "it acts through the width or the moment of the belt, and a rope has neither" if rope else None

    def admit(self, effects: Sequence[Effect]) -> None:
        """Raise CannotRepresent for the first effect that the 3D belt cannot show, InputError for an option that its
        engine does not obey."""
        refuse_unobeyed(self.options, self.belt, self.engine, self.contact)
        for effect in effects:
            if reason := self.refusal(effect):
                raise CannotRepresent(f"effects = {effect.id}: {reason}; leave it out")

    def parts(self, case: Case, effects: Sequence[Effect]) -> SceneParts:
        """The scene of a case as the effects change it."""
        parts = SceneParts.from_case(case, self.options.friction)
        for effect in effects:
            parts = call_hook(effect, "scene", parts, case)
        return parts

    def options_for(self, case: Case) -> Options:
        """The options of a run of ``case`` as its engine takes them: with the belt speed and, in time, the step that a
        yaw step of the case bears.

        The yaw presses a line of nodes with P, by the strip law's entry moment (``validity``) and lines b / sqrt(12)
        from the middle, or by _SLACKER. The stiffest mode of such a line, a zigzag, has the eigenvalue -4 P / (m dx), m
        the mass of a node; its root times the step may be FOLDS. Raises InputError for such a ``model.dt``.
        """
        changes = [np.asarray(s.change)[np.asarray(s.over) <= 0.0] for s in (case.settings.yaw, case.settings.yaw_head)]
        step = max(np.abs(c).max(initial=0.0) for c in changes)
        tension, width = float(case.settings.tension), float(case.belt.width)
        beam = 4.0 * float(case.belt.bending_stiffness / case.rig.span_length) * step  # [N m], at most
        by = self.engine if self.contact == CONTACTS[0] else self.contact
        fitted = fit_options(self.options, case, self.belt, by)
        if "dt" not in OBEYED[by]:
            return replace(self.options, dt=None, belt_speed=fitted.belt_speed)
        held, least = by == self.engine and self.belt != "rope", (1.0 - _SLACKER) * math.sqrt(3.0)
        if not held or not step or 6.0 * beam / (float(case.tension_force) * width) < least:
            return fitted
        straight = replace(case.settings, yaw=Schedule.step(step), yaw_head=Schedule.step(0.0))
        load = next(limit.load for limit in limits(replace(case, settings=straight)) if limit.id == "slack_edge")
        pressure = tension * max(load / math.sqrt(3.0) - 1.0, _SLACKER)
        longest = two_digits(0.5 * FOLDS * self.options.dx * math.sqrt(float(case.belt.density) / pressure))
        if load < least or fitted.step <= longest:
            return fitted
        if self.options.dt is None:
            return fit_options(replace(self.options, dt=longest), case, self.belt, by)
        pressed = f"a yaw step may press an edge with {pressure / N_PER_MM2:.3g} N/mm2 and folds it"
        remedy = f"give at most {longest:.2g}: {pressed}; or make the yaw a ramp, or smaller"
        raise InputError("model.dt", self.options.dt, "s", remedy)

    def run(
        self, case: Case, effects: Sequence[Effect] = (), *, travel: float, observers: Sequence[Observer] = (),
        scene_path: Path | None = None, computed: "Computed | None" = None,
    ) -> Curves:  # fmt: skip
        """Curves over ``travel`` [m] as the instruments show them; raises SimulationError.

        scene_path: where to write the MJCF; computed: what a batch found for the case as driven: no engine runs.
        """
        self.admit(effects)

        def engine(driven: Case, *, travel: float) -> Curves:
            if computed is not None:
                return computed.replay(observers, driven, travel)
            own: dict[str, Any] = {"options": self.options_for(driven), "parts": self.parts(driven, effects)}
            own |= {"belt": self.belt, "travel": travel, "observers": observers}
            if self.engine not in BATCH_ENGINES:
                from belt_sim.space.native import run_native  # MuJoCo takes a while to load

                own |= {"scene_path": scene_path, "contact": self.contact}
                return run_native(driven, edited=self.scene, **own)
            wanted = {"watch": self.engine not in WATCHED and bool(observers)}
            wanted |= {f"model.contact = {self.contact}": self.contact != CONTACTS[0]}
            for name in (name for name, asked in wanted.items() if asked):
                raise CannotRepresent(f"{name}: engine={self.engine} cannot do this; use engine=native")
            return batch_engine(self.engine).simulate(driven, **own)

        return as_indicated(engine, case, effects, travel)


def batch_engine(name: str) -> "BatchEngine":
    engine: BatchEngine = getattr(import_module(f"belt_sim.space.{name}"), name.upper())  # loaded when it is used
    return engine
