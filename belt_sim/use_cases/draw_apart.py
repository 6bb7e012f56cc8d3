"""Pictures of a diagnosis drawn by a process of their own, beside what is left of the diagnosis, report and recording.

The process is started before there is anything to draw, so that it has imported what it needs when a result comes:
through its standard input, a line each, as the files of a diagnosis hold it. Pictures lie in a hidden folder until all
are drawn: a diagnosis that is stopped leaves none without its report. As ``python -m
belt_sim.use_cases.draw_apart`` this file is that process.
"""

import gc

if __name__ == "__main__":
    gc.disable()  # this process ends soon; objects of imports alone are looked through for a fifth of a second

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from belt_sim.errors import BeltError
from belt_sim.files import moved_in, pictures_of

if TYPE_CHECKING:  # results are imported when there are any: the process begins before
    from belt_sim.results.diagnosis import Diagnosis

Draw = Callable[[Path, "Diagnosis"], None]


@contextmanager
def drawing_apart() -> Iterator[Draw]:
    """A function that begins to draw a diagnosis into a folder; all is drawn, and there, when the block has ended.

    It may be called again when something was discovered as well: what is drawn already is not drawn again. Raises
    BeltError when a picture could not be drawn.
    """
    process = _begun()
    asked, folders = process.stdin, set[Path]()
    assert asked is not None

    def draw(folder: Path, diagnosis: "Diagnosis") -> None:
        from belt_sim.results.json import diagnosis_json, drawings_json

        folders.add(folder)
        task = {"diagnosis": diagnosis_json(diagnosis), "drawings": drawings_json(diagnosis.drawings)}
        with suppress(BrokenPipeError):  # the process has died, and has said why
            asked.write(json.dumps(task | {"folder": str(folder), "into": str(pictures_of(folder))}).encode() + b"\n")
            asked.flush()

    try:
        yield draw
        _ended(process)
        for folder in folders:
            moved_in(pictures_of(folder), folder)
    finally:
        _stop(process)
        for folder in folders:
            shutil.rmtree(pictures_of(folder), ignore_errors=True)


def _begun() -> subprocess.Popen[bytes]:
    """The process, with those that it starts a group of its own, which is stopped as one."""
    command = [sys.executable, "-m", __name__]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stderr=pipe, env=environment, start_new_session=True)


def _ended(process: subprocess.Popen[bytes]) -> None:
    """Nothing more will be asked, and everything is drawn."""
    said = process.communicate()[1].decode().strip().splitlines()
    if process.returncode:
        raise BeltError(said[-1] if said else "pictures: the process that draws them died")


def _stop(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.communicate()


def _draw() -> None:
    """What the process does; no result comes where the diagnosis failed."""
    from belt_sim.pictures.style import figure
    from belt_sim.results.json import diagnosis_of
    from belt_sim.use_cases.leave import draw_found

    figure(1.0, 1.0)
    drawn, other = False, 0
    for line in sys.stdin.buffer:
        task = json.loads(line)
        folder = Path(task["into"])
        diagnosis = diagnosis_of(task["diagnosis"], task["drawings"], task["folder"])
        if not drawn:
            drawn, other = True, _draw_two_by_two(folder, diagnosis)
        draw_found(folder, diagnosis)
    if other and os.waitstatus_to_exitcode(os.waitpid(other, 0)[1]):
        sys.exit(1)  # it has said why


def _draw_two_by_two(folder: Path, diagnosis: "Diagnosis") -> int:
    """Draw a diagnosis, where processes can be forked with one for the overlays, of which there are as much as of all
    else; its id, or 0."""
    from belt_sim.use_cases.leave import OVERLAY, draw_own

    other = os.fork() if hasattr(os, "fork") else -1
    if other == 0:
        _end(lambda: draw_own(folder, diagnosis, lambda kind: kind == OVERLAY))
    draw_own(folder, diagnosis, lambda kind: other < 0 or kind != OVERLAY)
    return max(other, 0)


def _end(work: Callable[[], None]) -> NoReturn:
    """Do the last work of a forked process; what went wrong is said in a line."""
    try:
        work()
    except BaseException as error:
        print(error, file=sys.stderr, flush=True)
        os._exit(1)
    os._exit(0)


if __name__ == "__main__":
    try:
        _draw()
    except BeltError as error:
        sys.exit(str(error))
