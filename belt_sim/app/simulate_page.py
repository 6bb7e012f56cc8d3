"""The page of sliders: settings, machine, model and effects; curves at once. The address holds the settings."""

import asyncio
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import urlencode

import numpy as np
from nicegui import run, ui

from belt_sim.api.plot import plot
from belt_sim.api.simulate import model_named, model_of, simulate
from belt_sim.app import widgets
from belt_sim.app.widgets import box, soft
from belt_sim.case import Case
from belt_sim.effects.base import Parameter, library, title_of
from belt_sim.errors import BeltError
from belt_sim.model import ANALYTIC, BY_TENSION
from belt_sim.results.estimates import MachineSizes, display_unit
from belt_sim.results.simulation import Simulation
from belt_sim.results.words import KILO, NO_NUMBER, capital, decimal, thousandths
from belt_sim.settings import make_case
from belt_sim.show.style import SHORT_POINT_NAMES
from belt_sim.show.terminal import REASONS
from belt_sim.units import N_PER_MM2

#: of the models that have curves
MODEL_TITLES = {name: f"{name}: {model_named(name).title}" for name in ANALYTIC if name != "ritzinger"}  # type: ignore[union-attr]
SLIDER_SCALES = 10.0  # how far a slider of an effect reaches, in scales of its parameter
MOST_NUMBERS = 6  # numbers of an effect that have a slider; an edge profile has eighty
#: name -> words, value at first, lowest and highest value, step
SLIDERS = {
    "tension": ("tension [N/mm²]", 10.0, 2.0, 80.0, 0.5),
    "yaw": ("yaw of the tail pulley [degrees]", -0.042, -0.2, 0.2, 0.002),
    "travel": ("belt travel [m]", 60.0, 5.0, 200.0, 1.0),
}
#: name -> words, what can be chosen, the first one at first
MENUS = {
    "model": ("model", {BY_TENSION: "by tension, as on the command line"} | MODEL_TITLES),
    "rig": ("machine", {"test_rig": "the paper's test rig", "rope_example": "the paper's rope example",
                        "own": "my machine"}),
}  # fmt: skip
#: size of a machine of one's own -> words, value at first, where it stands, SI per unit of the page
OWN_SIZES = {
    "centre_distance": ("distance of the pulleys [m]", 11.28, "rig", 1.0),
    "pulley_radius": ("pulley radius [m]", 0.17, "rig", 1.0),
    "width": ("belt width [mm]", 200.0, "belt", 1e-3),
    "thickness": ("belt thickness [mm]", 0.3, "belt", 1e-3),
    "youngs_modulus": ("Young's modulus [GPa]", 210.0, "belt", 1e9),
    "density": ("density [kg/m³]", 7850.0, "belt", 1.0),
}
#: settings of a new page
AT_FIRST: dict[str, Any] = {name: first for name, (_, first, *_) in (SLIDERS | OWN_SIZES).items()}
AT_FIRST |= {name: next(iter(known)) for name, (_, known) in MENUS.items()}


def reach(p: Parameter) -> tuple[float, float, float]:
    """Lowest and highest value of a parameter's slider, and where it starts."""
    low, high = (max(p.plausible[0], -SLIDER_SCALES * p.scale), min(p.plausible[1], SLIDER_SCALES * p.scale))
    return low, high, min(max(p.null if p.modifier else p.scale, low), high)


def warnings(simulation: Simulation) -> list[str]:
    """Everything to beware of, a sentence each: a slack edge, limits of the model's validity."""
    slack = [line for line in simulation.lines() if "edge goes slack" in line]
    return [*slack, *(f"{x.sentence} ({x.exceeded_by})" for x in simulation.beyond)]


