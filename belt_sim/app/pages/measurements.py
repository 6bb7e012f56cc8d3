"""The page of one's own measurements: drop files, see what was understood, compare, diagnose, read, download."""

from typing import Any

from nicegui import run, ui

from belt_sim.app import look
from belt_sim.app.desk import Desk
from belt_sim.app.guard import MAX_UPLOAD, MEBI, TOO_LARGE
from belt_sim.app.pages.asking import asking
from belt_sim.app.pages.campaign_view import campaign_view
from belt_sim.app.pages.import_view import import_view
from belt_sim.app.pages.job_view import job_view
from belt_sim.campaign.read import FILES, shipped

OFTEN = 0.4  # [s] between two looks at the desk


def add(desk: Desk) -> None:
    """Serve the page."""

    @ui.page("/measurements", title="belt_sim")
    def page() -> None:
        look.frame("/measurements")
        parts = _Parts(desk)
        ui.timer(OFTEN, parts.look)


class _Parts:
    """What follows the desk: drawn again when its version changes."""

    def __init__(self, desk: Desk) -> None:
        self.desk, self.version, self.seen = desk, desk.version, self._now(desk)
        self.said = ui.refreshable(_said)
        self.reading = ui.refreshable(import_view)
        self.what = ui.refreshable(campaign_view)
        self.ask = ui.refreshable(asking)
        self.result = ui.refreshable(job_view)
        with _drop(desk):
            self.said(desk)
        for part in (self.reading, self.what, self.ask, self.result):
            part(desk)

    def look(self) -> None:
        """Draw again what has changed."""
        if self.version == self.desk.version:
            return
        self.version, before = self.desk.version, self.seen
        self.seen = self._now(self.desk)
        if self.seen[:2] != before[:2]:
            self.what.refresh()
        if self.seen[2:] != before[2:]:
            self.result.refresh()
        for part in (self.reading, self.said, self.ask):
            part.refresh()

    @staticmethod
    def _now(desk: Desk) -> tuple[int, bool, int, str]:
        """The campaign, whether one is being imported, and how far the work is."""
        return id(desk.campaign), desk.importing is None, len(desk.jobs), desk.job.state if desk.job else ""


def _drop(desk: Desk) -> Any:
    """Where files are dropped, and samples to try."""

    async def dropped(event: Any) -> None:
        files = [(file.name, await file.read()) for file in event.files]
        event.sender.reset()
        await run.io_bound(desk.drop, files)

    async def sample() -> None:
        await run.io_bound(desk.sample, str(chosen.value))

    def refused() -> None:
        desk.changed(f"files: refused; {TOO_LARGE}")

    room = f"Up to {MAX_UPLOAD // MEBI} MB at a time; they stay on this machine."
    kinds = f"A logger's CSV or Excel files; or {', '.join(FILES)}, or a zip of them."
    with look.card("1. Drop your files", f"{kinds} {room}") as made:
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


def _said(desk: Desk) -> None:
    with ui.element("div").classes("card-lines").props(f"data-version={desk.version}"):
        for line in desk.said:
            look.told(line)
