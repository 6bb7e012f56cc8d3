"""belt-sim map: many cases of an analytic model, a row each, as one table."""

import time
from typing import Any

from belt_sim.api.plot import drawn_columns, plot
from belt_sim.api.sweep import sweep
from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import BeltError, InputError, whole
from belt_sim.io import write_with
from belt_sim.settings import model_settings
from belt_sim.show.observers import progress

GIVEN = ("tension", "yaw", "yaw_head", "speed", "direction", "rig", "belt", "travel", "effects", "at", "workers")
DRAWN = 2_000_000  # cases of a picture, at most


def map_cases(run_dir: RunDir) -> None:
    """Leave map.parquet and map.png in the run folder."""
    config: Any = run_dir.config
    try:
        import pyarrow  # noqa: F401
    except ImportError as missing:
        raise BeltError("a map needs PyArrow: pip install 'belt-sim[sweeps]'") from missing
    if config["workers"] is not None:
        whole("workers", config["workers"])
    began = time.monotonic()
    with run_dir.outputs() as draft:
        with progress(1.0, "map") as done:
            table = sweep(**{k: config[k] for k in GIVEN}, model=model_settings(config["model"]), tell=done)
        shown = config["show"] or drawn_columns(table)[0]
        if shown not in drawn_columns(table):
            raise InputError("show", shown, "", f"use one of {', '.join(drawn_columns(table))}")
        seconds = time.monotonic() - began
        print(f"{len(table)} cases in {seconds:.1f} s, {len(table) / seconds:.0f} a second")
        write_with(draft / "map.parquet", lambda path: table.to_parquet(path, index=False))
        if config["pictures"] and len(table.attrs["axes"]) <= 2 and len(table) <= DRAWN:
            plot(table, draft / "map.png", kind=shown)
    print(f"{run_dir.path / 'map.parquet'}: a row a case, for pandas.read_parquet")
