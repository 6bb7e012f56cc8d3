"""Long work beside the page: a process of its own that tells how far it is and can be stopped."""

import asyncio
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from belt_sim.errors import BeltError
from belt_sim.jax_setup import prepare

SPAWN = multiprocessing.get_context("spawn")
PATIENCE = 3.0  # [s] from asking a process to end to ending it
NICE = 5  # the page goes first
TITLES = {"compare": "Comparison", "diagnose": "Diagnosis"}


@dataclass
class Job:
    """One request to a worker; state: running, finished, failed or stopped; done: share of the work, 0 where nothing
    tells it; shown: what the page shows of its result."""

    request: Mapping[str, Any]
    folder: Path
    title: str
    state: str = "running"
    stage: str = "starting"
    failure: str = ""
    done: float = 0.0
    in_all: float | None = None
    shown: Mapping[str, Any] = field(default_factory=dict)
    began: float = field(default_factory=time.monotonic)
    ended: float | None = None
    process: Any = None

    @property
    def running(self) -> bool:
        return self.state == "running"

    @property
    def seconds(self) -> float:
        return (self.ended or time.monotonic()) - self.began

    async def run(self) -> None:
        """Start the worker and listen to it until it ends."""
        self.folder.mkdir(parents=True, exist_ok=True)
        ear, mouth = SPAWN.Pipe(duplex=False)
        self.process = SPAWN.Process(target=work, args=(dict(self.request), self.folder, mouth), daemon=True)
        self.process.start()
        mouth.close()
        with suppress(EOFError):
            while self.running:
                said = await asyncio.to_thread(ear.recv)
                self.stage = said.get("stage", self.stage)
                if said.get("done"):
                    self.done += said["done"]
                    self.in_all = self.seconds / self.done  # [s], about
                self.shown = said.get("shown", self.shown)
                if "shown" in said or "failed" in said:
                    self._end("finished" if "shown" in said else "failed", said.get("failed", ""))
        await asyncio.to_thread(self.process.join)
        status = self.process.exitcode
        self._end("failed", f"the computation ended by itself (status {status}); see log.txt in its folder")

    def _end(self, state: str, failure: str = "") -> None:
        if self.running:
            self.state, self.failure, self.ended = state, failure, time.monotonic()

    async def stop(self) -> None:
        self._end("stopped")
        if self.process is not None:
            self.process.terminate()
            await asyncio.to_thread(self.process.join, PATIENCE)
            self.process.kill()


def work(request: Mapping[str, Any], folder: Path, mouth: Any) -> None:
    """Do what is asked in this process and tell of it through ``mouth``; what is printed goes to log.txt."""
    if hasattr(os, "nice"):
        os.nice(NICE)
    with (folder / "log.txt").open("wb") as log:
        os.dup2(log.fileno(), 1), os.dup2(log.fileno(), 2)

    def leave_with_the_asker() -> None:
        multiprocessing.parent_process().join()  # type: ignore[union-attr]
        os.kill(os.getpid(), signal.SIGTERM)

    def say(**message: Any) -> None:
        mouth.send(message)

    threading.Thread(target=leave_with_the_asker, daemon=True).start()
    try:
        prepare()
        say(stage="reading")
        say(shown=(_compare if request["task"] == "compare" else _diagnose)(request, folder, say))
    except BeltError as error:
        say(failed=str(error))
    except Exception as error:
        traceback.print_exc()
        say(failed=f"it broke down ({type(error).__name__}: {error}); log.txt in the folder of this result says where")


def _compare(request: Mapping[str, Any], folder: Path, say: Callable[..., None]) -> dict[str, Any]:
    from belt_sim.api.inference import compare
    from belt_sim.api.plot import overlays_of, write_comparison

    say(stage="computing every run")
    found = compare(request["campaign"], request["model"], request["effects"], config=dict(request))
    say(stage="drawing")
    write_comparison(folder, found, pictures=True)
    return {"lines": list(found.lines()), "tables": list(found.tables()), **overlays_of(found)}


def _diagnose(request: Mapping[str, Any], folder: Path, say: Callable[..., None]) -> dict[str, Any]:
    from belt_sim.api.inference import diagnose
    from belt_sim.api.plot import write_diagnosis
    from belt_sim.show.observers import in_stages

    stages = in_stages(lambda share, stage: say(done=share, **({"stage": stage} if stage else {})), 1)
    asked = {k: request[k] for k in ("effects", "bootstraps", "seed")}
    found = diagnose(request["campaign"], request["model"], **asked, progress=stages, config=dict(request))
    say(stage="drawing")
    write_diagnosis(folder, found, pictures=True)
    effects = [e.law or {"id": e.id, **e.numbers} for e in found.effects if e.source_file is None]
    told = {"verdict": str(found.verdict), "reserved": bool(found.tied or found.reserved)}
    return told | {"lines": [found.sentence], "effects": effects}
