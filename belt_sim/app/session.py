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
from belt_sim.campaign import Campaign, Suspicion, read_campaign, suspicions
from belt_sim.campaign.folder import FILES
from belt_sim.campaign.sheet import SHEET_FILE as SHEET
from belt_sim.campaign.types import quote
from belt_sim.diagnosis.examine import BOOTSTRAPS
from belt_sim.errors import BeltError, InputError
from belt_sim.importing import LoggedTables, Proposal, Question, read, understand, write
from belt_sim.importing.mapping import MAPPING_FILE, MAPPING_SCHEMA, inner_mapping, parse_mapping
from belt_sim.io import write_text
from belt_sim.model import BY_TENSION
from belt_sim.show.terminal import AS_JSON
from belt_sim.units import plain_minus

REPORT = "report.html"
TASK_TITLES = {"compare": "Comparison", "diagnose": "Diagnosis"}
MEBI = 2**20
MAX_UPLOAD = 256 * MEBI  # bytes of one request
TOO_LARGE = (
    f"at most {MAX_UPLOAD // MEBI} MB at a time; drop fewer at once, or give them to belt-sim import in a terminal"
)
LOGGER_ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".asc", ".xlsx")
LONGEST_FILE_NAME = 120  # characters
NO_CODE = "effects are not read by this page; name them in a terminal: belt-sim diagnose effects=[my_effect.py]"
WANTED_FILES = f"drop {', '.join(FILES)}, a zip of them, a logger's CSV or xlsx, or "
WANTED_FILES += f"one YAML with schema: {MAPPING_SCHEMA}"


# ---- dropped files


@dataclass
class Tray:
    """Dropped files sorted: of a campaign, of a logger, a mapping and its name; messages: what not."""

    campaign: dict[str, bytes] = field(default_factory=dict)
    loggers: dict[str, bytes] = field(default_factory=dict)
    mapping: bytes | None = None
    mapping_name: str = MAPPING_FILE
    messages: list[str] = field(default_factory=list)


def sort_files(dropped: Sequence[tuple[str, bytes]]) -> Tray:
    """Sort files by their names; every one that cannot be used has its line."""
    tray = Tray()
    for name, data in dropped:
        last, remedy = PureWindowsPath(name).name, ""  # whatever system it came from
        known = last.lower()
        if known in FILES or known.endswith(".zip"):
            try:
                found = {known: data} if known in FILES else unpack(last, data)
            except InputError as error:
                tray.messages.append(str(error))
                continue
            if twice := [*(found.keys() & tray.campaign.keys())]:
                remedy = f"{twice[0]} was dropped twice, the first is kept; drop one campaign at a time"
            tray.campaign = found | tray.campaign
        elif known == MAPPING_FILE or (known.endswith((".yaml", ".yml")) and MAPPING_SCHEMA.encode() in data):
            if tray.mapping is not None:
                remedy = f"{tray.mapping_name} is the mapping already; drop one"
            else:
                tray.mapping, tray.mapping_name = data, last
        elif known.endswith(LOGGER_ENDINGS):
            # what the name says of a run stays; what is no letter, digit or mark goes
            kept = "".join(c if c.isalnum() or c in " _-+.,()" else "_" for c in plain_minus(last)).lstrip(".")
            stem, _, end = kept.rpartition(".")
            stem, taken = stem[-LONGEST_FILE_NAME:] or "_", {n.lower() for n in tray.loggers}
            names = (f"{stem}{f'_{k}' * (k > 1)}.{end}" for k in count(1))
            kept = next(n for n in names if n.lower() not in taken)
            if kept != f"{stem}.{end}":
                tray.messages.append(f"{quote(name)}: another file has this name; this one is kept as {kept}")
            tray.loggers[kept] = data
        else:
            remedy = NO_CODE if known.endswith((".py", "effects.yaml")) else WANTED_FILES
        if remedy:
            tray.messages.append(str(InputError("file", quote(name), "", remedy)))
    return tray


def unpack(name: str, data: bytes) -> dict[str, bytes]:
    """The files of the one campaign in a zip: those beside its campaign.yaml, up to ``MAX_UPLOAD`` in all."""
    found = dict[str, bytes]()
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            names = set(archive.namelist())
            sheets = [n for n in names if PureWindowsPath(n).name == SHEET and "__MACOSX" not in n]
            for file in FILES if len(sheets) == 1 else ():
                if (member := f"{sheets[0].removesuffix(SHEET)}{file}") in names:
                    with archive.open(member) as stream:  # whatever the zip says of its size
                        found[file] = stream.read(max(MAX_UPLOAD + 1 - sum(map(len, found.values())), 0))
        why = f"holds {f'{len(sheets)} campaigns' if sheets else f'no {SHEET}'}; zip the folder of one campaign"
        if len(sheets) == 1 and sum(map(len, found.values())) <= MAX_UPLOAD:
            return found
        if found:
            why = f"unpacks to more than {MAX_UPLOAD // MEBI} MB; thin the signals out"
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, OSError, EOFError) as error:
        why = f"cannot be unpacked ({error}); zip it again"
    raise InputError("zip", quote(name), "", why)


