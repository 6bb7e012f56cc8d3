"""Long work beside the page: a process of its own that tells how far it is and can be stopped."""

import asyncio
import contextlib
import json
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

WORKER = "belt_sim.app.worker"
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
        """Whether it still goes on."""
        return self.state == "running"

    @property
    def seconds(self) -> float:
        """How long it has been going on, or took."""
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
            self._hear(line)
        status = await self._process.wait()
        if self.running:
            self._end("failed", f"the computation ended by itself (status {status}); see log.txt in its folder")

    def _hear(self, line: bytes) -> None:
        with contextlib.suppress(ValueError):
            said = json.loads(line)
            self.stage = said.get("stage", self.stage)
            self.done += said.get("done", 0)
            if said.get("finished"):
                self._end("finished")
            elif "failed" in said:
                self._end("failed", said["failed"])

    def _end(self, state: str, failure: str = "") -> None:
        if self.running:
            self.state, self.failure, self.ended = state, failure, time.monotonic()

    async def stop(self) -> None:
        """End the process."""
        self._end("stopped")
        if self._process is None or self._process.returncode is not None:
            return
        for end in (self._process.terminate, self._process.kill):
            with contextlib.suppress(ProcessLookupError):
                end()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._process.wait(), PATIENCE)
                return
