"""The page of one's own measurements: drop files, see what was understood, compare, diagnose, read, download."""

import math
import shutil
import time
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import app, run, ui

from belt_sim.api.campaigns import imported_runs_table, noise_table
from belt_sim.api.simulate import model_for_campaign
from belt_sim.app import widgets
from belt_sim.app.session import MAX_UPLOAD, MEBI, NAMED_GROUPS, REPORT, TOO_LARGE, Import, KeyPath, Session
from belt_sim.app.simulate_page import MODEL_TITLES
from belt_sim.app.widgets import box, quiet_button, soft
from belt_sim.campaign import Campaign, suspicions
from belt_sim.campaign.folder import FILES, sheet_tree
from belt_sim.campaign.types import PLACES
from belt_sim.importing.mapping import ROLES
from belt_sim.io import group_names
from belt_sim.model import BY_TENSION
from belt_sim.results import words
from belt_sim.show.report import SENSOR_SPOTS, environment

OFTEN = 0.4  # [s] between two looks at the session
#: a drop anywhere on the page goes to the field of the uploads, which takes it from there
DROPS = """<script>for (const kind of ["dragover", "drop"]) document.addEventListener(kind, (event) => {
  event.preventDefault();
  const files = event.dataTransfer ? [...event.dataTransfer.files] : [];
  if (kind === "drop" && files.length) getElement(%d).$refs.qRef.addFiles(files);
});</script>"""


@ui.page("/measurements", title="belt_sim: My measurements")
def measurements_page() -> None:
    """The page; what stands below the field of the drops is drawn again when the session has changed."""
    session: Session = app.state.session

    async def take_files(event: Any) -> None:
        files = [(file.name, await file.read()) for file in event.files]
        event.sender.reset()
        await run.io_bound(session.drop, files)

    widgets.frame("/measurements")
    about = f"A logger's files, or {', '.join(FILES)} alone or as a zip; up to {MAX_UPLOAD // MEBI} MB at a time."
    with widgets.card("1. Drop your files anywhere on this page", about):
        refuse = partial(session.notify, f"files: refused; {TOO_LARGE}")
        heard: dict[str, Any] = {"on_multi_upload": take_files, "on_rejected": refuse}
        heard |= {"multiple": True, "auto_upload": True, "max_total_size": MAX_UPLOAD}
        ui.add_body_html(DROPS % ui.upload(label="Drop files here, or press +", **heard).id)
    drawn = [session.version]

    @ui.refreshable
    def rest() -> None:
        with box("card-lines").props(f"data-version={session.version}"):
            for line in session.messages:
                widgets.notice(line)
        if session.campaign is not None:
            _campaign(session, session.campaign)
        elif session.importing is not None:
            _import(session, session.importing)
        if session.jobs:
            _job(session)

    def look() -> None:
        if drawn[0] != session.version:
            drawn[0] = session.version
            rest.refresh()

    rest()
    ui.timer(OFTEN, look)


async def _zip(session: Session, folder: Path | None) -> None:
    """All files of a folder, as a download."""
    assert folder is not None
    beside = str(session.folder / folder.name)
    packed: Any = await run.io_bound(shutil.make_archive, beside, "zip", folder.parent, folder.name)
    ui.download.file(packed)


# ---- what logger files seem to say

WHERE = {"": "–"} | {p: p.replace("_", " ") for p in PLACES}
#: setting of a run -> how it is written
RUN_EXAMPLES = {"tension": "10 N/mm2", "yaw": "-0.042 deg", "speed": "0.5 m/s", "direction": "1"}
RUN_EXAMPLES |= {"yaw_at": "0 m", "start": "3.2 m"}


def answer_field(now: Import, place: KeyPath, known: str = "", options: Any = None, example: str = "") -> None:
    """A menu, or a line of text, for one answer, which is noted at once, so that a page loaded anew shows it.

    known: what stands there without an answer; options: of a menu.
    """
    stands = now.answers.get(place, known)
    name = ".".join("".join(c if c.isalnum() or c == "_" else "_" for c in key) for key in place)
    keep: Any = {"value": stands, "on_change": lambda e: now.note(place, e.value)}
    if options is None:
        made: Any = ui.input(placeholder=example, **keep).props("outlined hide-bottom-space")
    else:  # an answer that is none of the options is one more
        made = ui.select(options if stands in options else {stands: stands} | options, **keep)
    made.props(f"dense data-name='{name}' aria-label='{name}'").classes("w-full")


