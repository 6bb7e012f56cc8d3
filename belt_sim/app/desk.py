"""What lies on the desk: the campaign, the effects, work and results. One a server: tabs share it."""

import asyncio
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from belt_sim.app import intray
from belt_sim.app.effects_file import read_effects
from belt_sim.app.jobs import Job
from belt_sim.app.worker import SHOWN
from belt_sim.campaign import Campaign, Suspicion, read_campaign, suspicions
from belt_sim.campaign.read import FILES
from belt_sim.campaign.shipped import campaign_folder
from belt_sim.errors import BeltError, InputError

TITLES = {"compare": "Comparison", "diagnose": "Diagnosis"}


@dataclass
class Desk:
    """State of the page of measurements; version grows with every change that pages have to show."""

    folder: Path
    campaign: Campaign | None = None
    campaign_folder: Path | None = None
    suspicions: tuple[Suspicion, ...] = ()
    effects: list[dict[str, Any]] = field(default_factory=list)
    effects_name: str = ""
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
        tray = intray.sort_files(files)
        said = list(tray.said)
        if tray.campaign:
            said += self._campaign_from(tray)
        if tray.effects:
            try:
                self.effects, self.effects_name = read_effects(*tray.effects), tray.effects[0]
            except BeltError as error:
                said += str(error).splitlines()
        self.changed(*said)

    def _campaign_from(self, tray: intray.Tray) -> list[str]:
        """A new campaign, or files that were missing in the one dropped before."""
        before = {}
        if intray.SHEET not in tray.campaign and self.campaign_folder is not None:
            before = {n: (self.campaign_folder / n).read_bytes() for n in FILES if (self.campaign_folder / n).is_file()}
        self._drops += 1
        return self._open(intray.lay(self.folder / f"campaign_{self._drops}", {**before, **tray.campaign}))

    def sample(self, name: str) -> None:
        """Open a campaign that ships."""
        self.changed(*self._open(campaign_folder(name)))

    def _open(self, folder: Path) -> list[str]:
        self.campaign, self.campaign_folder, self.suspicions = None, folder, ()
        try:
            self.campaign = read_campaign(folder)
            self.suspicions = suspicions(self.campaign)
        except BeltError as error:
            return str(error).replace(f" in {folder}", "").splitlines()
        return []

    def take_effects(self, effects: list[dict[str, Any]], name: str) -> None:
        """Put effects on the desk."""
        self.effects, self.effects_name = effects, name
        self.changed()

    def forget_effects(self) -> None:
        """Take the effects off the desk."""
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
