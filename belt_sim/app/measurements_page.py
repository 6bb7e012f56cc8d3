"""The page of one's own measurements: drop files, see what was understood, compare, diagnose, read, download."""

import shutil
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import run, ui

from belt_sim.api.campaigns import imported_runs_table, noise_table, run_noise_table
from belt_sim.api.inference import MIN_BOOTSTRAPS
from belt_sim.api.simulate import model_for_campaign
from belt_sim.app import widgets
from belt_sim.app.session import GROUPS, MAX_UPLOAD, MEBI, REPORT, TOO_LARGE, Import, Place, Session
from belt_sim.app.simulate_page import TITLES
from belt_sim.app.widgets import box, soft
from belt_sim.campaign import Campaign
from belt_sim.campaign.folder import FILES, sheet_tree
from belt_sim.campaign.types import PLACES
from belt_sim.errors import BeltError
from belt_sim.importing.mapping import ROLES
from belt_sim.io import group_names, sample_campaigns
from belt_sim.model import BY_TENSION
from belt_sim.results import words
from belt_sim.results.words import Table

OFTEN = 0.4  # [s] between two looks at the session
#: a drop anywhere on the page goes to the field of the uploads, which takes it from there
DROPS = """<script>for (const kind of ["dragover", "drop"]) document.addEventListener(kind, (event) => {
  event.preventDefault();
  const files = event.dataTransfer ? [...event.dataTransfer.files] : [];
  if (kind === "drop" && files.length) getElement(%d).$refs.qRef.addFiles(files);
});</script>"""
QUIET = "flat no-caps dense"  # look of a button beside others


def add_measurements(session: Session) -> None:
    """Serve the page; each of its parts is drawn again when that changes which it shows."""

    def campaign() -> tuple[object, ...]:
        return id(session.campaign), session.importing is None

    shown: dict[Any, Any] = dict.fromkeys((_show_notices, import_view), lambda: session.version)
    shown[campaign_view] = campaign
    shown[asking] = lambda: (*campaign(), session.busy, id(session.effects))
    shown[job_view] = lambda: (len(session.jobs), session.job.state if session.job else "")

    @ui.page("/measurements", title="belt_sim")
    def page() -> None:
        widgets.frame("/measurements")
        parts = {ui.refreshable(draw): state for draw, state in shown.items()}
        before = {part: state() for part, state in parts.items()}

        def look() -> None:
            for part, state in parts.items():
                if before[part] != (now := state()):
                    before[part] = now
                    part.refresh()

        notices, *others = parts
        with _drop(session):
            notices(session)
        for part in others:
            part(session)
        ui.timer(OFTEN, look)


def _drop(session: Session) -> Any:
    """Where files are dropped, and samples to try."""

    async def take_files(event: Any) -> None:
        files = [(file.name, await file.read()) for file in event.files]
        event.sender.reset()
        try:
            await run.io_bound(session.drop, files)
        except Exception as error:  # the page must say so of these files, not go on showing the last ones
            names = ", ".join(name for name, _ in files)
            session.end_drop(f"{names}: cannot be read ({type(error).__name__}: {error}); please report this file")
            raise

    room = f"Up to {MAX_UPLOAD // MEBI} MB at a time; they stay on this machine."
    kinds = f"A logger's CSV or Excel files; or {', '.join(FILES)}, or a zip of them."
    with widgets.card("1. Drop your files anywhere on this page", f"{kinds} {room}") as made:
        heard: dict[str, Any] = {"on_rejected": lambda: session.end_drop(f"files: refused; {TOO_LARGE}")}
        heard |= {"on_multi_upload": take_files, "max_total_size": MAX_UPLOAD}
        upload = ui.upload(multiple=True, auto_upload=True, label="Drop files here, or press +", **heard)
        ui.add_body_html(DROPS % upload.id)
        with box("line"):
            soft("No measurements at hand? A sample:")
            chosen = ui.select(sample_campaigns(), value="slack_belt").props("dense outlined aria-label=sample")
            sample = lambda: run.io_bound(session.sample, str(chosen.value))  # noqa: E731
            ui.button("Open it", on_click=sample).props("flat no-caps")
    return made


