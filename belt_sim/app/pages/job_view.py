"""The work going on with its progress, and the result when it is done."""

from pathlib import Path
from typing import Any

from nicegui import ui

from belt_sim.app import plots, widgets
from belt_sim.app.jobs import Job
from belt_sim.app.session import Session, shown

HEADLINES = {"stopped": "Stopped", "failed": "No result", "finished": "Done"}
GOOD = ("adequate", "explained")


def job_view(session: Session) -> None:
    """The card of the latest work; nothing before the first."""
    job = session.job
    if job is None:
        return
    with widgets.card(f"4. {job.title}"):
        if job.running:
            _running(job)
            return
        ui.label(f"{HEADLINES[job.state]} after {job.seconds:.0f} s").classes("soft small")
        if job.state == "finished":
            _finished(session, job)


def _running(job: Job) -> None:
    """Stage, bar, seconds, and a way to stop."""
    bar = ui.linear_progress(0.0, show_value=False, size="10px").props("rounded").props("data-name=bar")
    line = ui.label("").classes("soft").props("data-name=stage")

    def move() -> None:
        share = job.share
        bar.props(remove="indeterminate") if share is not None else bar.props("indeterminate")
        bar.set_value(share or 0.0)
        counted = f", {job.done} of {job.total}" if share is not None else ""
        line.set_text(f"{job.stage}{counted} · {job.seconds:.0f} s")

    move()
    ui.timer(0.5, move)
    with ui.element("div").classes("line"):
        ui.button("Stop", on_click=job.stop).props("no-caps outline color=negative")


def _finished(session: Session, job: Job) -> None:
    number = session.jobs.index(job) + 1
    content = shown(job)
    if "verdict" in content:
        _diagnosed(session, number, content)
    else:
        _compared(content)
    with ui.element("div").classes("line"):
        ui.link("Download everything (zip)", f"/results/{number}/zip").props("data-name=download")
        ui.label(f"also in {_short(job.folder)}").classes("soft small")


def _short(folder: Path) -> Path:
    """A folder as seen from where the app was started."""
    here = Path.cwd()
    return folder.relative_to(here) if folder.is_relative_to(here) else folder


def _diagnosed(session: Session, number: int, content: dict[str, Any]) -> None:
    """The verdict, a way to compare again, and the report."""
    kind = "good" if content["verdict"] in GOOD else ""
    for line in content["lines"]:
        widgets.notice(f"{content['headline']}. {line}", kind)
    with ui.element("div").classes("line"):
        ui.link("Report in a tab of its own", f"/results/{number}/report", new_tab=True)
        if content["effects"]:

            def again() -> None:
                session.take_effects(content["effects"], "the diagnosis")

            ui.button("Use what was found in compare", on_click=again).props("flat no-caps dense")
    source = f"/results/{number}/report"
    ui.element("iframe").classes("report").props(f'sandbox="allow-scripts" src="{source}" title="report"')


def _compared(content: dict[str, Any]) -> None:
    """Sentences, the runs one by one, and the table of errors."""
    for line in content["lines"]:
        ui.label(line)
    panels = content["panels"]
    if panels:
        names = {k: p["title"] for k, p in enumerate(panels)}
        first = content["first"]
        chooser = ui.select(names, value=first, label="run and sensor").classes("w-full")
        drawn = ui.plotly(plots.of_report(panels[first]["figure"])).props("data-name=overlay")
        chooser.on_value_change(lambda e: drawn.update_figure(plots.of_report(panels[e.value]["figure"])))
    for t in content["tables"]:
        widgets.table(t["columns"], t["rows"], title=t["title"], left=t["left"], marked=t["marked"])
