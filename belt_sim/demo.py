"""make demo: the main job on the slack-belt sample -- where the beam model fails, what it lacks, the error after."""

import time
from pathlib import Path

from belt_sim.cli import run
from belt_sim.paths import CAMPAIGNS, ROOT

FOLDER = ROOT / "outputs" / "demo"


def main() -> int:
    """Diagnose the sample, then compare with what was found; returns the exit status."""
    started = time.perf_counter()
    campaign = CAMPAIGNS / "slack_belt"
    print("A belt at 7 to 40 N/mm2, measured after a yaw step, against the beam model that controllers use.\n")
    folder = FOLDER / "diagnosis"
    status = run(["diagnose", f"campaign={campaign}", "model=beam_th2", f"hydra.run.dir={folder}"])
    if status:
        return status
    print("\nThe effect, added to the model:\n")
    effects = folder / "effects.yaml"
    again = FOLDER / "comparison"
    settings = [f"campaign={campaign}", "model=beam_th2", f"effects={effects}", f"hydra.run.dir={again}"]
    status = run(["compare", *settings])
    if status:
        return status
    print(f"\nDone in {time.perf_counter() - started:.0f} s. What to look at:")
    for path, words in _products(folder, again):
        print(f"  {path.relative_to(ROOT)}  {words}")
    print(f"  .venv/bin/rerun {(folder / 'comparison.rrd').relative_to(ROOT)}  opens the recording")
    return 0


def _products(folder: Path, again: Path) -> list[tuple[Path, str]]:
    return [
        (folder / "report.html", "the whole diagnosis on one page"),
        (folder / "effects.yaml", "the missing effect; simulate and compare accept it as effects=FILE"),
        (folder / "where.png", "where the beam model fails"),
        (again / "overlay.png", "measured and modelled, before and after"),
        (folder / "comparison.rrd", "points, residuals and tilt against travel (Rerun)"),
    ]


if __name__ == "__main__":
    raise SystemExit(main())
