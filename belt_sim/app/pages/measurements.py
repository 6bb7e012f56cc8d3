"""The page of one's own measurements: drop files, see what was understood, compare, diagnose, read, download."""

from typing import Any

from nicegui import run, ui

from belt_sim.api.inference import MIN_BOOTSTRAPS
from belt_sim.app import widgets
from belt_sim.app.pages.campaign_view import campaign_view
from belt_sim.app.pages.import_view import import_view
from belt_sim.app.pages.job_view import job_view
from belt_sim.app.pages.simulate import TITLES
from belt_sim.app.security import MAX_UPLOAD, MEBI, TOO_LARGE
from belt_sim.app.session import Session
from belt_sim.app.sliders import words
from belt_sim.campaign.read import FILES, shipped
from belt_sim.effects.library import library
from belt_sim.errors import BeltError

OFTEN = 0.4  # [s] between two looks at the session


def add(session: Session) -> None:
    """Serve the page."""

    @ui.page("/measurements", title="belt_sim")
    def page() -> None:
        widgets.frame("/measurements")
        parts = _Parts(session)
        ui.timer(OFTEN, parts.look)


class _Parts:
    """Parts of the page that follow the session: drawn again when its version changes."""

    def __init__(self, session: Session) -> None:
        self.session, self.version, self.seen = session, session.version, self._now(session)
        self.said = ui.refreshable(_said)
        self.reading = ui.refreshable(import_view)
        self.what = ui.refreshable(campaign_view)
        self.ask = ui.refreshable(asking)
        self.result = ui.refreshable(job_view)
        with _drop(session):
            self.said(session)
        for part in (self.reading, self.what, self.ask, self.result):
            part(session)

    def look(self) -> None:
        """Draw again what has changed."""
        if self.version == self.session.version:
            return
        self.version, before = self.session.version, self.seen
        self.seen = self._now(self.session)
        if self.seen[:2] != before[:2]:
            self.what.refresh()
        if self.seen[2:] != before[2:]:
            self.result.refresh()
        for part in (self.reading, self.said, self.ask):
            part.refresh()

    @staticmethod
    def _now(session: Session) -> tuple[int, bool, int, str]:
        """The campaign, whether one is being imported, and how far the work is."""
        return (
            id(session.campaign),
            session.importing is None,
            len(session.jobs),
            session.job.state if session.job else "",
        )


def _drop(session: Session) -> Any:
    """Where files are dropped, and samples to try."""

    async def dropped(event: Any) -> None:
        files = [(file.name, await file.read()) for file in event.files]
        event.sender.reset()
        await run.io_bound(session.drop, files)

    async def sample() -> None:
        await run.io_bound(session.sample, str(chosen.value))

    def refused() -> None:
        session.changed(f"files: refused; {TOO_LARGE}")

    room = f"Up to {MAX_UPLOAD // MEBI} MB at a time; they stay on this machine."
    kinds = f"A logger's CSV or Excel files; or {', '.join(FILES)}, or a zip of them."
    with widgets.card("1. Drop your files", f"{kinds} {room}") as made:
        upload = ui.upload(
            multiple=True,
            auto_upload=True,
            max_total_size=MAX_UPLOAD,
            label="Drop files here, or press +",
            on_multi_upload=dropped,
            on_rejected=refused,
        )
        upload.props("data-name=drop")
        with ui.element("div").classes("line"):
            ui.label("No measurements at hand? A sample:").classes("soft small")
            chosen = ui.select(shipped(), value="slack_belt").props("dense outlined aria-label=sample")
            ui.button("Open it", on_click=sample).props("flat no-caps")
    return made


def _said(session: Session) -> None:
    with ui.element("div").classes("card-lines").props(f"data-version={session.version}"):
        for line in session.said:
            widgets.notice(line)


def asking(session: Session) -> None:
    """Draw the card of questions; nothing without a campaign."""
    if session.campaign is None or session.importing is not None:
        return
    busy = session.job is not None and session.job.running
    with widgets.card("3. Ask", "Compare shows where a model fails; diagnose finds which physical effect it lacks."):
        ui.select(TITLES, label="model").bind_value(session.asked, "model").classes("w-full").props("data-name=model")
        _chosen_effects(session)
        with ui.expansion("More about the diagnosis").classes("w-full"):
            names = {i: words(i) for i in sorted(library(), key=words)}
            which = "effects to try (none chosen: all that can be told)"
            tried = ui.select(names, multiple=True, with_input=True, label=which).props("use-chips")
            tried.bind_value(session.asked, "candidates").classes("w-full").props("data-name=candidates")
            count = ui.number("synthetic repeats to tell chance by", min=MIN_BOOTSTRAPS, precision=0)
            count.bind_value(session.asked, "bootstraps").classes("w-full").props("data-name=bootstraps")
        with ui.element("div").classes("line"):
            ui.button("Compare", on_click=lambda: _start(session, "compare")).props("no-caps outline").set_enabled(
                not busy
            )
            ui.button("Diagnose", on_click=lambda: _start(session, "diagnose")).props("no-caps").set_enabled(not busy)


def _chosen_effects(session: Session) -> None:
    if not session.effects:
        return
    names = ", ".join(str(e["id"]) for e in session.effects)
    with ui.element("div").classes("line"):
        ui.label(f"Compare uses the effects of {session.effects_name}: {names}")
        ui.button("Without them", on_click=session.forget_effects).props("flat no-caps dense")


def _start(session: Session, task: str) -> None:
    model = str(session.asked["model"])
    try:
        if task == "compare":
            session.start(task, model, effects=session.effects or None)
            return
        count = int(session.asked["bootstraps"] or 0)
        session.start(task, model, total=count, effects=session.asked["candidates"] or None, bootstraps=count, seed=0)
    except BeltError as error:
        session.changed(*str(error).splitlines())
