"""Long work beside the page: a command of belt_sim in a process of its own, which can be stopped.

It is the command that a terminal takes, so that both give one answer.
"""

import asyncio
import json
import os
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from belt_sim.io import write_text
from belt_sim.show.observers import AS_JSON

PATIENCE = 3.0  # [s] from asking a process to end to ending it


@dataclass
class Job:
    """A command with its settings; state: running, finished, failed or stopped; said: what it printed;
    in_all: about how long it takes [s]; more: whether it may take longer, in words."""

    task: str
    settings: Mapping[str, Any]
    folder: Path
    title: str
    state: str = "running"
    stage: str = "starting"
    said: str = ""
    failure: str = ""
    in_all: float = 0.0
    more: str = ""
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
        """Start the command and listen to it until it ends."""
        self.folder.mkdir(parents=True, exist_ok=True)
        typed = [f"{key}={value}" for key, value in self.settings.items()]
        command = ["-m", "belt_sim", self.task, *typed, f"hydra.run.dir={self.folder.name}"]
        pipes = {"stdout": asyncio.subprocess.PIPE, "stderr": asyncio.subprocess.PIPE}
        self.process = await asyncio.create_subprocess_exec(
            sys.executable, *command, cwd=self.folder.parent, env=os.environ | {"COLUMNS": "100", AS_JSON: "1"}, **pipes
        )
        printed = asyncio.create_task(self.process.stdout.read())
        lines = []
        async for line in self.process.stderr:
            if line.startswith(b'{"stage"'):
                now = json.loads(line)
                self.stage, self.in_all, self.more = now["stage"] or self.stage, now["in_all_s"], now["more"]
            else:
                lines.append(line.decode(errors="replace").rstrip())
        self.said = (await printed).decode(errors="replace").strip()
        status = await self.process.wait()
        write_text(self.folder / "log.txt", "\n".join([*lines, self.said, ""]))
        if self.running:
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
                await asyncio.wait_for(self.process.wait(), PATIENCE)
                return
            self.process.kill()
