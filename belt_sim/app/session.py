"""State of the app: the campaign, the effects, work and results. One per server: tabs share it."""

import asyncio
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from belt_sim.app import upload
from belt_sim.app.import_session import Import, Place, begin, read_mapping
from belt_sim.app.jobs import Job
from belt_sim.app.upload import read_effects
from belt_sim.app.worker import SHOWN
from belt_sim.campaign import Campaign, Suspicion, read_campaign, suspicions
from belt_sim.campaign.read import FILES, campaign_folder
from belt_sim.diagnosis.examine import BOOTSTRAPS
from belt_sim.errors import BeltError, InputError

TITLES = {"compare": "Comparison", "diagnose": "Diagnosis"}
#: what is asked of a campaign at first: of the model that controllers use
ASKED = {"model": "beam_th2", "candidates": [], "bootstraps": BOOTSTRAPS}


@dataclass
class Session:
    """State of the page of measurements; version grows with every change that pages have to show."""

    folder: Path
    campaign: Campaign | None = None
    campaign_folder: Path | None = None
    suspicions: tuple[Suspicion, ...] = ()
    importing: Import | None = None
    taken: Import | None = None
    effects: list[dict[str, Any]] = field(default_factory=list)
    effects_name: str = ""
    asked: dict[str, Any] = field(default_factory=lambda: dict(ASKED))
    said: list[str] = field(default_factory=list)
    jobs: list[Job] = field(default_factory=list)
    version: int = 0
    _drops: int = 0
    _listening: set[asyncio.Task[None]] = field(default_factory=set)

    @property
    def job(self) -> Job | None:
        """The latest work."""
        return self.jobs[-1] if self.jobs else None

    def changed(self, *said: str) -> None:
        """Let pages know, with lines to show."""
        self.said = list(said)
        self.version += 1

    def drop(self, files: list[tuple[str, bytes]]) -> None:
        """Take dropped files."""
        tray = upload.sort_files(files)
        said = list(tray.said)
        if tray.loggers or tray.mapping:
            said += self._import_from(tray)
        if tray.campaign:
            said += self._campaign_from(tray)
        if tray.effects:
            try:
                self.effects, self.effects_name = read_effects(*tray.effects), tray.effects[0]
            except BeltError as error:
                said += str(error).splitlines()
        self.changed(*said)

    def _campaign_from(self, tray: upload.Tray) -> list[str]:
        """A new campaign, or files that were missing in the one dropped before."""
        before = {}
        if upload.SHEET not in tray.campaign and self.campaign_folder is not None:
            before = {n: (self.campaign_folder / n).read_bytes() for n in FILES if (self.campaign_folder / n).is_file()}
        self._drops += 1
        self.taken = None
        return self._open(upload.write_files(self.folder / f"campaign_{self._drops}", {**before, **tray.campaign}))

    def _import_from(self, tray: upload.Tray) -> list[str]:
        """Begin an import of a logger's files, or apply a mapping to those that are there."""
        self._drops += 1
        before = self.importing or self.taken
        try:
            mapping = read_mapping(*tray.mapping) if tray.mapping else {}
            if tray.loggers:
                folder = upload.write_files(self.folder / f"import_{self._drops}" / "files", tray.loggers)
                self.importing = begin([folder / name for name in tray.loggers], mapping)
            elif before is None:
                return [f"{upload.MAPPING}: drop the logger's files with it"]
            else:
                self.importing = begin(before.files, mapping)
        except BeltError as error:
            return str(error).replace(f"{self.folder}/", "").splitlines()
        return []

    def answer(self, answers: Mapping[Place, Any]) -> None:
        """Tell the import what the files do not say."""
        if self.importing is not None:
            self.importing.answer(answers)
            self.changed(*self.importing.said)

    def take(self, answers: Mapping[Place, Any]) -> None:
        """Make the campaign that the import comes to with the last answers."""
        if answers:
            self.answer(answers)
        if self.importing is None or not self.importing.ready:
            return
        self._drops += 1
        try:
            folder = self.importing.write(self.folder / f"campaign_{self._drops}")
        except BeltError as error:
            self.changed(*str(error).splitlines())
            return
        self.taken, self.importing = self.importing, None
        self.changed(*self._open(folder))

    def back_to_import(self) -> None:
        """Change how the files were read."""
        self.importing = self.taken
        self.changed()

    def sample(self, name: str) -> None:
        """Open a campaign that ships."""
        self.taken = None
        self.changed(*self._open(campaign_folder(name)))

    def _open(self, folder: Path) -> list[str]:
        self.campaign, self.campaign_folder, self.suspicions = None, folder, ()
        self.importing = None
        try:
            self.campaign = read_campaign(folder)
            self.suspicions = suspicions(self.campaign)
        except BeltError as error:
            return str(error).replace(f" in {folder}", "").splitlines()
        return []

    def take_effects(self, effects: list[dict[str, Any]], name: str) -> None:
        """Use these effects in comparisons."""
        self.effects, self.effects_name = effects, name
        self.changed()

    def forget_effects(self) -> None:
        """Forget the effects."""
        self.effects, self.effects_name = [], ""
        self.changed()

    def start(self, task: str, model: str, *, total: int = 0, **request: Any) -> Job:
        """Begin long work on the campaign; raises InputError while other work goes on."""
        if self.campaign is None:
            raise InputError("campaign", "none", "", "drop the files of a campaign first")
        if self.job is not None and self.job.running:
            raise InputError(task, "not begun", "", f"{self.job.title} is still going on; wait, or stop it")
        number = len(self.jobs) + 1
        folder = self.folder / f"{task}_{number}"
        asked = {"task": task, "model": model, "campaign": str(self.campaign_folder), "folder": str(folder), **request}
        job = Job(asked, folder, f"{TITLES[task]} of {self.campaign.title}, {model}", total)
        self.jobs.append(job)
        self.changed()
        listening = asyncio.create_task(self._listen(job))
        self._listening.add(listening)
        listening.add_done_callback(self._listening.discard)
        return job

    async def _listen(self, job: Job) -> None:
        await job.run()
        self.changed(*job.failure.splitlines())

    async def close(self) -> None:
        """End what still goes on."""
        for job in self.jobs:
            if job.running:
                await job.stop()


def shown(job: Job) -> dict[str, Any]:
    """What the worker left for the page."""
    return json.loads((job.folder / SHOWN).read_text(encoding="utf-8"))
