"""The page of one's own measurements: drop files, see what was understood, compare, diagnose, read, download."""

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import run, ui

from belt_sim.api.campaigns import imported_runs_table, noise_table, run_noise_table
from belt_sim.api.inference import MIN_BOOTSTRAPS
from belt_sim.api.simulate import model_for_campaign
from belt_sim.app import widgets
from belt_sim.app.jobs import SHOWN
from belt_sim.app.session import GROUPS, MAX_UPLOAD, MEBI, TOO_LARGE, Import, Place, Session
from belt_sim.app.simulate_page import TITLES
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


def add_measurements(session: Session) -> None:
    """Serve the page; each of its parts is drawn again when that changes which it shows."""

    def campaign() -> tuple[int, bool]:
        return id(session.campaign), session.importing is None

    def question() -> tuple[object, ...]:
        return (*campaign(), session.busy, id(session.effects), session.effects_name)

    def work() -> tuple[int, str]:
        return len(session.jobs), session.job.state if session.job else ""

    shown: dict[Any, Any] = dict.fromkeys((_show_notices, import_view), lambda: session.version)
    shown |= {campaign_view: campaign, asking: question, job_view: work}

    @ui.page("/measurements", title="belt_sim")
    def page() -> None:
        widgets.frame("/measurements")
        parts = [(ui.refreshable(draw), state) for draw, state in shown.items()]
        before = [state() for _, state in parts]

        def look() -> None:
            for k, (part, state) in enumerate(parts):
                if before[k] != state():
                    before[k] = state()
                    part.refresh()

        (notices, _), *others = parts
        with _drop(session):
            notices(session)
        for part, _ in others:
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

    async def sample() -> None:
        await run.io_bound(session.sample, str(chosen.value))

    room = f"Up to {MAX_UPLOAD // MEBI} MB at a time; they stay on this machine."
    kinds = f"A logger's CSV or Excel files; or {', '.join(FILES)}, or a zip of them."
    with widgets.card("1. Drop your files anywhere on this page", f"{kinds} {room}") as made:
        refuse = partial(session.end_drop, f"files: refused; {TOO_LARGE}")
        heard: dict[str, Any] = {"on_multi_upload": take_files, "on_rejected": lambda: refuse()}
        label = "Drop files here, or press +"
        upload = ui.upload(multiple=True, auto_upload=True, max_total_size=MAX_UPLOAD, label=label, **heard)
        upload.props("data-name=drop")
        ui.add_body_html(DROPS % upload.id)
        with ui.element("div").classes("line"):
            ui.label("No measurements at hand? A sample:").classes("soft small")
            chosen = ui.select(sample_campaigns(), value="slack_belt").props("dense outlined aria-label=sample")
            ui.button("Open it", on_click=sample).props("flat no-caps")
    return made


def _show_notices(session: Session) -> None:
    with ui.element("div").classes("card-lines").props(f"data-drops={session.drops}"):
        for line in session.messages:
            widgets.notice(line)


def asking(session: Session) -> None:
    """Draw the card of questions; nothing without a campaign."""
    if session.campaign is None or session.importing is not None:
        return

    def start(task: str) -> None:
        model, more = str(session.inputs["model"]), dict[str, Any]()
        if task == "compare":
            more = {"effects": session.effects or None}
        else:
            count = int(session.inputs["bootstraps"] or 0)
            more = {"total": count, "bootstraps": count, "seed": 0, "effects": session.inputs["candidates"] or None}
        try:
            session.start(task, model, **more)
        except BeltError as error:
            session.notify(*str(error).splitlines())

    with widgets.card("3. Ask", "Compare shows where a model fails; diagnose finds which physical effect it lacks."):
        titles = {BY_TENSION: f"by tension: {model_for_campaign(session.campaign)}"} | TITLES
        ui.select(titles, label="model").bind_value(session.inputs, "model").classes("w-full").props("data-name=model")
        if session.effects:
            names = ", ".join(str(e["id"]) for e in session.effects)
            with ui.element("div").classes("line"):
                ui.label(f"Compare uses the effects of {session.effects_name}: {names}")
                ui.button("Without them", on_click=lambda: session.take_effects([], "")).props("flat no-caps dense")
        with ui.expansion("More about the diagnosis").bind_value(session.inputs, "more").classes("w-full"):
            tried = partial(session.inputs.__setitem__, "candidates")
            widgets.effect_list("effects to try (none ticked: all)", session.inputs["candidates"], tried)
            count = ui.number("synthetic repeats to tell chance by", min=MIN_BOOTSTRAPS, precision=0)
            count.bind_value(session.inputs, "bootstraps").classes("w-full").props("data-name=bootstraps")
        with ui.element("div").classes("line"):
            for name, look in (("Compare", "no-caps outline"), ("Diagnose", "no-caps")):
                button = ui.button(name, on_click=partial(start, name.lower())).props(look)
                button.set_enabled(not session.busy)


HEADLINES = {"stopped": "Stopped", "failed": "No result", "finished": "Done"}
GOOD = ("adequate", "explained")


