"""belt-sim demo: the main job on a sample -- where the beam model fails, what it lacks, the error after."""

import time
from collections.abc import Callable
from pathlib import Path

FOLDER = Path("outputs") / "demo"  # of the current folder
CASE = ("campaign=slack_belt", "model=beam_th2")


def demo(run: Callable[[list[str]], int]) -> int:
    """Diagnose the sample, then compare with what was found; ``run``: the command line. Returns the exit status."""
    started = time.perf_counter()
    print("A belt at 7 to 40 N/mm2, measured after a yaw step, against the beam model that controllers use.\n")
    folder, again = FOLDER / "diagnosis", FOLDER / "comparison"
    status = run(["diagnose", *CASE, f"hydra.run.dir={folder}"])
    if status:
        return status
    print("\nThe effect, added to the model:\n")
    status = run(["compare", *CASE, f"effects={folder / 'effects.yaml'}", f"hydra.run.dir={again}"])
    if status:
        return status
    print(f"\nDone in {time.perf_counter() - started:.0f} s. What to look at:")
    for path, words in _products(folder, again):
        if path.exists():
            print(f"  {path}  {words}")
    return 0


def _products(folder: Path, again: Path) -> list[tuple[Path, str]]:
    return [
        (folder / "report.html", "the whole diagnosis on one page"),
        (folder / "effects.yaml", "the missing effect; simulate and compare accept it as effects=FILE"),
        (folder / "where.png", "where the beam model fails"),
        (again / "overlay.png", "measured and modelled, before and after"),
        (folder / "comparison.rrd", "points, residuals and tilt against travel; open it with rerun FILE"),
    ]
