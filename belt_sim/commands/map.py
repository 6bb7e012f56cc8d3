"""belt-sim map: many cases of an analytic model, a row each, on disk."""

import time
from pathlib import Path

from belt_sim.commands.run_dir import RunDir
from belt_sim.provenance import provenance


def run(run_dir: RunDir) -> None:
    """Leave map.json, cases/*.parquet and map.png; the same command goes on where it was stopped."""
    from belt_sim.api.case_map import case_map, write_map
    from belt_sim.pictures.case_map import draw_map
    from belt_sim.watch.observers import progress

    config = run_dir.config
    made = case_map(config)
    folder = Path(config["out"]) if config["out"] else run_dir.path / f"{config['model']['name']}_{made.digest[:8]}"
    began = time.monotonic()
    with progress(made.plan.count, f"map of {made.plan.count} cases") as done:
        new = write_map(folder, made, provenance(config), done)
    seconds = time.monotonic() - began
    if new:
        print(f"{new} cases in {seconds:.1f} s, {new / seconds:.0f} a second")
    if new < made.plan.count:
        print(f"done before, kept: {made.plan.count - new} cases")
    if config["pictures"]:
        for path in draw_map(folder, made.plan, made.columns, config["show"]):
            print(path)
    print(f"{folder / 'cases'}: a row a case, for pandas.read_parquet")
