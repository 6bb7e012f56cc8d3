"""The page of sliders: settings, machine, model and effects; curves at once. The address holds the settings."""

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any
from urllib.parse import urlencode

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
from belt_sim.results.words import NO_NUMBER, capital, decimal, thousandths
from belt_sim.settings import make_case
from belt_sim.show.terminal import REASONS
from belt_sim.units import N_PER_MM2

#: of the models that have curves
MODEL_TITLES = {name: f"{name}: {model_named(name).title}" for name in ANALYTIC if name != "ritzinger"}  # type: ignore[union-attr]
SLIDER_SCALES = 10.0  # how far a slider of an effect reaches, in scales of its parameter
CALM = ("Model", "not settled", "The address")  # beginnings of lines that warn of nothing
MOST_NUMBERS = 6  # numbers of an effect that have a slider; an edge profile has eighty
#: name -> words, value at first, lowest and highest, step; of a machine of one's own also its group, SI per unit
NUMBERS: dict[str, Any] = {
    "tension": ("tension [N/mm²]", 10.0, 2.0, 80.0, 0.5),
    "yaw": ("yaw of the tail pulley [degrees]", -0.042, -0.2, 0.2, 0.002),
    "travel": ("belt travel [m]", 60.0, 5.0, 200.0, 1.0),
    "centre_distance": ("distance of the pulleys [m]", 11.28, 1.0, 100.0, 0.1, "rig", 1.0),
    "pulley_radius": ("pulley radius [m]", 0.17, 0.02, 2.0, 0.01, "rig", 1.0),
    "width": ("belt width [mm]", 200.0, 5.0, 3000.0, 5.0, "belt", 1e-3),
    "thickness": ("belt thickness [mm]", 0.3, 0.02, 20.0, 0.01, "belt", 1e-3),
    "youngs_modulus": ("Young's modulus [GPa]", 210.0, 0.1, 400.0, 1.0, "belt", 1e9),
    "density": ("density [kg/m³]", 7850.0, 500.0, 20000.0, 10.0, "belt", 1.0),
}
OWN_SIZES = [name for name, row in NUMBERS.items() if len(row) > 5]
#: name -> words, what can be chosen, the first one at first
MENUS = {
    "model": ("model", {BY_TENSION: "by tension, as on the command line"} | MODEL_TITLES),
    "rig": ("machine", {"test_rig": "the paper's test rig", "rope_example": "its rope example", "own": "my machine"}),
}
#: settings of a new page
AT_FIRST: dict[str, Any] = {name: first for name, (_, first, *_) in NUMBERS.items()}
AT_FIRST |= {name: next(iter(known)) for name, (_, known) in MENUS.items()}