def _show_notices(session: Session) -> None:
    with box("card-lines").props(f"data-drops={session.drops}"):
        for line in session.messages:
            widgets.notice(line)


def asking(session: Session) -> None:
    """Draw the card of questions; nothing without a campaign."""
    if session.campaign is None or session.importing is not None:
        return
    inputs = session.inputs

    def start(task: str) -> None:
        more: dict[str, Any] = {"effects": session.effects or None}
        if task == "diagnose":
            times = int(inputs["bootstraps"] or 0)
            more = {"bootstraps": times, "seed": 0, "effects": inputs["candidates"] or None}
        try:
            session.start(task, str(inputs["model"]), **more)
        except BeltError as error:
            session.notify(*str(error).splitlines())

    with widgets.card("3. Ask", "Compare shows where a model fails; diagnose finds which physical effect it lacks."):
        titles = {BY_TENSION: f"by tension: {model_for_campaign(session.campaign)}"} | TITLES
        ui.select(titles, label="model").bind_value(inputs, "model").classes("w-full")
        if session.effects:
            with box("line"):
                names = ", ".join(str(e["id"]) for e in session.effects)
                ui.label(f"Compare uses the effects of the diagnosis: {names}")
                ui.button("Without them", on_click=partial(session.take_effects, [])).props(QUIET)
        with ui.expansion("More about the diagnosis").bind_value(inputs, "more").classes("w-full"):
            tried = partial(inputs.__setitem__, "candidates")
            widgets.effect_list("effects to try (none ticked: all)", inputs["candidates"], tried)
            times = ui.number("synthetic repeats to tell chance by", min=MIN_BOOTSTRAPS, precision=0)
            times.bind_value(inputs, "bootstraps").classes("w-full")
        with box("line"):
            for name, look in (("Compare", "no-caps outline"), ("Diagnose", "no-caps")):
                ui.button(name, on_click=partial(start, name.lower())).props(look).set_enabled(not session.busy)


HEADLINES = {"stopped": "Stopped", "failed": "No result", "finished": "Done"}
GOOD = ("adequate", "explained")


def job_view(session: Session) -> None:
    """The card of the latest work; nothing before the first."""
    job = session.job
    if job is None:
        return
    with widgets.card(f"4. {job.title}"):
        if job.running:
            bar = ui.linear_progress(0.0, show_value=False, size="10px").props("rounded")
            line = ui.label("").classes("soft").props("data-name=stage")

            def move() -> None:
                bar.props(remove="indeterminate") if job.in_all else bar.props("indeterminate")
                bar.set_value(min(job.seconds / job.in_all, 0.98) if job.in_all else 0.0)
                about = f" of about {job.in_all:.0f} s" if job.in_all else " s"
                line.set_text(f"{job.stage} · {job.seconds:.0f}{about}")

            move()
            ui.timer(0.5, move)
            ui.button("Stop", on_click=job.stop).props("no-caps outline color=negative").style("align-self: start")
            return
        soft(f"{HEADLINES[job.state]} after {job.seconds:.0f} s")
        if job.state != "finished":
            return
        if "verdict" in job.shown:
            _show_diagnosis(session, f"/results/{session.jobs.index(job) + 1}/report", job.shown)
        else:
            _show_comparison(job.shown)
        with box("line"):
            ui.button("Download everything (zip)", on_click=partial(_zip, session, job.folder)).props(QUIET)
            for path in sorted(p for p in job.folder.iterdir() if p.suffix == ".png" or p.name == REPORT):
                ui.button(path.name, on_click=partial(ui.download.file, path)).props(QUIET)
            folder = job.folder.relative_to(Path.cwd()) if job.folder.is_relative_to(Path.cwd()) else job.folder
            soft(f"also in {folder}")


async def _zip(session: Session, folder: Path) -> None:
    """All files of a folder, as a download."""
    beside = str(session.folder / folder.name)
    packed: Any = await run.io_bound(shutil.make_archive, beside, "zip", folder.parent, folder.name)
    ui.download.file(packed)


