"""What to ask of a campaign: a model, effects, a comparison or a diagnosis."""

from nicegui import ui

from belt_sim.app import look
from belt_sim.app.desk import Desk
from belt_sim.app.pages.simulate import TITLES
from belt_sim.app.sliders import words
from belt_sim.effects.library import library
from belt_sim.errors import BeltError
from belt_sim.use_cases.diagnose import MIN_BOOTSTRAPS


def asking(desk: Desk) -> None:
    """The card of questions; nothing without a campaign."""
    if desk.campaign is None or desk.importing is not None:
        return
    busy = desk.job is not None and desk.job.running
    with look.card("3. Ask", "Compare shows where a model fails; diagnose finds which physical effect it lacks."):
        ui.select(TITLES, label="model").bind_value(desk.asked, "model").classes("w-full").props("data-name=model")
        _effects_on_the_desk(desk)
        with ui.expansion("More about the diagnosis").classes("w-full"):
            names = {i: words(i) for i in sorted(library(), key=words)}
            which = "effects to try (none chosen: all that can be told)"
            tried = ui.select(names, multiple=True, with_input=True, label=which).props("use-chips")
            tried.bind_value(desk.asked, "candidates").classes("w-full").props("data-name=candidates")
            count = ui.number("synthetic repeats to tell chance by", min=MIN_BOOTSTRAPS, precision=0)
            count.bind_value(desk.asked, "bootstraps").classes("w-full").props("data-name=bootstraps")
        with ui.element("div").classes("line"):
            ui.button("Compare", on_click=lambda: _start(desk, "compare")).props("no-caps outline").set_enabled(
                not busy
            )
            ui.button("Diagnose", on_click=lambda: _start(desk, "diagnose")).props("no-caps").set_enabled(not busy)


def _effects_on_the_desk(desk: Desk) -> None:
    if not desk.effects:
        return
    names = ", ".join(str(e["id"]) for e in desk.effects)
    with ui.element("div").classes("line"):
        ui.label(f"Compare uses the effects of {desk.effects_name}: {names}")
        ui.button("Without them", on_click=desk.forget_effects).props("flat no-caps dense")


def _start(desk: Desk, task: str) -> None:
    model = str(desk.asked["model"])
    try:
        if task == "compare":
            desk.start(task, model, effects=desk.effects or None)
            return
        count = int(desk.asked["bootstraps"] or 0)
        desk.start(task, model, total=count, effects=desk.asked["candidates"] or None, bootstraps=count, seed=0)
    except BeltError as error:
        desk.changed(*str(error).splitlines())
