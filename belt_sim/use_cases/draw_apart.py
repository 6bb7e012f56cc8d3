"""Pictures of a diagnosis drawn by a process of their own, beside the report and the recording.

The process is started before there is anything to draw, so that it has imported what it needs when the result comes:
through its standard input, as the files of a diagnosis hold it. As ``python -m belt_sim.use_cases.draw_apart`` this
file is that process.
"""

import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from belt_sim.errors import BeltError
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.read import diagnosis_of
from belt_sim.results.written import diagnosis_json, drawings_json

Draw = Callable[[Path, Diagnosis], None]


@contextmanager
def drawing_apart() -> Iterator[Draw]:
    """A function that begins to draw a diagnosis into a folder; all is drawn when the block has ended.

    Raises BeltError when a picture could not be drawn.
    """
    command = [sys.executable, "-m", __name__]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
    asked, said = process.stdin, process.stderr
    assert asked is not None
    assert said is not None

    def draw(folder: Path, diagnosis: Diagnosis) -> None:
        task = {"diagnosis": diagnosis_json(diagnosis), "drawings": drawings_json(diagnosis.drawings)}
        with suppress(BrokenPipeError):  # the process has died, and has said why
            asked.write(json.dumps(task | {"folder": str(folder)}).encode())
            asked.close()

    try:
        yield draw
    except BaseException:
        process.kill()
        process.communicate()
        raise
    with suppress(BrokenPipeError):
        asked.close()
    lines = said.read().decode().strip().splitlines()
    if process.wait():
        raise BeltError(lines[-1] if lines else "pictures: the process that draws them died")


def _draw() -> None:
    """What the process does; no result comes where the diagnosis failed."""
    gc.disable()  # it ends soon
    from belt_sim.pictures.style import figure
    from belt_sim.use_cases.leave import draw_diagnosis

    figure(1.0, 1.0)
    content = sys.stdin.buffer.read()
    if content:
        task = json.loads(content)
        draw_diagnosis(Path(task["folder"]), diagnosis_of(task["diagnosis"], task["drawings"], task["folder"]))


if __name__ == "__main__":
    try:
        _draw()
    except BeltError as error:
        sys.exit(str(error))