def _show_diagnosis(session: Session, report: str, content: Any) -> None:
    kind = "tie" if content["reserved"] else "good" if content["verdict"] in GOOD else ""
    for line in content["lines"]:
        widgets.notice(line, kind)
    with box("line"):
        ui.link("Report in a tab of its own", report, new_tab=True)
        if content["effects"]:
            again = partial(session.take_effects, content["effects"])
            ui.button("Use what was found in compare", on_click=again).props(QUIET)
    ui.element("iframe").classes("report").props(f'sandbox="allow-scripts" src="{report}" title="report"')


def _show_comparison(content: Any) -> None:
    for line in content["lines"]:
        ui.label(words.in_print(line))
    panels, first = content["panels"], content["first"]
    if panels:
        names = {k: p["title"] for k, p in enumerate(panels)}
        chooser = ui.select(names, value=first, label="run and sensor").classes("w-full")
        ui.html(content["source"], sanitize=False).classes("source")
        drawn = ui.html(panels[first]["svg"], sanitize=False).classes("overlay").props("data-name=overlay")
        chooser.on_value_change(lambda e: drawn.set_content(panels[e.value]["svg"]))
    for t in content["tables"]:
        widgets.table(t)


# ---- what logger files seem to say

WHERE = {"": "–"} | {p: p.replace("_", " ") for p in PLACES}
#: setting of a run -> how it is written
OF_RUN = {"tension": "10 N/mm2", "yaw": "-0.042 deg", "speed": "0.5 m/s", "direction": "1"}
OF_RUN |= {"yaw_at": "0 m", "start": "3.2 m"}


def answer_field(
    now: Import, place: Place, value: str, options: dict[str, str] | None = None, *,
    label: str | None = None, example: str = "", proposed: str = "",
) -> None:  # fmt: skip
    """A menu, or a line of text, for one answer; what is written in it is noted in ``draft`` at once, so that a page
    loaded anew shows it, and of two fields of one place that counts which was changed last.

    value: what is known; proposed: what stands there without being an answer yet, which is taken unless it is changed.
    """
    now.shown[place] = value
    stands = now.draft.setdefault(place, value or proposed)
    name = ".".join("".join(c if c.isalnum() or c == "_" else "_" for c in key) for key in place)
    keep: Any = {"value": stands, "label": label, "on_change": lambda e: now.draft.__setitem__(place, e.value)}
    made: Any
    if options is None:
        made = ui.input(placeholder=example, **keep).props(f"outlined hide-bottom-space aria-label='{name}'")
    else:  # an answer that is none of the options is one more
        made = ui.select(options if stands in options else {stands: stands} | options, **keep)
    made.props(f"dense data-name='{name}'").classes("w-full")


def import_view(session: Session) -> None:
    """Draw the card of the current import; nothing without one."""
    now = session.importing
    if now is None:
        return
    look_again = partial(run.io_bound, session.answer)
    why = "Correct the table, answer the questions, press Update. Then continue."
    with widgets.card("2. What your files seem to say", why):
        if now.proposal is not None:
            _columns(now, look_again)
        with box("halves"):
            for group, kind in GROUPS.items():
                options = {"": "numbers of my own"} | {n: n for n in group_names(kind)}
                answer_field(now, (group,), now.answers.get((group,), ""), options, label=group)
        with box("questions"):
            for q in (q for q in now.questions if q.path[-1] != "at"):  # places have their sketch
                with box():
                    ui.label(q.text[:1].upper() + q.text[1:])
                    answers = {"": "choose"} | {o: o for o in q.options} if q.options else None
                    more: Any = {"example": f"e.g. {q.example}", "proposed": "" if q.options else q.proposed}
                    answer_field(now, q.path, now.answers.get(q.path, ""), answers, **more)
        if now.runs:
            with box("scroll"), box("grid", "runs"):
                for head in ("run", *OF_RUN):
                    soft(head.replace("_", " "))
                for name, stated in now.runs.items():
                    ui.label(name)
                    for key, example in OF_RUN.items():
                        answer_field(now, ("runs", name, key), str(stated.get(key) or ""), example=example)
        ui.button("Update", on_click=look_again).props("no-caps outline").style("align-self: start")
        if now.ready and now.proposal is not None and now.proposal.campaign is not None:
            _curves(now.proposal.campaign)
            with ui.expansion("All runs, the noise that was read off, remarks").classes("w-full"):
                noise = (noise_table(now.proposal), run_noise_table(now.proposal)) if now.proposal.noise else ()
                for t in (imported_runs_table(now.proposal.campaign), *noise):
                    widgets.table(t)
                for note in now.proposal.notes:
                    soft(str(note))
        with box("line"):
            take = partial(run.io_bound, session.take)
            ui.button("Use this data", on_click=take).props("no-caps").set_enabled(now.ready)
            soft(now.lacks)


