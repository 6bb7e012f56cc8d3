"""What a logger's files seem to say: columns, questions and runs, all of which may be corrected."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from nicegui import run, ui

from belt_sim.app import widgets
from belt_sim.app.import_session import GROUPS, OF_RUN, Import, Place
from belt_sim.app.pages.campaign_view import curves
from belt_sim.app.session import Session
from belt_sim.campaign.types import PLACES
from belt_sim.importing.types import ROLES
from belt_sim.reports.importing import noise_table, runs_table
from belt_sim.results.display import Table

NUMBERS = "numbers of my own"
POINTS = (
    "Points 1 and 2: upper and lower end at the tail pulley, the one that yaws; "
    "3 and 4: lower and upper end at the head pulley."
)
WHERE = {"": "–"} | {p: p.replace("_", " ") for p in PLACES}
EXAMPLES = {"tension": "10 N/mm2", "yaw": "-0.042 deg", "speed": "0.5 m/s", "direction": "1", "yaw_at": "0 m"}


@dataclass
class AnswerForm:
    """Fields of the card: place in the mapping -> how to read it, and what it showed; sent together."""

    fields: dict[Place, tuple[Callable[[], Any], str]] = field(default_factory=dict)

    def changed(self) -> dict[Place, Any]:
        """What somebody wrote or chose since the card was drawn."""
        said = {place: value() or "" for place, (value, _) in self.fields.items()}
        return {place: text for place, text in said.items() if text != self.fields[place][1]}

    def select(self, place: Place, options: dict[str, str], value: str, label: str | None = None) -> None:
        """A choice."""
        shown = options if value in options else {value: value} | options
        made = ui.select(shown, value=value, label=label).props(f"dense data-name='{_name(place)}'").classes("w-full")
        self.fields[place] = lambda: made.value, value

    def input(self, place: Place, value: str, example: str, shown: str | None = None) -> None:
        """A line of text; ``shown``: what stands there at first without being an answer yet."""
        made = ui.input(value=value if shown is None else shown, placeholder=example)
        made.props(f"dense outlined hide-bottom-space data-name='{_name(place)}' aria-label='{_name(place)}'")
        made.classes("w-full")
        self.fields[place] = lambda: str(made.value or "").strip(), value


def import_view(session: Session) -> None:
    """Draw the card of the current import; nothing without one."""
    now = session.importing
    if now is None:
        return
    form = AnswerForm()

    async def again() -> None:
        await run.io_bound(session.answer, form.changed())

    async def take() -> None:
        await run.io_bound(session.take, form.changed())

    why = "Mend what is wrong, answer what is asked, and look again until it is right. Then take it."
    with widgets.card("2. What your files seem to say", why):
        _columns(form, now)
        _questions(form, now)
        _runs(form, now)
        with ui.element("div").classes("line"):
            ui.button("Look again", on_click=again).props("no-caps outline")
        if now.ready:
            _understood(now)
        with ui.element("div").classes("line"):
            ui.button("This is right: take it", on_click=take).props("no-caps").set_enabled(now.ready)


def _columns(form: AnswerForm, now: Import) -> None:
    """A row a column: role, unit, place, sign, and why that is thought."""
    if now.proposal is None:
        return
    uses = {use.column: use for use in reversed(now.proposal.columns)}
    with ui.element("div").classes("grid columns"):
        for head in ("column", "is", "unit", "measured at", "sign", "because of"):
            ui.label(head).classes("soft small")
        for use in reversed(uses.values()):
            place: Place = ("columns", use.column)
            ui.label(use.column).classes("" if use.sure or use.role == "ignore" else "guess")
            form.select((*place, "role"), {r: r for r in ROLES}, use.role)
            form.input((*place, "unit"), use.unit, "mm")
            form.select((*place, "at"), WHERE, use.at)
            form.select((*place, "sign"), {"1": "+", "-1": "−"}, now.answers.get((*place, "sign"), "1"))
            ui.label(use.why if use.sure else f"{use.why} (a guess)").classes("soft small")
    ui.label(POINTS).classes("soft small")


def _questions(form: AnswerForm, now: Import) -> None:
    """What the files cannot say, with the answers given so far."""
    with ui.element("div").classes("halves"):
        for group in GROUPS:
            options = {"": NUMBERS} | {n: n for n in now.known(group)}
            form.select((group,), options, now.answers.get((group,), ""), label=group)
    with ui.element("div").classes("questions"):
        for q in now.questions:
            with ui.element("div"):
                ui.label(q.text[:1].upper() + q.text[1:])
                value = now.answers.get(q.path, "")
                if q.options:
                    form.select(q.path, {"": "choose"} | {o: o for o in q.options}, value)
                else:
                    form.input(q.path, value, f"e.g. {q.example}", shown=value or q.proposed)


def _runs(form: AnswerForm, now: Import) -> None:
    """A row a run: how it was set."""
    if not now.runs:
        return
    with ui.element("div").classes("scroll"), ui.element("div").classes("grid runs"):
        for head in ("run", *(key.replace("_", " ") for key in OF_RUN)):
            ui.label(head).classes("soft small")
        for run in now.runs:
            ui.label(run)
            for key in OF_RUN:
                form.input(("runs", run, key), now.setting(run, key), EXAMPLES[key])


def _understood(now: Import) -> None:
    """Runs, noise, curves and remarks."""
    assert now.proposal is not None
    assert now.proposal.campaign is not None
    recorded = {r.name: r for r in now.proposal.campaign.runs if r.signals}
    if recorded:
        curves(now.proposal.campaign, recorded)
    with ui.expansion("All runs, the noise that was read off, remarks").classes("w-full"):
        _table(runs_table(now.proposal.campaign))
        if now.proposal.noise:
            _table(noise_table(now.proposal))
        for note in now.proposal.notes:
            ui.label(str(note)).classes("soft small")


def _table(t: Table) -> None:
    widgets.table(t.columns, t.rows, title=t.title, left=t.left, marked=t.marked)


def _name(place: Place) -> str:
    """A place as the page can name it."""
    return ".".join("".join(c if c.isalnum() or c == "_" else "_" for c in key) for key in place)
