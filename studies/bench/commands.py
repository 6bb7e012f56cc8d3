"""What commands cost from the shell to their files: wall and CPU time, memory, programs traced and compiled."""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from belt_sim.campaign.folder import write_campaign
from belt_sim.io import ROOT
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import Plan, grid

LARGE = Plan(  # 20 runs with the two repeats
    runs=grid([t * N_PER_MM2 for t in (7, 10, 15, 20, 30, 40)], [y * DEGREE for y in (-0.042, 0.021, 0.042)]),
    length=100.0,
    signals={f"y{k}": f"point_{k}" for k in (1, 2, 3, 4)},
)
#: campaigns that are made for the bench: what is hidden, and the plan
MADE: dict[str, tuple[dict[str, Any], Plan]] = {
    "yaw_creep": ({"id": "yaw_creep", "share": 0.05, "time": 25.0}, Plan()),
    "large": ({"id": "crown", "c": 1.6e-4}, LARGE),
}
AGAIN = """
import time, belt_sim as bs
bs.simulate(model="strip", tension=10)
begun = time.process_time()
bs.simulate(model="strip", tension=11)
print("again", time.process_time() - begun)
"""


@dataclass(frozen=True)
class Row:
    """A command of the bench: name, arguments of belt-sim, limits of wall and CPU time [s] (None: none), and whether
    it starts with no compiled program on disk."""

    name: str
    arguments: tuple[str, ...]
    wall: float | None = None
    cpu: float | None = None
    cold: bool = False


def _diagnose(campaign: str, model: str) -> tuple[str, ...]:
    return ("diagnose", f"campaign={campaign}", f"model={model}")


ROWS = (
    Row("diagnose slack_belt, beam_th2", _diagnose("slack_belt", "beam_th2"), 8.0, 12.0),
    Row("diagnose machine_fault, strip", _diagnose("machine_fault", "strip"), 12.0, 18.0),
    Row("diagnose slack_belt, cold", _diagnose("slack_belt", "beam_th2"), 30.0, cold=True),
    Row("diagnose machine_fault, cold", _diagnose("machine_fault", "strip"), 40.0, cold=True),
    Row("diagnose an unknown law (yaw creep)", _diagnose("yaw_creep", "strip"), 25.0),
    Row("diagnose 20 runs, 4 signals, 100 m", _diagnose("large", "strip"), 30.0),
    Row("simulate strip with pictures", ("simulate", "model=strip", "tension=10"), cpu=1.6),
    Row("compare slack_belt", ("compare", "campaign=slack_belt", "model=beam_th2"), cpu=1.6),
    Row("check slack_belt", ("check", "campaign=slack_belt", "model=beam_th2"), cpu=2.5),
    Row("--help", ("--help",), cpu=0.3),
    Row("an error in a key", ("simulate", "tensoin=10"), cpu=0.3),
    Row("demo", ("demo",), 14.0),
    Row("demo, cold", ("demo",), 35.0, cold=True),
    Row("bs.simulate again, another tension", (), cpu=0.02),
)


def measure(only: str = "", trees: tuple[Path, ...] = (ROOT,)) -> Iterator[dict[str, Any]]:
    """Yield one measurement for each row whose name has one of the words ``only`` and each checkout of ``trees``."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        rows = [row for row in ROWS if any(word in row.name for word in only.split(","))]
        for number, (made, (hidden, plan)) in enumerate(MADE.items()):
            if any(f"campaign={made}" in row.arguments for row in rows):
                write_campaign(
                    make_campaign(hidden=[hidden], base="strip", seed=number + 1, plan=plan)[0], place / made
                )
        for row in rows:
            for tree in trees:
                if not row.cold and row.name != "--help":
                    _call(row, tree, place)  # compiles what is to be on disk
                yield {"row": row.name, "tree": str(tree)} | _call(row, tree, place)


def _call(row: Row, tree: Path, place: Path) -> dict[str, Any]:
    """Run a command once with the code of ``tree``; CPU time and memory are those of its whole process tree.

    Python keeps bytecode, as it does by default: without it, every command compiles the package again, 0.2 to 0.4 s.
    """
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"PYTHONPATH": str(tree), "JAX_LOG_COMPILES": "1", "PYTHONDONTWRITEBYTECODE": ""}
        environment |= {"BELT_SIM_CACHE": f"{folder}/programs"} if row.cold else {}
        arguments = [
            f"campaign={place / made}" if (made := a.removeprefix("campaign=")) in MADE else a for a in row.arguments
        ]
        command = [sys.executable, *(["-m", "belt_sim", *arguments] if arguments else ["-c", AGAIN])]
        with (Path(folder) / "out").open("w") as out:
            begun = time.perf_counter()
            process = subprocess.Popen(command, cwd=folder, env=environment, stdout=out, stderr=out)
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        wall, said = time.perf_counter() - begun, (Path(folder) / "out").read_text(errors="replace")
    again = re.search(r"^again (\S+)", said, re.MULTILINE)
    return {
        "wall_s": wall,
        "cpu_s": float(again[1]) if again else used.ru_utime + used.ru_stime,
        "memory_gb": used.ru_maxrss / 1024.0**2,
        "traced": said.count("Finished tracing"),
        "compiled": said.count("Finished XLA compilation"),
        "status": process.returncode,
    }
