"""State of the app: dropped files, the campaign, work and results. One per server: tabs share it.

A file is known by its last name only, so that no path in a name or in a zip leads anywhere else; nothing is unpacked
but the files of a campaign, and no more of them than ``MAX_UPLOAD``. Long work is the command that a terminal takes, in
a process of its own.
"""

import asyncio
import copy
import json
import os
import sys
import time
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from itertools import count
from pathlib import Path, PureWindowsPath
from typing import Any

from belt_sim.api.simulate import campaign_model
from belt_sim.campaign import Campaign, read_campaign
from belt_sim.campaign.folder import FILES
from belt_sim.campaign.sheet import SHEET_FILE as SHEET
from belt_sim.campaign.types import quote
from belt_sim.errors import BeltError, InputError
from belt_sim.importing import LoggedTables, Proposal, Question, read, understand, write
from belt_sim.importing.mapping import MAPPING_FILE, MAPPING_SCHEMA, inner_mapping, parse_mapping
from belt_sim.io import write_text
from belt_sim.model import BY_TENSION
from belt_sim.show.terminal import AS_JSON
from belt_sim.units import plain_minus

REPORT = "report.html"
MEBI = 2**20
MAX_UPLOAD = 256 * MEBI  # bytes of one request
TOO_LARGE = f"at most {MAX_UPLOAD // MEBI} MB at a time; drop fewer at once, or use belt-sim import in a terminal"
LOGGER_ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".asc", ".xlsx")
REMEDIES = {"campaign": "drop one campaign at a time", "mapping": "drop one", "logger": "give each file another name"}
WANTED = f"drop {', '.join(FILES)}, a zip of them, a logger's CSV or xlsx, or one YAML with schema: {MAPPING_SCHEMA}"


# ---- dropped files


def sort_files(dropped: Sequence[tuple[str, bytes]]) -> tuple[dict[str, dict[str, bytes]], list[str]]:
    """Files by what they are of (campaign, logger, mapping) and their names; a line for every one that is of no use."""
    found: dict[str, dict[str, bytes]] = {"campaign": {}, "logger": {}, "mapping": {}}
    messages = []
    for name, data in dropped:
        last = PureWindowsPath(name).name  # whatever system it came from
        known = last.lower()
        try:
            if known in FILES or known.endswith(".zip"):
                kind, files = "campaign", {known: data} if known in FILES else unpack(last, data)
            elif known == MAPPING_FILE or (known.endswith((".yaml", ".yml")) and MAPPING_SCHEMA.encode() in data):
                kind, files = "mapping", {last: data}
            elif known.endswith(LOGGER_ENDINGS):
                # what the name says of a run stays; what is no letter, digit or mark goes
                kept = "".join(c if c.isalnum() or c in " _-+.,()" else "_" for c in plain_minus(last)).lstrip(".")
                kind, files = "logger", {kept: data}
            else:
                raise InputError("file", quote(name), "", f"is not read by this page; {WANTED}")
            there = {n.lower() for n in found[kind]}
            twice = there if kind == "mapping" else there & {n.lower() for n in files}
            if twice:
                raise InputError("file", quote(name), "", f"{min(twice)} is there already; {REMEDIES[kind]}")
            found[kind] |= files
        except InputError as error:
            messages.append(str(error))
    return found, messages


def unpack(name: str, data: bytes) -> dict[str, bytes]:
    """The files of the one campaign in a zip: those beside its campaign.yaml, up to ``MAX_UPLOAD`` in all."""
    found = dict[str, bytes]()
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            names = set(archive.namelist())
            sheets = [n for n in names if PureWindowsPath(n).name == SHEET and "__MACOSX" not in n]
            if len(sheets) != 1:
                raise InputError("zip", quote(name), "", f"holds {len(sheets)} {SHEET}; zip the folder of one campaign")
            for file in FILES:
                if (member := f"{sheets[0].removesuffix(SHEET)}{file}") in names:
                    with archive.open(member) as stream:  # whatever the zip says of its size
                        found[file] = stream.read(max(MAX_UPLOAD + 1 - sum(map(len, found.values())), 0))
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, OSError, EOFError) as error:
        raise InputError("zip", quote(name), "", f"cannot be unpacked ({error}); zip it again") from error
    if sum(map(len, found.values())) > MAX_UPLOAD:
        raise InputError("zip", quote(name), "", f"unpacks to more than {MAX_UPLOAD // MEBI} MB; thin the signals out")
    return found


# ---- what a logger's files mean

KeyPath = tuple[str, ...]  # keys in the mapping, from the outside in
NAMED_GROUPS = {"machine": "rig", "belt": "belt"}  # what may be given by the name of one that is known