# ---- what a logger's files mean

KeyPath = tuple[str, ...]  # keys in the mapping, from the outside in
NAMED_GROUPS = {"machine": "rig", "belt": "belt"}  # what may be given by the name of one that is known


@dataclass
class Import:
    """Files as read, and what they mean with ``answers``: what was written into fields, "" where one was emptied;
    all_questions: those that were ever put; errors: what is wrong. By the last ``understand``: lacks: why no campaign
    can be made yet, "" when one can; questions: open and answered ones that have no place in the tables of columns and
    runs; runs: what is known of each.
    """

    logged: LoggedTables
    base: Mapping[str, Any]
    answers: dict[KeyPath, str] = field(default_factory=dict)
    all_questions: dict[KeyPath, Question] = field(default_factory=dict)
    proposal: Proposal | None = None
    errors: list[str] = field(default_factory=list)
    answered: bool = True
    lacks: str = ""
    questions: list[Question] = field(default_factory=list)
    runs: dict[str, dict[str, Any]] = field(default_factory=dict)

    def note(self, place: KeyPath, value: Any) -> None:
        """Take an answer; a machine or belt given by its name needs no numbers."""
        if place[0] in NAMED_GROUPS and len(place) == 1:
            self.answers = {p: a for p, a in self.answers.items() if p[0] != place[0]}
        if len(place) == 1 or not self.answers.get(place[:1]):
            self.answers[place], self.answered = str(value or "").strip(), False

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
            self.errors, self.answered = [], True
            self.all_questions |= {q.path: q for q in self.proposal.missing}
        except BeltError as error:
            self.errors = str(error).splitlines()

        missing = self.proposal.missing if self.proposal else ()
        more = f" And {len(missing) - 1} more." if len(missing) > 1 else ""
        self.lacks = f"Not yet: {missing[0].text.rstrip('?')}?{more}" if missing else ""
        if self.errors:
            self.lacks = f"Not yet: {self.errors[0]}"
        put = {p for p, a in self.answers.items() if a} | {q.path for q in missing}
        self.questions = [q for place, q in self.all_questions.items() if place in put and place[0] != "runs"]
        stated = self.proposal.mapping.get("runs", {}) if self.proposal else {}
        self.runs = {name: dict(run or {}) for name, run in stated.items()}
        for place in (p for p in (*self.all_questions, *self.answers) if p[0] == "runs"):
            run = self.runs.setdefault(place[1], {})
            run[place[2]] = self.answers.get(place, run.get(place[2]))


def begin_import(paths: Sequence[Path], mapping: Mapping[str, Any] | None = None) -> Import:
    """Read the files; raises CampaignError, InputError."""
    base = dict(mapping or {})
    form = base.get("format")
    made = Import(read(paths, form if isinstance(form, Mapping) else None), base)
    made.understand()
    return made


# ---- long work

END_PATIENCE = 3.0  # [s] from asking a process to end to ending it