def _import(session: Session, now: Import) -> None:
    """The card of the current import."""
    update, proposal = partial(run.io_bound, session.update), now.proposal
    with widgets.card("2. What your files seem to say", "Correct the table, answer the questions, press Update."):
        if proposal is not None:
            _columns(now, update)
        with box("halves"):
            for group, kind in NAMED_GROUPS.items():
                options = {"": "numbers of my own"} | {n: n for n in group_names(kind)}
                with box():
                    soft(group)
                    answer_field(now, (group,), "", options)
        with box("questions"):
            # settings of runs and places of sensors have fields of their own
            for q in (q for p, q in now.questions.items() if p[0] != "runs" and p[-1] != "at"):
                with box():
                    ui.label(words.capital(q.text))
                    answers = {"": "choose"} | {o: o for o in q.options} if q.options else None
                    answer_field(now, q.path, "" if answers else q.proposed, answers, f"e.g. {q.example}")
        if now.runs:
            with box("scroll"), box("grid", "runs"):
                for head in ("run", *RUN_EXAMPLES):
                    soft(head.replace("_", " "))
                for name, stated in now.runs.items():
                    ui.label(name)
                    for key, example in RUN_EXAMPLES.items():
                        answer_field(now, ("runs", name, key), str(stated.get(key) or ""), example=example)
        ui.button("Update", on_click=update).props("no-caps outline").style("align-self: start")
        if proposal is not None and proposal.campaign is not None and not now.lacks:
            _curves(proposal.campaign)
            noise = [noise_table(proposal)] if proposal.noise else []
            tables = (imported_runs_table(proposal.campaign), *noise)
            _tables("All runs, the noise that was read off, remarks", *tables, notes=map(str, proposal.notes))
        with box("line"):
            taken = ui.button("Use this data", on_click=partial(run.io_bound, session.take)).props("no-caps")
            taken.set_enabled(not now.lacks)
            soft(now.lacks)


def _columns(now: Import, update: Any) -> None:
    """A row a column: role, unit, place, sign, and why that is thought; and a sketch to say where sensors stand."""
    assert now.proposal is not None
    uses: dict[str, Any] = {}
    for use in now.proposal.columns:
        uses.setdefault(use.name, use)
    asked = [q.path[1] for q in now.proposal.missing if q.path[-1] == "at"]
    sensors = [n for n, use in uses.items() if use.role == "signal" or n in asked]
    with box("grid", "columns"):
        for head in ("column", "is", "unit", "measured at", "sign", "because of"):
            soft(head)
        for name, use in uses.items():
            ui.label(name)
            answer_field(now, ("columns", name, "role"), use.role, {r: r for r in ROLES})
            answer_field(now, ("columns", name, "unit"), use.unit, example="mm")
            answer_field(now, ("columns", name, "at"), use.at, WHERE)
            answer_field(now, ("columns", name, "sign"), "1", {"1": "+", "-1": "−"})
            soft(use.why)
    if not sensors:
        return

    async def put(spot: str) -> None:
        now.note(("columns", str(chosen.value), "at"), spot)
        await update()

    soft("Where does each sensor stand? Choose it here, then press its place on the machine.")
    with box("line"):
        first = next((n for n in sensors if not uses[n].at), sensors[0])
        chosen = ui.toggle(sensors, value=first).props("no-caps dense")
    taken = {uses[n].at: n for n in sensors if uses[n].at}
    with box("sketch").props("data-name=sketch"):
        ui.html(environment().get_template("sketch.svg.j2").render(marked=(), marks=(), spots=()), sanitize=False)
        for place, (x, y) in SENSOR_SPOTS.items():
            spot = ui.button(place[-1] if place.startswith("point") else "tilt", on_click=partial(put, place))
            spot.props(f"dense rounded no-caps {'' if place in taken else 'outline'} data-name='spot-{place}'")
            spot.classes("spot").style(f"left: {x / 6.4}%; top: {y / 1.9}%")
            spot.tooltip(f"{place.replace('_', ' ')}: {taken.get(place, 'free')}")


# ---- the campaign, and work on it


