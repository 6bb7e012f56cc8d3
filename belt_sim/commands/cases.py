"""One run of a command, alone or as a case of a sweep: in its own folder, its errors told in one line."""

import importlib
import keyword
import sys
import traceback
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import BeltError

WITHOUT_FOLDER = ("app", "map", "report", "reveal", "scene")  # commands that say themselves where their files go


@dataclass(frozen=True)
class Outcome:
    """How a run ended. value: what the command returns; failure: empty when it went well."""

    value: float | None = None
    failure: str = ""


def task(command: str) -> Callable[..., Any]:
    """The function behind a command, imported only when it is needed."""
    name = f"{command}_" if keyword.iskeyword(command) else command.replace("-", "_")
    return importlib.import_module(f"belt_sim.commands.{name}").run


def run_alone(run: RunDir, **given: Any) -> float | None:
    """Run the command of ``run`` in its folder, and return what it returns."""
    with nullcontext() if run.command in WITHOUT_FOLDER else run.open():
        return task(run.command)(run, **given)  # type: ignore[no-any-return]


def run_case(run: RunDir, **given: Any) -> Outcome:
    """Run a case of a sweep unless its result is there; given: what the command takes beside its folder.

    A failure is told, stands in failed.txt of the case's folder, and stops no other case.
    """
    try:
        again = run.why_not_done()
        if again is None:
            print(f"done before, kept: {run.path}", flush=True)
            return Outcome(task(run.command)(run, done=True) if run.command == "simulate" else None)
        if again:
            print(f"runs again, {again}: {run.path}", flush=True)
        return Outcome(run_alone(run, **given))
    except BeltError as error:
        failure = str(error)
        print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
    except OSError as error:  # a full disk
        failure = f"{error.filename or run.path} = {error.strerror or error}"
        print(f"belt-sim: {failure}", file=sys.stderr, flush=True)
    except Exception as error:
        failure = f"{type(error).__name__}: {error}"
        traceback.print_exception(error, file=sys.stderr)
    fail(run, failure)
    return Outcome(failure=failure)


def fail(run: RunDir, message: str) -> None:
    """Write down why a case has failed; a disk that takes nothing more does not stop the other cases."""
    try:
        run.fail(message)
    except OSError as error:
        print(f"belt-sim: {run.path} = {error.strerror or error}", file=sys.stderr)