def job_view(session: Session) -> None:
    """The card of the latest work; nothing before the first."""
    job = session.job
    if job is None:
        return
    with widgets.card(f"4. {job.title}"):
        if job.running:
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
            ui.button("Stop", on_click=job.stop).props("no-caps outline color=negative").style("align-self: start")
            return
        ui.label(f"{HEADLINES[job.state]} after {job.seconds:.0f} s").classes("soft small")
        if job.state != "finished":
            return
        here = f"/results/{session.jobs.index(job) + 1}"
        content = json.loads((job.folder / SHOWN).read_text(encoding="utf-8"))
        if "verdict" in content:
            _show_diagnosis(session, here, content)
        else:
            _show_comparison(content)
        with ui.element("div").classes("line"):
            ui.link("Download everything (zip)", f"{here}/zip").props("data-name=download")
            for name in sorted(p.name for p in job.folder.glob("*.png")):
                ui.link(name, f"{here}/picture/{name}").props(f"download={name}").classes("small")
            folder = job.folder.relative_to(Path.cwd()) if job.folder.is_relative_to(Path.cwd()) else job.folder
            ui.label(f"also in {folder}").classes("soft small")


def _show_diagnosis(session: Session, here: str, content: dict[str, Any]) -> None:
    kind = "tie" if content["reserved"] else "good" if content["verdict"] in GOOD else ""
    for line in content["lines"]:
        widgets.notice(line, kind)
    with ui.element("div").classes("line"):
        ui.link("Report in a tab of its own", f"{here}/report", new_tab=True)
        ui.link("Report as a file", f"{here}/report").props("download=report.html")
        if content["effects"]:
            again = partial(session.take_effects, content["effects"], "the diagnosis")
            ui.button("Use what was found in compare", on_click=again).props("flat no-caps dense")
    ui.element("iframe").classes("report").props(f'sandbox="allow-scripts" src="{here}/report" title="report"')


def _show_comparison(content: dict[str, Any]) -> None:
    for line in content["lines"]:
        ui.label(line)
    panels = content["panels"]
    if panels:
        names = {k: p["title"] for k, p in enumerate(panels)}
        first = content["first"]
        chooser = ui.select(names, value=first, label="run and sensor").classes("w-full")
        ui.html(content["source"], sanitize=False).classes("source")
        drawn = ui.html(panels[first]["svg"], sanitize=False).classes("overlay").props("data-name=overlay")
        chooser.on_value_change(lambda e: drawn.set_content(panels[e.value]["svg"]))
    for t in content["tables"]:
        widgets.table(Table(**t))


# ---- what logger files seem to say

WHERE = {"": "–"} | {p: p.replace("_", " ") for p in PLACES}
#: setting of a run -> how it is written
OF_RUN = {"tension": "10 N/mm2", "yaw": "-0.042 deg", "speed": "0.5 m/s", "direction": "1"}
OF_RUN |= {"yaw_at": "0 m", "start": "3.2 m"}


@dataclass(frozen=True)
class AnswerForm:
    """Fields of the card; what is written in one is noted in ``draft`` at once, so that a page loaded anew shows it.

    A place may have two fields, in the table and in a question: the one that was changed last counts.
    """

    draft: dict[Place, str]

    def note(self, place: Place, value: object, shown: str) -> None:
        """Keep what stands in a field now, unless it is what stood there at first."""
        text = str(value or "").strip()
        if text != shown:
            self.draft[place] = text
        else:
            self.draft.pop(place, None)

    def select(self, place: Place, options: dict[str, str], value: str, label: str | None = None) -> None:
        """A menu; an answer that is none of its options is one more."""
        now = self.draft.get(place, value)
        shown = options if now in options else {now: now} | options
        made = ui.select(shown, value=now, label=label, on_change=lambda e: self.note(place, e.value, value))
        made.props(f"dense data-name='{_name(place)}'").classes("w-full")

    def input(self, place: Place, value: str, example: str, shown: str | None = None) -> None:
        """A line of text; ``shown``: what stands there at first without being an answer yet."""
        now = self.draft.get(place, value if shown is None else shown)
        if shown and shown != value:
            self.draft.setdefault(place, shown)  # taken unless it is changed
        made = ui.input(value=now, placeholder=example, on_change=lambda e: self.note(place, e.value, value))
        made.props(f"dense outlined hide-bottom-space data-name='{_name(place)}' aria-label='{_name(place)}'")
        made.classes("w-full")


def _name(place: Place) -> str:
    """A place as the page can name it."""
    return ".".join("".join(c if c.isalnum() or c == "_" else "_" for c in key) for key in place)


