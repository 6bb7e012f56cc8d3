"""The page of sliders: tension, yaw, travel, machine, model and effects; curves at once."""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from nicegui import run, ui

from belt_sim.api.simulate import simulate
from belt_sim.app import widgets
from belt_sim.app.widgets import labelled_slider
from belt_sim.effects.base import Parameter, library, title_of
from belt_sim.errors import BeltError
from belt_sim.model import ANALYTIC, model_named
from belt_sim.results.simulation import Simulation
from belt_sim.results.words import NONE, decimal, thousandths
from belt_sim.settings import make_case
from belt_sim.units import N_PER_MM2

# What the sliders ask for: one march over the longest travel, of which a shorter one is the start.

LONGEST = 200.0  # [m]
MODELS = tuple(name for name in ANALYTIC if name != "ritzinger")  # those that have curves
SCALES = 10.0  # how far a slider of an effect reaches, in scales of its parameter


def simulate_sliders(
    *, model: str, tension: float, yaw: float, travel: float, effects: Mapping[str, Mapping[str, float]], **machine: Any
) -> Simulation:
    """The simulation; raises InputError, CannotRepresent, SimulationError.

    tension [N/mm2], yaw [degrees], travel [m]; effects: id -> parameter -> number; machine: rig and belt, as names or
    numbers.
    """
    case = make_case(tension=tension, yaw=yaw, **machine)
    acting = [library()[effect](**numbers) for effect, numbers in effects.items()]  # a size of nothing is allowed here
    whole = simulate(case, model=model, effects=acting, travel=LONGEST)
    curves = whole.curves
    assert curves is not None
    keep = np.asarray(curves.travel) <= travel + 1e-9
    along = ("travel", "y", "angle", "moment", "edge_stress", "tilt")
    cut = {n: np.asarray(getattr(curves, n))[..., keep] for n in along if getattr(curves, n) is not None}
    return replace(whole, travel=travel, curves=replace(curves, **cut, extra=None))


def choices(model: str) -> dict[str, str]:
    """Effects that a model can have: id -> words."""
    chosen = model_named(model)
    return {i: effect_title(i) for i, cls in library().items() if chosen.refusal(cls) is None}


def effect_title(effect_id: str) -> str:
    return title_of(library()[effect_id])


def reach(p: Parameter) -> tuple[float, float, float]:
    """Lowest and highest value of a parameter's slider, and where it starts."""
    low, high = (max(p.plausible[0], -SCALES * p.scale), min(p.plausible[1], SCALES * p.scale))
    return low, high, min(max(p.null if p.modifier else p.scale, low), high)


def warnings(simulation: Simulation) -> list[str]:
    """Everything to beware of, a sentence each: a slack edge, limits of the model's validity."""
    slack = [line for line in simulation.lines() if "edge goes slack" in line]
    return [*slack, *(f"{x.words} ({x.exceeded_by})" for x in simulation.beyond)]


RIGS = {"test_rig": "the paper's test rig", "rope_example": "the paper's rope example", "own": "my machine"}
OWN = {  # name: (words, value, unit, SI per unit)
    "centre_distance": ("distance of the pulleys", 11.28, "m", 1.0),
    "pulley_radius": ("pulley radius", 0.17, "m", 1.0),
    "width": ("belt width", 200.0, "mm", 1e-3),
    "thickness": ("belt thickness", 0.3, "mm", 1e-3),
    "youngs_modulus": ("Young's modulus", 210.0, "GPa", 1e9),
    "density": ("density", 7850.0, "kg/m³", 1.0),
}
LONG = 0.4  # [s] after which it is shown that something is being computed
OF_RIG = ("centre_distance", "pulley_radius")
TITLES = {name: f"{name}: {model_named(name).title}" for name in MODELS}  # type: ignore[union-attr]