def reach(p: Parameter) -> tuple[float, float, float]:
    """Lowest and highest value of a parameter's slider, and where it starts."""
    low, high = (max(p.plausible[0], -SLIDER_SCALES * p.scale), min(p.plausible[1], SLIDER_SCALES * p.scale))
    return low, high, min(max(p.null if p.modifier else p.scale, low), high)


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
        """The view that an address names; what it states wrongly is left out, and ``notes`` say so."""
        view = cls()
        for name, text in asked.items():
            effect, _, parameter = name.partition(".")
            known = library()[effect].parameters if effect in library() else {}
            kept: Any = None
            if name in MENUS:
                wanted = f"must be one of {', '.join(MENUS[name][1])}"
                kept = text if text in MENUS[name][1] else None
            elif name in AT_FIRST or parameter in known:
                low, high = reach(known[parameter])[:2] if parameter else NUMBERS[name][2:4]
                wanted = f"must be a number from {low:g} to {high:g}"
                with suppress(ValueError):
                    kept = value if low <= (value := float(text)) <= high else None
            else:
                wanted = "is no setting of this page; give such as tension=10, width=300 or taper.kappa_t=2e-5"
            if kept is None:
                view.notes.append(f"The address says {name}={text}: {wanted}; it is left out.")
            elif parameter:
                start = {n: reach(p)[2] for n, p in known.items()}
                view.effects.setdefault(effect, start)[parameter] = kept
            else:
                view.values[name] = kept
        return view

    @property
    def address(self) -> str:
        """The address that names this view: what differs from a new one, and all numbers of effects."""
        asked = {name: value for name, value in self.values.items() if value != AT_FIRST[name]}
        asked |= {f"{i}.{n}": value for i, numbers in self.effects.items() for n, value in numbers.items()}
        return f"/?{urlencode(asked)}" if asked else "/"

    def case(self) -> Case:
        """The case of these settings; raises BeltError."""
        machine: dict[str, Any] = {"rig": self.values["rig"]}
        if self.values["rig"] == "own":
            machine = {"rig": {"gravity": 9.81}, "belt": {"poisson_ratio": 0.3}}
            for name in OWN_SIZES:
                *_, part, factor = NUMBERS[name]
                machine[part][name] = self.values[name] * factor
        return make_case(tension=self.values["tension"], yaw=self.values["yaw"], **machine)

    def slider(self, name: str) -> None:
        """The slider of one of the ``NUMBERS``."""
        label, _, low, high, step, *_ = NUMBERS[name]
        widgets.labelled_slider(label, self.values, name, (low, high), self.change, mark=name, step=step)

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
                    asked: dict[str, Any] = {"travel": self.values["travel"], "effects": acting}
                    shown = await run.io_bound(simulate, case, model=model, **asked)
                    curves = await run.io_bound(widgets.page_picture, shown)
                    if shown is not None and curves is not None:  # None: the server is being closed
                        self.show(shown, curves)
                except BeltError as error:
                    self.say(*str(error).splitlines())
                await asyncio.sleep(0.03)
            ui.navigate.history.replace(self.address)
        finally:
            self.busy = False

    def show(self, s: Simulation, curves: str) -> None:
        """Curves, warnings and numbers of a simulation."""
        places, self.shown = self.places, s
        places["curves"].set_content(curves)
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
        chosen = [f"Model {s.model}, as {REASONS[s.model]}."] if self.values["model"] == BY_TENSION else []
        self.say(*s.lines()[1:], *chosen)

    def say(self, *lines: str) -> None:
        """Lines below the curves, and of the address what is wrong with it."""
        self.places["said"].clear()
        with self.places["said"]:
            for line in (*lines, *self.notes):
                widgets.notice(capital(line), "calm" if line.startswith(CALM) else "")


@ui.page("/", title="belt_sim: Simulate")
def sliders_page() -> None:
    """Settings, the curves that they come to, and what may be wrong."""
    request = ui.context.client.request
    view = View.of_address(request.query_params if request else {})
    places = view.places

    def take(ending: str) -> None:
        assert view.shown is not None
        png = ending == "png"
        with widgets.ONE_PICTURE:
            content = plot(view.shown)._repr_png_() if png else view.shown.to_pandas().to_csv(index=False)
        ui.download.content(content, f"belt.{ending}")

    widgets.frame("/")
    with box("split"):
        with box("set"), widgets.card("What is set"):
            for name in ("tension", "yaw", "travel"):
                view.slider(name)
        with box("curve"), widgets.card("Where the belt runs"):
            # the answer, to be filled, with its downloads
            places["curves"] = ui.html("", sanitize=False).classes("w-full").props("data-name=curves")
            bar = ui.linear_progress(show_value=False, size="4px").props("indeterminate aria-label='computing'")
            bar.classes("late").bind_visibility_from(view, "busy")  # what takes long is seen to go on
            places["said"] = box("card-lines")
            places["facts"] = box("w-full").props("data-name=facts")
            with box("line") as places["downloads"]:
                for name in ("CSV", "PNG"):
                    widgets.quiet_button(name, partial(take, name.lower())).props("icon=download")
                soft("The address of this page keeps all settings.")
            places["downloads"].set_visibility(False)
        with box("more"):
            _choices(view)
    ui.timer(0.05, view.change, once=True)


def _choices(view: View) -> None:
    """Model, machine, and effects with a slider for each of their numbers, in units of the shop."""
    with widgets.card("Model and machine"):
        for name, (label, options) in MENUS.items():
            menu = ui.select(options, value=view.values[name], label=label, on_change=view.change)
            menu.bind_value_to(view.values, name).classes("w-full").props(f"data-name={name}")
        with box("w-full").bind_visibility_from(menu, "value", value="own"):
            for name in OWN_SIZES:
                view.slider(name)
    with widgets.card("What may be wrong", "Add an effect and move its size."):

        @ui.refreshable
        def sizes() -> None:
            try:
                case = view.case()
            except BeltError:  # sizes that cannot be, as the picture's place says: units as on the test rig
                case = make_case()
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
