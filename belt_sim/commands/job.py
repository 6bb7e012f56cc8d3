"""What Hydra runs of a command: its task, in a folder of its own, with errors told in a line."""

import importlib
import keyword
import os
import sys
from collections.abc import Callable
from typing import Any

from omegaconf import OmegaConf

from belt_sim.commands.failed import leave_failure
from belt_sim.commands.folder_name import folder_name
from belt_sim.commands.own_folder import own_folder
from belt_sim.commands.run_folder import run_folder
from belt_sim.errors import BeltError, Reported

# Hydra names the folders of a sweep by it, in every process that runs jobs
OmegaConf.register_new_resolver("folder_name", folder_name, replace=True)


class Jobs:
    """The jobs of one call of the command line: one, or those of a sweep, of which a failed one stops no other."""

    def __init__(self, command: str) -> None:
        self.command, self.started = command, False
        self.failures: list[str] = []
        self._here = os.getpid()

    def run(self, cfg: Any) -> Any:
        """Run the command's task on one configuration."""
        self.started = True
        try:
            with own_folder(run_folder(), self.command):
                return _task(self.command)(cfg)
        except BeltError as error:
            print(f"belt-sim: {error}", file=sys.stderr)
            leave_failure(str(error))
            self.failures.append(str(error))
            if os.getpid() != self._here:  # a parallel launcher's worker: only an exception reaches the parent
                raise Reported(str(error)) from error


def _task(command: str) -> Callable[[Any], Any]:
    """The function behind a command, imported only when it is asked for."""
    name = f"{command}_" if keyword.iskeyword(command) else command.replace("-", "_")
    return importlib.import_module(f"belt_sim.commands.{name}").run
