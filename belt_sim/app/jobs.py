"""Long work beside the page: a process of its own that tells how far it is and can be stopped."""

import asyncio
import contextlib
import json
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from belt_sim.errors import BeltError
from belt_sim.io import write_json

WORKER = "belt_sim.app.jobs"  # this module, run by itself
PATIENCE = 3.0  # [s] from asking a process to end to ending it
LONGEST_LINE = 2**20  # bytes


@dataclass
class Job:
    """One request to the worker; state: running, finished, failed or stopped; total: steps that ``done`` counts to."""

    request: Mapping[str, Any]
    folder: Path
    title: str
    total: int = 0
    state: str = "running"
    stage: str = "starting"
    failure: str = ""
    done: int = 0
    began: float = field(default_factory=time.monotonic)
    ended: float | None = None
    _process: asyncio.subprocess.Process | None = None

    @property
    def running(self) -> bool:
        return self.state == "running"

    @property
    def seconds(self) -> float:
        return (self.ended or time.monotonic()) - self.began

    @property
    def share(self) -> float | None:
        """How much of what counts is done, 0 to 1; None before and after."""
        return self.done / self.total if 0 < self.done < self.total else None

    async def run(self) -> None:
        """Start the worker and listen to it until it ends."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / "log.txt").open("wb") as log:
            self._process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", WORKER),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                stderr=log,
                limit=LONGEST_LINE,
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(dict(self.request)).encode() + b"\n")
        async for line in self._process.stdout:
            with contextlib.suppress(ValueError):
                said = json.loads(line)
                self.stage = said.get("stage", self.stage)
                self.done += said.get("done", 0)
                if said.get("finished") or "failed" in said:
                    self._end("finished" if said.get("finished") else "failed", said.get("failed", ""))
        status = await self._process.wait()
        if self.running:
            self._end("failed", f"the computation ended by itself (status {status}); see log.txt in its folder")

    def _end(self, state: str, failure: str = "") -> None:
        if self.running:
            self.state, self.failure, self.ended = state, failure, time.monotonic()

    async def stop(self) -> None:
        self._end("stopped")
        if self._process is None or self._process.returncode is not None:
            return
        for end in (self._process.terminate, self._process.kill):
            with contextlib.suppress(ProcessLookupError):
                end()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._process.wait(), PATIENCE)
                return


# The other side: the request comes as one JSON line, answers go out as JSON lines, until standard input ends.

SHOWN = "shown.json"  # what the page shows of a result
NICE = 5  # the page goes first


def work() -> None:
    """Do what the first line of standard input asks for."""
    out = sys.stdout
    if hasattr(os, "nice"):
        os.nice(NICE)

    def say(**message: Any) -> None:
        out.write(json.dumps(message) + "\n")
        out.flush()

    def leave_with_the_asker() -> None:
        sys.stdin.read()
        os.kill(os.getpid(), signal.SIGTERM)

    request = json.loads(sys.stdin.readline())
    threading.Thread(target=leave_with_the_asker, daemon=True).start()
    try:
        with redirect_stdout(sys.stderr):  # what others print goes to the log
            from belt_sim.app.session import refuse_code

            for entry in request["effects"] or []:  # wherever they come from
                refuse_code(str(entry["id"] if isinstance(entry, Mapping) else entry))
            say(stage="reading")
            shown = (_compare if request["task"] == "compare" else _diagnose)(request, say)
            write_json(Path(request["folder"]) / SHOWN, json.loads(json.dumps(shown, default=str)))
        say(finished=True)
    except BeltError as error:
        say(failed=str(error))
    except Exception as error:
        traceback.print_exc()
        say(failed=f"it broke down ({type(error).__name__}: {error}); log.txt in the folder of this result says where")


def _compare(request: Mapping[str, Any], say: Callable[..., None]) -> dict[str, Any]:
    """Compare, write the result, and return what the page shows of it."""
    from belt_sim.api.inference import compare
    from belt_sim.api.plot import overlays_of, write_comparison

    say(stage="computing every run")
    found = compare(request["campaign"], request["model"], request["effects"], config=dict(request))
    say(stage="drawing")
    write_comparison(Path(request["folder"]), found, pictures=True)
    return {"lines": list(found.lines()), "tables": [vars(t) for t in found.tables()], **overlays_of(found)}


def _diagnose(request: Mapping[str, Any], say: Callable[..., None]) -> dict[str, Any]:
    """Diagnose, write the result, and return what the page shows of it."""
    from belt_sim.api.inference import diagnose
    from belt_sim.api.plot import write_diagnosis

    def progress(replicates: int, stage: str) -> None:
        say(done=replicates, **({"stage": stage} if stage else {}))

    asked = {k: request[k] for k in ("effects", "bootstraps", "seed")}
    found = diagnose(request["campaign"], request["model"], **asked, progress=progress, config=dict(request))
    say(stage="drawing")
    write_diagnosis(Path(request["folder"]), found, pictures=True)
    effects = [e.law or {"id": e.id, **e.numbers} for e in found.effects if e.source_file is None]
    return {
        "verdict": str(found.verdict),
        "reserved": bool(found.tied or found.beyond),
        "lines": [found.sentence],
        "effects": effects,
    }


if __name__ == "__main__":
    from belt_sim.jax_setup import prepare

    prepare()
    work()