def import_view(session: Session) -> None:
    """Draw the card of the current import; nothing without one."""
    now = session.importing
    if now is None:
        return
    form = AnswerForm(now.draft)

    async def look_again() -> None:
        await run.io_bound(session.answer, dict(now.draft))

    async def take() -> None:
        await run.io_bound(session.take, dict(now.draft))

    why = "Correct the table, answer the questions, press Update. Then continue."
    with widgets.card("2. What your files seem to say", why):
        if now.proposal is not None:
            _columns(form, now, look_again)
        with ui.element("div").classes("halves"):
            for group in GROUPS:
                options = {"": "numbers of my own"} | {n: n for n in group_names(GROUPS[group])}
                form.select((group,), options, now.answers.get((group,), ""), label=group)
        with ui.element("div").classes("questions"):
            for q in (q for q in now.questions if q.path[-1] != "at"):  # places have their sketch
                with ui.element("div"):
                    ui.label(q.text[:1].upper() + q.text[1:])
                    value = now.answers.get(q.path, "")
                    if q.options:
                        form.select(q.path, {"": "choose"} | {o: o for o in q.options}, value)
                    else:
                        form.input(q.path, value, f"e.g. {q.example}", shown=value or q.proposed)
        if now.runs:
            with ui.element("div").classes("scroll"), ui.element("div").classes("grid runs"):
                for head in ("run", *(key.replace("_", " ") for key in OF_RUN)):
                    ui.label(head).classes("soft small")
                for name in now.runs:
                    ui.label(name)
                    for key, example in OF_RUN.items():
                        form.input(("runs", name, key), now.setting(name, key), example)
        ui.button("Update", on_click=look_again).props("no-caps outline").style("align-self: start")
        if now.ready:
            _show_proposal(now)
        with ui.element("div").classes("line"):
            ui.button("Use this data", on_click=take).props("no-caps").set_enabled(now.ready)
            ui.label(now.lacks).classes("soft small")


def _columns(form: AnswerForm, now: Import, look_again: Any) -> None:
    """A row a column: role, unit, place, sign, and why that is thought; and a sketch to say where sensors stand."""
    assert now.proposal is not None
    uses = {use.name: use for use in reversed(now.proposal.columns)}
    asked = [q.path[1] for q in now.proposal.missing if q.path[-1] == "at"]
    sensors = [n for n, use in reversed(uses.items()) if use.role == "signal" or n in asked]
    with ui.element("div").classes("grid columns"):
        for head in ("column", "is", "unit", "measured at", "sign", "because of"):
            ui.label(head).classes("soft small")
        for use in reversed(uses.values()):
            place: Place = ("columns", use.name)
            ui.label(use.name).classes("" if use.sure or use.role == "ignore" else "guess")
            form.select((*place, "role"), {r: r for r in ROLES}, use.role)
            form.input((*place, "unit"), use.unit, "mm")
            form.select((*place, "at"), WHERE, use.at)
            form.select((*place, "sign"), {"1": "+", "-1": "−"}, now.answers.get((*place, "sign"), "1"))
            ui.label(use.why).classes("soft small")
    if not sensors:
        return

    async def put(spot: str) -> None:
        now.draft["columns", str(chosen.value), "at"] = spot
        await look_again()

    ui.label("Where does each sensor stand? Choose it here, then press its place on the machine.").classes("soft small")
    with ui.element("div").classes("line"):
        first = next((n for n in sensors if not uses[n].at), sensors[0])
        chosen = ui.toggle(sensors, value=first).props("no-caps dense data-name=sensor")
    widgets.sketch({uses[n].at: n for n in sensors if uses[n].at}, put)


def _show_proposal(now: Import) -> None:
    assert now.proposal is not None
    assert now.proposal.campaign is not None
    _curves(now.proposal.campaign)
    with ui.expansion("All runs, the noise that was read off, remarks").classes("w-full"):
        widgets.table(imported_runs_table(now.proposal.campaign))
        if now.proposal.noise:
            widgets.table(noise_table(now.proposal))
            widgets.table(run_noise_table(now.proposal))
        for note in now.proposal.notes:
            ui.label(str(note)).classes("soft small")


# ---- the campaign


def campaign_view(session: Session) -> None:
    """Draw the card of the current campaign; nothing without one."""
    campaign = session.campaign
    if campaign is None or session.importing is not None:
        return

    def readings() -> None:
        ui.download.content(campaign.to_pandas().to_csv(index=False), "readings.csv")

    with widgets.card("2. What was understood", str(campaign)):
        tree = sheet_tree(campaign)
        numbers = {**tree["machine"], **tree["belt"]}
        shown = {n: words.with_u(q["value"], q["u"], q.get("unit", "")) for n, q in numbers.items()}
        widgets.facts({n.replace("_", " "): text for n, text in shown.items()}, "wide")
        for found in session.suspicions:
            widgets.notice(f"{found.kind.replace('_', ' ')}: {found}")
        _curves(campaign)
        with ui.element("div").classes("line"):
            if session.finished_import is not None:
                ui.button("Change how the files were read", on_click=session.back_to_import).props("flat no-caps dense")
            ui.link("Campaign (zip)", "/campaign").props("data-name=campaign")
            if any(r.signals for r in campaign.runs):
                ui.button("Readings (CSV)", on_click=readings).props("flat no-caps dense")
        with ui.expansion("All runs and sensors").classes("w-full"):
            widgets.table(imported_runs_table(campaign))
            rows = []
            for s in campaign.signals:
                noise = [words.thousandths(v) for v in (s.white, s.zero, s.wander_sd)]
                rows.append((s.name, s.at.replace("_", " "), *noise))
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