@dataclass
class View:
    """Settings of one tab by their names in its address, effects by id, where the answer is shown, and the answer."""

    values: dict[str, Any] = field(default_factory=lambda: dict(AT_FIRST))
    effects: dict[str, dict[str, float]] = field(default_factory=dict)
    places: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    shown: Simulation | None = None
    is_stale: bool = False
    busy: bool = False

    @classmethod
    def of_address(cls, asked: Mapping[str, str]) -> "View":
        """The view that an address names; what it states wrongly is as at first, or at the end of its slider, and
        ``notes`` say so."""
        view = cls()
        for name, text in asked.items():
            effect, _, parameter = name.partition(".")
            known, kept = library()[effect].parameters if parameter and effect in library() else {}, "it is left out"
            if name in MENUS:
                wanted = "" if text in MENUS[name][1] else f"must be one of {', '.join(filter(None, MENUS[name][1]))}"
                view.values[name] = view.values[name] if wanted else text
            elif name in view.values or parameter in known:
                low, high = reach(known[parameter])[:2] if parameter else SLIDERS.get(name, ("", 0.0, 0.0, 1e6))[2:4]
                own, key = view.values, name
                if parameter:
                    start = {n: reach(p)[2] for n, p in known.items()}
                    own, key = view.effects.setdefault(effect, start), parameter
                try:
                    value = float(text)
                except ValueError:
                    value = math.nan
                own[key] = own[key] if math.isnan(value) else min(max(value, low), high) + 0.0
                wanted = "" if own[key] == value else f"must be a number from {low:g} to {high:g}"
                kept = f"{own[key]:g} is shown"
            else:
                wanted = "is no setting of this page; give such as tension=10, width=300 or taper.kappa_t=2e-5"
            if wanted:
                view.notes.append(f"The address says {name}={text}: {wanted}; {kept}.")
        return view

    @property
    def address(self) -> str:
        """The address that names this view: what differs from a new one, and all numbers of effects."""
        asked = {name: value for name, value in self.values.items() if value != AT_FIRST[name]}
        asked |= {f"{i}.{n}": value for i, numbers in self.effects.items() for n, value in numbers.items()}
        said = {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in asked.items()}
        return f"/?{urlencode(said)}" if said else "/"

    def case(self) -> Case:
        """The case of these settings; raises BeltError."""
        machine: dict[str, Any] = {"rig": self.values["rig"]}
        if self.values["rig"] == "own":
            machine = {"rig": {"gravity": 9.81}, "belt": {"poisson_ratio": 0.3}}
            for name, (_, _, part, factor) in OWN_SIZES.items():
                machine[part][name] = self.values[name] * factor
        return make_case(tension=self.values["tension"], yaw=self.values["yaw"], **machine)

    async def change(self) -> None:
        """Show what the settings come to; while one computation runs, only the latest wish is kept."""
        self.is_stale = True
        if self.busy:
            return
        self.busy = True
        try:
            while self.is_stale:
                self.is_stale = False
                try:
                    case = self.case()
                    model = model_of(self.values["model"], [case], [*self.effects]).name
                    acting = [library()[i](**numbers) for i, numbers in self.effects.items()]  # a size may be nothing
                    asked: dict[str, Any] = {"travel": self.values["travel"]}
                    asked["effects"] = [e for e in acting if model_named(model).refusal(e) is None]
                    shown = await run.io_bound(simulate, case, model=model, **asked)
                except BeltError as error:
                    self.say(str(error).splitlines(), [])
                else:
                    if shown is not None:  # None: the server is being closed
                        self.show(shown)
                await asyncio.sleep(0.03)
            ui.navigate.history.replace(self.address)
        finally:
            self.busy = False

    def show(self, s: Simulation) -> None:
        """Curves, warnings and numbers of a simulation."""
        assert s.curves is not None
        places, self.shown, curves = self.places, s, s.curves
        points = zip(KILO * np.asarray(curves.y), SHORT_POINT_NAMES, widgets.PLOT_COLOURS, strict=True)
        data = [widgets.line(curves.travel, y, name, colour) for y, name, colour in points]
        places["curves"].update_figure(widgets.chart(data, "lateral position [mm]", 420))
        found = {f"late rate {k} [mm/m]": thousandths(rate) for k, rate in enumerate(s.rates, start=1)}
        if s.steady_rate is not None:
            found["steady rate [mm/m]"] = thousandths(s.steady_rate)
        upper, lower = s.offsets or (None, None)
        found |= {"y1 − y4 [mm]": thousandths(upper), "y3 − y2 [mm]": thousandths(lower)}
        found["sag [mm]"] = thousandths(s.sag)
        slackest = s.slackest_edge
        found["slackest edge [N/mm²]"] = NO_NUMBER if slackest is None else decimal(slackest / N_PER_MM2, 1)
        places["facts"].clear()
        with places["facts"]:
            widgets.facts(found)
        places["downloads"].set_visibility(True)
        refused = [i for i in self.effects if model_named(s.model).refusal(library()[i]) is not None]
        calm = [f"{s.model} cannot have this effect: {title_of(library()[i])}" for i in refused]
        if self.values["model"] == BY_TENSION:
            calm.append(f"Model {s.model}, as {REASONS[s.model]}.")
        self.say(warnings(s), [*calm, *(capital(line) for line in s.lines() if line.startswith("not settled"))])

    def say(self, warned: list[str], calm: list[str]) -> None:
        """Lines below the curves; what is to be said of the address is said once."""
        self.places["said"].clear()
        with self.places["said"]:
            for line in warned:
                widgets.notice(capital(line))
            for line in [*calm, *self.notes]:
                widgets.notice(line, "calm")
        self.notes = []


