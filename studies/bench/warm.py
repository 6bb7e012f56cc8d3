"""How long ``belt-sim simulate`` takes from the shell to its answer."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from belt_sim.files import ROOT

CALLS = 3  # after the first, which may compile


def warm_start() -> dict[str, float]:
    """Seconds of a first call and of the best later one, without and with the picture."""
    with tempfile.TemporaryDirectory() as folder:
        first = _call(Path(folder) / "first", "pictures=false")
        bare = min(_call(Path(folder) / f"bare{k}", "pictures=false") for k in range(CALLS))
        drawn = min(_call(Path(folder) / f"drawn{k}") for k in range(CALLS))
    return {"first_s": first, "warm_s": bare, "warm_with_picture_s": drawn}


def _call(folder: Path, *more: str) -> float:
    program = "from belt_sim.cli import main; main()"
    command = [sys.executable, "-c", program, "simulate", f"hydra.run.dir={folder}", *more]
    begun = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return time.perf_counter() - begun