def _columns(now: Import, look_again: Any) -> None:
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
            ui.label(name).classes("" if use.sure or use.role == "ignore" else "guess")
            answer_field(now, ("columns", name, "role"), use.role, {r: r for r in ROLES})
            answer_field(now, ("columns", name, "unit"), use.unit, example="mm")
            answer_field(now, ("columns", name, "at"), use.at, WHERE)
            sign: Place = ("columns", name, "sign")
            answer_field(now, sign, now.answers.get(sign, "1"), {"1": "+", "-1": "−"})
            soft(use.why)
    if not sensors:
        return

    async def put(spot: str) -> None:
        now.draft["columns", str(chosen.value), "at"] = spot
        await look_again()

    soft("Where does each sensor stand? Choose it here, then press its place on the machine.")
    with box("line"):
        first = next((n for n in sensors if not uses[n].at), sensors[0])
        chosen = ui.toggle(sensors, value=first).props("no-caps dense")
    widgets.sketch({uses[n].at: n for n in sensors if uses[n].at}, put)


# ---- the campaign


def campaign_view(session: Session) -> None:
    """Draw the card of the current campaign; nothing without one."""
    campaign, folder = session.campaign, session.campaign_folder
    if campaign is None or folder is None or session.importing is not None:
        return
    with widgets.card("2. What was understood", str(campaign)):
        tree = sheet_tree(campaign)
        numbers = {**tree["machine"], **tree["belt"]}
        shown = {n: words.with_u(q["value"], q["u"], q.get("unit", "")) for n, q in numbers.items()}
        widgets.facts({n.replace("_", " "): text for n, text in shown.items()}, "wide")
        for found in session.suspicions:
            widgets.notice(f"{found.kind.replace('_', ' ')}: {found}")
        _curves(campaign)
        with box("line"):
            if session.finished_import is not None:
                ui.button("Change how the files were read", on_click=session.back_to_import).props(QUIET)
            zipped = ui.button("Campaign (zip)", on_click=partial(_zip, session, folder)).props(QUIET)
            zipped.props("data-name=campaign")
            if any(r.signals for r in campaign.runs):
                readings = lambda: ui.download.content(campaign.to_pandas().to_csv(index=False), "readings.csv")  # noqa: E731
                ui.button("Readings (CSV)", on_click=readings).props(QUIET)
        with ui.expansion("All runs and sensors").classes("w-full"):
            widgets.table(imported_runs_table(campaign))
            rows = [
                (s.name, s.at.replace("_", " "), *(words.thousandths(v) for v in (s.white, s.zero, s.wander_sd)))
                for s in campaign.signals
            ]
            columns = ("sensor", "place", "noise (mm or mrad)", "zero", "wander")
            widgets.table(Table("", columns, rows, left=("sensor", "place")))


def _curves(campaign: Campaign) -> None:
    """The curves of one run, to be chosen; nothing without a record."""
    recorded = {r.name: r for r in campaign.runs if r.signals}
    if not recorded:
        return
    first = next(iter(recorded))
    labels = {n: f"{n}: {words.tension(r.tension)} N/mm², yaw {words.yaw(r.yaw)}°" for n, r in recorded.items()}
    chooser = ui.select(labels, value=first, label="run").classes("w-full")
    drawn = ui.plotly(widgets.measured_figure(campaign, recorded[first])).props("data-name=measured")
    chooser.on_value_change(lambda e: drawn.update_figure(widgets.measured_figure(campaign, recorded[e.value])))