@dataclass
class Job:
    """A command with its settings; state: running, finished, failed or stopped; said: what it printed;
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
        pipes: Any = {"stdout": asyncio.subprocess.PIPE, "stderr": asyncio.subprocess.PIPE}
        self.process = await asyncio.create_subprocess_exec(
            sys.executable, *command, cwd=self.folder.parent, env=os.environ | {"COLUMNS": "100", AS_JSON: "1"}, **pipes
        )
        printed = asyncio.create_task(self.process.stdout.read())
        lines = []
        async for line in self.process.stderr:
            if line.startswith(b'{"stage"'):
                now = json.loads(line)
                self.progress = now | {"stage": now["stage"] or self.progress["stage"]}
            else:
                lines.append(line.decode(errors="replace").rstrip())
        self.said = (await printed).decode(errors="replace").strip()
        status = await self.process.wait()
        write_text(self.folder / "log.txt", "\n".join([*lines, self.said, ""]))
        if self.state == "running":
            self.state, self.ended = "failed" if status else "finished", time.monotonic()
            told = [line.removeprefix("belt-sim: ") for line in lines if line.startswith("belt-sim: ")]
            where = f"it broke down (status {status}); log.txt in the folder of this result says where"
            self.failure = "\n".join(told or [where]) if status else ""

    async def stop(self) -> None:
        """End the process, by force where it does not hear."""
        self.state, self.ended = "stopped", time.monotonic()
        if self.process is not None and self.process.returncode is None:
            self.process.terminate()
            with suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self.process.wait(), END_PATIENCE)
                return
            self.process.kill()


@dataclass
class Session:
    """State of the page of measurements; version grows with every change that pages have to show, and drops with
    every drop that was dealt with. inputs: what is asked of a campaign, at first with the model that the command line
    takes (more: whether the rest is unfolded).
    """

    folder: Path
    campaign: Campaign | None = None
    campaign_folder: Path | None = None
    suspicions: tuple[Suspicion, ...] = ()
    importing: Import | None = None
    finished_import: Import | None = None
    inputs: dict[str, Any] = field(
        default_factory=lambda: {"model": BY_TENSION, "candidates": [], "bootstraps": BOOTSTRAPS, "more": False}
    )
    messages: list[str] = field(default_factory=list)
    jobs: list[Job] = field(default_factory=list)
    version: int = 0
    drops: int = 0

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
        """A folder that was not there yet, with these files of a tray; none: it is not made yet."""
        folder = next(path for k in count(1) if not (path := self.folder / f"{kind}_{k}").exists())
        for name, data in files.items():
            folder.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        return folder

    def drop(self, files: Sequence[tuple[str, bytes]]) -> None:
        """Take dropped files: begin an import of a logger's files, or apply a mapping to those that are there; open a
        campaign, or add files that were missing in the one dropped before."""
        tray = sort_files(files)
        messages, before = tray.messages, self.importing or self.finished_import
        if SHEET in tray.campaign and (beside := [*tray.loggers, *([tray.mapping_name] * (tray.mapping is not None))]):
            messages.append(f"{', '.join(map(quote, beside))}: not used beside {SHEET}; drop a logger's files alone")
            tray.loggers, tray.mapping = {}, None
        try:
            if tray.loggers or tray.mapping is not None:
                paths = list(dict.fromkeys(table.file for table in before.logged)) if before else []
                if tray.loggers:
                    folder = self.new_folder("import", tray.loggers)
                    paths = [folder / name for name in tray.loggers]
                mapping: Any = {}
                if tray.mapping is not None:
                    mapping = parse_mapping(tray.mapping.decode("utf-8-sig", errors="replace"), tray.mapping_name).tree
                if paths:
                    self.importing = begin_import(paths, mapping)
                else:
                    messages.append(f"{tray.mapping_name}: drop the logger's files with it")
            if tray.campaign:
                last, there = self.campaign_folder, dict[str, bytes]()
                if SHEET not in tray.campaign and last is not None:
                    there = {n: (last / n).read_bytes() for n in FILES if (last / n).is_file()}
                messages += self.open_folder(self.new_folder("campaign", there | tray.campaign))
        except BeltError as error:
            messages += str(error).replace(f"{self.folder}/", "").splitlines()
        self.notify(*messages, drops=self.drops + 1)

    def update(self) -> None:
        """Look at the import again with what stands in its fields."""
        if self.importing is not None:
            self.importing.understand()
            self.notify(*self.importing.errors)

    def take(self) -> None:
        """Make the campaign that the import comes to with the last answers."""
        now = self.importing
        if now is not None and not now.answered:
            self.update()
        if now is None or now.proposal is None or now.lacks:
            return
        folder = self.new_folder("campaign", {})
        try:
            write(now.proposal, folder)
        except BeltError as error:
            self.notify(*str(error).splitlines())
            return
        self.notify(*self.open_folder(folder), finished_import=now)

    def open_folder(self, folder: Path) -> list[str]:
        """Take the campaign of a folder; returns what is wrong with it."""
        self.campaign, self.campaign_folder, self.suspicions = None, folder, ()
        self.importing = self.finished_import = None
        try:
            self.campaign = read_campaign(folder)
            self.suspicions = suspicions(self.campaign)
        except BeltError as error:
            return str(error).replace(f" in {folder}", "").splitlines()
        return []

    async def work(self, task: str) -> None:
        """Do long work on the campaign as it is asked; raises InputError while other work goes on."""
        if self.campaign is None or self.campaign_folder is None:
            raise InputError("campaign", "none", "", "drop the files of a campaign first")
        if self.busy:
            raise InputError(task, "not begun", "", f"{self.jobs[-1].title} is still going on; wait, or stop it")
        asked, folder = self.inputs, self.campaign_folder
        settings: dict[str, Any] = {"campaign": folder.name, "model": asked["model"]}  # beside the job, or a sample
        if task == "diagnose":
            settings |= {"bootstraps": int(asked["bootstraps"] or 0), "seed": 0, "watch": "null"}
            settings |= {"effects": f"[{','.join(asked['candidates'])}]"} if asked["candidates"] else {}
        model = campaign_model({"name": asked["model"]}, self.campaign).name
        title = f"{TASK_TITLES[task]} of {self.campaign.title}, {model}"
        job = Job(task, settings, self.folder / f"{task}_{len(self.jobs) + 1}", title)
        self.notify(jobs=[*self.jobs, job])
        await job.run()
        self.notify(*(job.failure.splitlines() or self.messages))  # what was said in the meantime stays