@dataclass
class Import:
    """Files of a logger, and what they mean with ``answers``: what was written into fields, "" where one was emptied;
    questions: open and answered ones; errors: what is wrong; lacks: why no campaign can be made yet, ""
    when one can; runs: what is known of each.
    """

    paths: Sequence[Path]
    base: Mapping[str, Any] = field(default_factory=dict)
    answers: dict[KeyPath, str] = field(default_factory=dict)
    questions: dict[KeyPath, Question] = field(default_factory=dict)
    proposal: Proposal | None = None
    errors: list[str] = field(default_factory=list)
    lacks: str = ""
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Read the files; raises CampaignError, InputError."""
        form = self.base.get("format")
        self.logged: LoggedTables = read(self.paths, form if isinstance(form, Mapping) else None)
        self.understand()

    def note(self, place: KeyPath, value: Any) -> None:
        """Take an answer; a machine or belt given by its name needs no numbers."""
        if place[0] in NAMED_GROUPS and len(place) == 1:
            self.answers = {p: a for p, a in self.answers.items() if p[0] != place[0]}
        if len(place) == 1 or not self.answers.get(place[:1]):
            self.answers[place] = str(value or "").strip()

    def understand(self) -> None:
        """Try what is known so far, what is proposed included; what cannot be is said, and the last that could be
        stays."""
        for q in self.proposal.missing if self.proposal else ():
            if q.proposed and not q.options and q.path not in self.answers:
                self.note(q.path, q.proposed)
        mapping = copy.deepcopy(dict(self.base))
        for place, text in self.answers.items():
            if text:
                inner_mapping(mapping, place[:-1])[place[-1]] = text
        try:
            self.proposal = understand(self.logged, mapping)
            self.errors = []
        except BeltError as error:
            self.errors = str(error).splitlines()

        missing = self.proposal.missing if self.proposal else ()
        more = f" And {len(missing) - 1} more." if len(missing) > 1 else ""
        wrong = self.errors or [f"{q.text.rstrip('?')}?{more}" for q in missing]
        self.lacks = f"Not yet: {wrong[0]}" if wrong else ""
        put = {q.path: q for q in missing}
        self.questions = {p: q for p, q in self.questions.items() if p in put or self.answers.get(p)} | put
        stated = self.proposal.mapping.get("runs", {}) if self.proposal else {}
        asked = [p[1] for p in put if p[0] == "runs"]
        self.runs = {name: dict(stated.get(name) or {}) for name in [*stated, *asked]}


# ---- long work


@dataclass
class Job:
    """A command with its settings; state: running, Done, No result or Stopped; said: what it printed;
    progress: its stage, about how long it takes [s], and whether it may take longer, in words."""

    task: str
    settings: Mapping[str, Any]
    folder: Path
    title: str
    state: str = "running"
    said: str = ""
    failure: str = ""
    progress: Mapping[str, Any] = field(default_factory=lambda: {"stage": "starting", "in_all_s": 0.0, "more": ""})
    began: float = field(default_factory=time.monotonic)
    ended: float | None = None
    process: Any = None

    async def run(self) -> None:
        """Start the command and listen to it until it ends."""
        self.folder.mkdir(parents=True, exist_ok=True)
        typed = [f"{key}={value}" for key, value in self.settings.items()]
        command = ["-m", "belt_sim", self.task, *typed, f"hydra.run.dir={self.folder.name}"]
        into: Any = {"stdout": asyncio.subprocess.PIPE, "stderr": asyncio.subprocess.STDOUT, "cwd": self.folder.parent}
        in_json = os.environ | {"COLUMNS": "100", AS_JSON: "1"}
        self.process = await asyncio.create_subprocess_exec(sys.executable, *command, env=in_json, **into)
        lines = []
        async for line in self.process.stdout:
            if line.startswith(b'{"stage"'):
                now = json.loads(line)
                self.progress = now | {"stage": now["stage"] or self.progress["stage"]}
            else:
                lines.append(line.decode(errors="replace").rstrip())
        self.said = "\n".join(lines).strip()
        status = await self.process.wait()
        write_text(self.folder / "log.txt", f"{self.said}\n")
        if self.state == "running":
            self.state, self.ended = "No result" if status else "Done", time.monotonic()
            told = [line.removeprefix("belt-sim: ") for line in lines if line.startswith("belt-sim: ")]
            where = f"it broke down (status {status}); log.txt in the folder of this result says where"
            self.failure = "\n".join(told or [where]) if status else ""

    def stop(self) -> None:
        """End the process."""
        self.state, self.ended = "Stopped", time.monotonic()
        if self.process is not None:
            with suppress(ProcessLookupError):
                self.process.kill()  # nothing of it is wanted, and a compilation hears nothing milder


@dataclass
class Session:
    """State of the page of measurements; version grows with every change that pages have to show. importing: also of
    the campaign shown, where it was made of a logger's files; inputs: what is asked of a campaign, at first with the
    model that the command line takes (more: whether the rest is unfolded).
    """

    folder: Path
    campaign: Campaign | None = None
    campaign_folder: Path | None = None
    importing: Import | None = None
    inputs: dict[str, Any] = field(default_factory=lambda: {"model": BY_TENSION, "candidates": [], "more": False})
    messages: list[str] = field(default_factory=list)
    jobs: list[Job] = field(default_factory=list)
    version: int = 0

    @property
    def busy(self) -> bool:
        return bool(self.jobs) and self.jobs[-1].state == "running"

    def notify(self, *messages: str, **changed: Any) -> None:
        """Let pages know, with lines to show, after what has ``changed`` here."""
        for name, value in changed.items():
            setattr(self, name, value)
        self.messages = list(messages)
        self.version += 1

    def new_folder(self, kind: str, files: Mapping[str, bytes]) -> Path:
        """A folder that was not there yet, with these files; none: it is not made yet."""
        folder = next(path for k in count(1) if not (path := self.folder / f"{kind}_{k}").exists())
        for name, data in files.items():
            folder.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        return folder

    def drop(self, files: Sequence[tuple[str, bytes]]) -> None:
        """Take dropped files: begin an import of a logger's files, or apply a mapping to those that are there; open a
        campaign, or add files that were missing in the one dropped before."""
        found, messages = sort_files(files)
        campaign, loggers, mappings = found.values()
        if SHEET in campaign and (beside := [*loggers, *mappings]):
            messages.append(f"{', '.join(map(quote, beside))}: not used beside {SHEET}; drop a logger's files alone")
            loggers, mappings = {}, {}
        try:
            if loggers or mappings:
                paths = self.importing.paths if self.importing else ()
                if loggers:
                    folder = self.new_folder("import", loggers)
                    paths = [folder / name for name in loggers]
                mapping: Any = {}
                for name, data in mappings.items():
                    mapping = parse_mapping(data.decode("utf-8-sig", errors="replace"), name).tree
                if paths:
                    self.importing, self.campaign = Import(paths, mapping), None
                else:
                    messages.append(f"{', '.join(mappings)}: drop the logger's files with it")
            if campaign:
                last = self.campaign_folder
                if SHEET not in campaign and last is not None:
                    campaign = {n: (last / n).read_bytes() for n in FILES if (last / n).is_file()} | campaign
                self.open_folder(self.new_folder("campaign", campaign))
        except BeltError as error:
            messages += str(error).replace(f"{self.folder}/", "").splitlines()
        self.notify(*messages)

    def update(self) -> None:
        """Look at the import again with what stands in its fields."""
        if self.importing is not None:
            self.importing.understand()
            self.notify(*self.importing.errors)

    def take(self) -> None:
        """Make the campaign that the import comes to with the last answers."""
        self.update()
        now = self.importing
        if now is None or now.proposal is None or now.lacks:
            return
        folder = self.new_folder("campaign", {})
        try:
            write(now.proposal, folder)
            self.open_folder(folder)
            self.notify(importing=now)
        except BeltError as error:
            self.notify(*str(error).splitlines())

    def open_folder(self, folder: Path) -> None:
        """Take the campaign of a folder; raises BeltError."""
        self.campaign, self.campaign_folder, self.importing = None, folder, None
        self.campaign = read_campaign(folder)

    async def work(self, task: str) -> None:
        """Do long work on the campaign as it is asked, one at a time."""
        asked, folder = self.inputs, self.campaign_folder
        if self.campaign is None or folder is None or self.busy:
            return
        settings: dict[str, Any] = {"campaign": folder.name, "model": asked["model"]}  # beside the job
        if task == "diagnose":
            settings |= {"seed": 0, "watch": "null"}
            settings |= {"effects": f"[{','.join(asked['candidates'])}]"} if asked["candidates"] else {}
        model = campaign_model({"name": asked["model"]}, self.campaign).name
        title = f"{'Diagnosis' if task == 'diagnose' else 'Comparison'} of {self.campaign.title}, {model}"
        job = Job(task, settings, self.folder / f"{task}_{len(self.jobs) + 1}", title)
        self.notify(jobs=[*self.jobs, job])
        await job.run()
        self.notify(*(job.failure.splitlines() or self.messages))  # what was said in the meantime stays