@ui.page("/", title="belt_sim")
def sliders_page() -> None:
    """Settings, the curves that they come to, and what may be wrong."""
    request = ui.context.client.request
    view = View.of_address(request.query_params if request else {})
    places = view.places

    async def picture() -> None:
        assert view.shown is not None
        with TemporaryDirectory() as folder:
            await run.io_bound(plot, view.shown, f"{folder}/belt.png")
            ui.download.content(Path(folder, "belt.png").read_bytes(), "belt.png")

    def numbers() -> None:
        assert view.shown is not None
        ui.download.content(view.shown.to_pandas().to_csv(index=False), "belt.csv")

    widgets.frame("/")
    with box("split"):
        with box("set"), widgets.card("What is set"):
            for name, (label, _, low, high, step) in SLIDERS.items():
                widgets.labelled_slider(label, view.values, name, (low, high), view.change, mark=name, step=step)
        with box("curve"), widgets.card("Where the belt runs"):
            # the answer, to be filled, with its downloads
            places["curves"] = ui.plotly(widgets.chart([], "", 420)).props("data-name=curves")
            bar = ui.linear_progress(show_value=False, size="4px").props("indeterminate aria-label='computing'")
            bar.classes("late").bind_visibility_from(view, "busy")  # what takes long is seen to go on
            places["said"] = box("card-lines")
            places["facts"] = box("w-full").props("data-name=facts")
            soft("Late rates of points 1-4: over the last fifth of the travel shown.")
            with box("line") as places["downloads"]:
                for name, take in (("CSV", numbers), ("PNG", picture)):
                    widgets.quiet_button(name, take).props("icon=download")
                soft("The address of this page keeps all settings.")
            places["downloads"].set_visibility(False)
        with box("more"):
            _choices(view)
    ui.timer(0.05, view.change, once=True)


def _choices(view: View) -> None:
    """Model, machine, and effects with a slider for each of their numbers, in units of the shop."""

    async def take(event: Any, name: str) -> None:
        if event.value is not None:
            view.values[name] = event.value
            await view.change()

    with widgets.card("Model and machine"):
        for name, (label, options) in MENUS.items():
            menu = ui.select(options, value=view.values[name], label=label, on_change=partial(take, name=name))
            menu.classes("w-full").props(f"data-name={name}")
        with box("w-full").bind_visibility_from(menu, "value", value="own"):
            for name, (label, *_) in OWN_SIZES.items():
                number = ui.number(label, value=view.values[name], on_change=partial(take, name=name))
                number.props("dense debounce=400").classes("w-full")
    with widgets.card("What may be wrong", "Add an effect and move its size."):

        @ui.refreshable
        def sizes() -> None:
            case = view.case()
            sizes_of = {name: getattr(case.rig, name) for name in ("centre_distance", "tail_radius", "head_radius")}
            machine = MachineSizes(**sizes_of, width=case.belt.width, span_length=float(case.rig.span_length))
            for effect_id, numbers in view.effects.items():
                ui.label(title_of(library()[effect_id])).classes("small")
                for name, p in [*library()[effect_id].parameters.items()][:MOST_NUMBERS]:
                    factor, unit = display_unit(effect_id, name, p.unit, machine)
                    label, mark = f"{p.meaning} [{unit}]" if unit else p.meaning, f"{effect_id}.{name}"
                    widgets.labelled_slider(label, numbers, name, reach(p)[:2], view.change, mark=mark, shown=factor)

        async def choose(ids: list[str]) -> None:
            view.effects = {i: numbers for i, numbers in view.effects.items() if i in ids}
            for i in (i for i in ids if i not in view.effects):
                view.effects[i] = {n: reach(p)[2] for n, p in library()[i].parameters.items()}
            sizes.refresh()
            await view.change()

        sizes()
        widgets.effect_list("find an effect", view.effects, choose)