@dataclass
class View:
    """Settings of one tab, and the places where the answer is shown."""

    model: str = "strip"
    beside: str = ""
    rig: str = "test_rig"
    tension: float = 10.0
    yaw: float = -0.042
    travel: float = 60.0
    own_numbers: dict[str, float] = field(default_factory=lambda: {n: v for n, (_, v, _, _) in OWN.items()})
    effects: dict[str, dict[str, float]] = field(default_factory=dict)
    places: dict[str, Any] = field(default_factory=dict)
    is_stale: bool = False
    busy: bool = False

    def settings_for(self, model: str) -> dict[str, Any]:
        """What the sliders say, for a model; effects that it cannot have are left out."""
        there = choices(model)
        machine: dict[str, Any] = {}
        if self.rig == "own":
            si = {n: self.own_numbers[n] * OWN[n][3] for n in OWN}
            machine["rig"] = {n: v for n, v in si.items() if n in OF_RIG} | {"gravity": 9.81}
            machine["belt"] = {n: v for n, v in si.items() if n not in OF_RIG} | {"poisson_ratio": 0.3}
        else:
            machine["rig"] = self.rig
        effects = {i: numbers for i, numbers in self.effects.items() if i in there}
        sliders = {"tension": self.tension, "yaw": self.yaw, "travel": self.travel}
        return {"model": model, "effects": effects, **sliders, **machine}


def add() -> None:
    @ui.page("/", title="belt_sim")
    def page() -> None:
        view = View()
        widgets.frame("/")
        with ui.element("div").classes("split"):
            with ui.element("div").classes("set"):
                _sliders(view)
            with ui.element("div").classes("curve"):
                _answers(view)
            with ui.element("div").classes("more"):
                _choices(view)
        ui.timer(0.05, lambda: _compute(view), once=True)


def _sliders(view: View) -> None:
    def setting(name: str, label: str, low: float, high: float, step: float) -> None:
        async def move(value: float) -> None:
            setattr(view, name, value)
            await _compute(view)

        labelled_slider(label, getattr(view, name), low, high, step, move, mark=name)

    with widgets.card("What is set"):
        setting("tension", "tension [N/mm²]", 2.0, 80.0, 0.5)
        setting("yaw", "yaw of the tail pulley [degrees]", -0.2, 0.2, 0.002)
        setting("travel", "belt travel [m]", 5.0, LONGEST, 1.0)


def _choices(view: View) -> None:
    def pick(name: str, label: str, options: dict[str, str]) -> ui.select:
        async def choose(event: Any) -> None:
            setattr(view, name, event.value)
            await _compute(view)

        chooser = ui.select(options, value=getattr(view, name), label=label, on_change=choose)
        return chooser.classes("w-full").props(f"data-name={name}")

    with widgets.card("Model and machine"):
        pick("model", "model", TITLES)
        pick("beside", "beside it, dotted", {"": "none"} | TITLES)
        rig = pick("rig", "machine", RIGS)
        with ui.element("div").classes("w-full").bind_visibility_from(rig, "value", value="own"):
            _own_machine(view)
    with widgets.card("What may be wrong", "Add an effect and move its size."):
        _effects(view)


def _own_machine(view: View) -> None:
    for name, (label, value, unit, _) in OWN.items():

        async def move(event: Any, name: str = name) -> None:
            if event.value is not None:
                view.own_numbers[name] = float(event.value)
                await _compute(view)

        ui.number(f"{label} [{unit}]", value=value, on_change=move).props("dense debounce=400").classes("w-full")


def _effects(view: View) -> None:
    """A list of effects, and a slider for each number of those chosen."""
    names = {i: effect_title(i) for i in sorted(library(), key=effect_title)}

    async def choose(event: Any) -> None:
        view.effects = {i: view.effects.get(i) or _start(i) for i in event.value}
        sizes.refresh()
        await _compute(view)

    @ui.refreshable
    def sizes() -> None:
        for effect_id, numbers in view.effects.items():
            ui.label(effect_title(effect_id)).classes("small")
            for name, p in library()[effect_id].parameters.items():

                async def move(value: float, numbers: dict[str, float] = numbers, name: str = name) -> None:
                    numbers[name] = value
                    await _compute(view)

                low, high, _ = reach(p)
                unit = f" [{p.unit}]" if p.unit != "1" else ""
                step = (high - low) / 200.0
                labelled_slider(f"{p.meaning}{unit}", numbers[name], low, high, step, move, mark=f"{effect_id}.{name}")

    select = ui.select(names, multiple=True, with_input=True, label="effects", value=[], on_change=choose)
    select.props("use-chips").classes("w-full").props("data-name=effects")
    sizes()