def _campaign(session: Session, campaign: Campaign) -> None:
    """The cards of the current campaign and of the questions about it."""
    with widgets.card("2. What was understood", str(campaign)):
        tree = sheet_tree(campaign)
        shown = {**tree["machine"], **tree["belt"]}
        texts = {n.replace("_", " "): words.with_u(q["value"], q["u"], q.get("unit", "")) for n, q in shown.items()}
        widgets.facts(texts, "wide")
        for found in suspicions(campaign):
            widgets.notice(f"{found.kind.replace('_', ' ')}: {found}")
        _curves(campaign)
        with box("line"):
            if session.importing is not None:
                quiet_button("Change how the files were read", partial(session.notify, campaign=None))
            quiet_button("Campaign (zip)", partial(_zip, session, session.campaign_folder)).props("data-name=campaign")
        _tables("All runs", imported_runs_table(campaign))
    inputs = session.inputs
    with widgets.card("3. Ask", "Compare shows where a model fails; diagnose finds which physical effect it lacks."):
        titles = {BY_TENSION: f"by tension: {model_for_campaign(campaign)}"} | MODEL_TITLES
        ui.select(titles, label="model").bind_value(inputs, "model").classes("w-full")
        with ui.expansion("More about the diagnosis").bind_value(inputs, "more").classes("w-full"):
            tried = partial(inputs.__setitem__, "candidates")
            widgets.effect_list("effects to try (none ticked: all)", inputs["candidates"], tried)
        with box("line"):
            for name, look in (("Compare", "no-caps outline"), ("Diagnose", "no-caps")):
                ui.button(name, on_click=partial(session.work, name.lower())).props(look).set_enabled(not session.busy)


def _curves(campaign: Campaign) -> None:
    """The readings of all runs; they are drawn aside, as it takes a while."""
    shown = ui.html("", sanitize=False).classes("w-full").props("data-name=measured")

    async def draw() -> None:
        shown.set_content(await run.io_bound(widgets.page_picture, campaign) or "")

    ui.timer(0.0, draw, once=True)


def _tables(title: str, *tables: words.Table, notes: Iterable[str] = ()) -> None:
    """Tables to unfold, each in a box that scrolls, and lines below them."""
    with ui.expansion(title).classes("w-full"):
        for table in tables:
            ui.html(table.html(), sanitize=False).classes("scroll")
        for note in notes:
            soft(note)


def _job(session: Session) -> None:
    """The card of the latest work: how far it is, or what it found."""
    job = session.jobs[-1]
    with widgets.card(f"4. {job.title}"):
        if job.state == "running":
            bar = ui.linear_progress(0.0, show_value=False, size="10px").props("rounded")
            line = ui.label("").classes("soft").props("data-name=stage")

            def move() -> None:
                seconds, in_all = time.monotonic() - job.began, job.progress["in_all_s"]
                bar.set_value(min(seconds / (in_all or math.inf), 0.98))
                about = f" of about {in_all:.0f} s{job.progress['more']}" if in_all else " s"
                line.set_text(f"{job.progress['stage']} · {seconds:.0f}{about}")

            ui.timer(0.5, move)
            ui.button("Stop", on_click=job.stop).props("no-caps outline color=negative").style("align-self: start")
            return
        soft(f"{job.state} after {(job.ended or job.began) - job.began:.0f} s")
        if job.state != "Done":
            return
        report, address = job.folder / REPORT, f"/results/{len(session.jobs)}/report"
        with box("line"):
            if report.exists():
                ui.link("Report in a tab of its own", address, new_tab=True)
                quiet_button("Report (HTML)", partial(ui.download.file, report))
            quiet_button("Download everything (zip)", partial(_zip, session, job.folder))
        if report.exists():
            ui.element("iframe").classes("report").props(f'sandbox="allow-scripts" src="{address}" title="report"')
            return
        said = job.said.replace("; or model=NAME", "").removesuffix(job.folder.name)  # a menu and links say these
        ui.label(words.in_print(said.rstrip())).classes("scroll printed")
        # what a model does beside the measurement comes first
        for path in sorted(job.folder.glob("*.svg"), key=lambda p: (p.stem != "overlay", p.stem)):
            ui.image(path).classes("picture").props(f"data-name={path.stem} alt={path.stem}")