def _start(effect_id: str) -> dict[str, float]:
    return {n: reach(p)[2] for n, p in library()[effect_id].parameters.items()}


def _answers(view: View) -> None:
    with widgets.card("Where the belt runs"):
        view.places["curves"] = ui.plotly(widgets.figure([], "", "", 420)).props("data-name=curves")
        busy = ui.linear_progress(show_value=False, size="4px").props("indeterminate aria-label='computing'")
        busy.set_visibility(False)
        view.places["busy"] = busy
        view.places["said"] = ui.element("div").classes("card-lines").props("data-name=said")
        view.places["facts"] = ui.element("div").classes("w-full").props("data-name=facts")
        ui.label("Late rates of points 1-4: over the last fifth of the travel shown.").classes("soft small")
    with widgets.card("How slack its edges become") as below:
        view.places["edges"] = ui.plotly(widgets.figure([], "", "", 240))
    view.places["edges_card"] = below


async def _compute(view: View) -> None:
    """Show what the sliders say; while one computation runs, only the latest wish is kept."""
    view.is_stale = True
    if view.busy:
        return
    view.busy = True
    try:
        while view.is_stale:
            view.is_stale = False
            try:
                shown = await _simulate(view, view.model)
                beside = await _simulate(view, view.beside) if view.beside else None
            except BeltError as error:
                _say(view, str(error).splitlines(), [])
            else:
                if shown is not None:  # None: the server is being closed
                    _show(view, shown, beside)
            await asyncio.sleep(0.03)
    finally:
        view.busy = False


async def _simulate(view: View, model: str) -> Simulation | None:
    """Computed beside the page; what takes long, as a model that is compiled for the first time, is seen to go on."""
    work = asyncio.ensure_future(run.io_bound(simulate_sliders, **view.settings_for(model)))
    await asyncio.wait({work}, timeout=LONG)
    view.places["busy"].set_visibility(not work.done())
    try:
        return await work
    finally:
        view.places["busy"].set_visibility(False)


def _show(view: View, shown: Simulation, beside: Simulation | None) -> None:
    places = view.places
    places["curves"].update_figure(widgets.lateral(shown, beside))
    slacker = widgets.edges(shown)
    places["edges_card"].set_visibility(slacker is not None)
    if slacker is not None:
        places["edges"].update_figure(slacker)
    places["facts"].clear()
    with places["facts"]:
        widgets.facts(_facts(shown))
    left_out = [effect_title(i) for i in view.effects if i not in choices(view.model)]
    calm = [f"{view.model} cannot have this effect: {name}" for name in left_out]
    _say(view, warnings(shown), calm)


def _facts(s: Simulation) -> dict[str, str]:
    found = {f"late rate {k} [mm/m]": thousandths(rate) for k, rate in enumerate(s.rates, start=1)}
    if s.steady_rate is not None:
        found["steady rate [mm/m]"] = thousandths(s.steady_rate)
    upper, lower = s.offsets or (None, None)
    found |= {"y1 − y4 [mm]": thousandths(upper), "y3 − y2 [mm]": thousandths(lower), "sag [mm]": thousandths(s.sag)}
    slackest = s.slackest_edge
    found["slackest edge [N/mm²]"] = NONE if slackest is None else decimal(slackest / N_PER_MM2, 1)
    return found


def _say(view: View, warned: list[str], calm: list[str]) -> None:
    view.places["said"].clear()
    with view.places["said"]:
        for line in warned:
            widgets.notice(line)
        for line in calm:
            widgets.notice(line, "calm")
