"""After a sweep: one table and one picture of all its runs."""

import json
import time
from pathlib import Path
from typing import Any

import pandas as pd
from hydra.experimental.callback import Callback

from belt_sim.commands.failed import begin_again, failures, forgive
from belt_sim.curves import Curves
from belt_sim.files import clear_drafts, write_with

MIN_TENSIONS = 3  # from here on a picture of rates against tension says something
CURVES_SHOWN = 9


class SweepTable(Callback):
    """Hydra callback: writes sweep.csv, sweep_curves.png and sweep_rates.png into the sweep's folder.

    What a killed sweep left half-written is cleared away; cases that fail are listed and stop nothing.
    """

    def __init__(self) -> None:
        self.started = 0.0

    def on_multirun_start(self, config: Any, **kwargs: Any) -> None:
        self.started = time.time()
        clear_drafts(Path(config.hydra.sweep.dir))

    def on_job_start(self, config: Any, **kwargs: Any) -> None:
        clear_drafts(Path(config.hydra.runtime.output_dir))
        begin_again(Path(config.hydra.runtime.output_dir))

    def on_job_end(self, config: Any, job_return: Any, **kwargs: Any) -> None:
        if config.hydra.mode.name == "MULTIRUN":
            forgive(job_return)

    def on_multirun_end(self, config: Any, **kwargs: Any) -> None:
        folder = Path(config.hydra.sweep.dir)
        failed = failures(folder, self.started - 1.0)
        self._tabulate(folder, failed, config.get("pictures", False))
        if failed:  # the command's exit status
            raise SystemExit(1)

    def _tabulate(self, folder: Path, failed: dict[Path, str], pictures: bool) -> None:
        runs = [(p.parent, json.loads(p.read_text(encoding="utf-8"))) for p in sorted(folder.glob("*/summary.json"))]
        runs = [(p, s) for p, s in runs if (p / "summary.json").stat().st_mtime >= self.started - 1.0]
        if len(runs) + len(failed) < 2:
            return
        lost = [{"run": p.name, "failed": message} for p, message in failed.items()]
        table = pd.DataFrame([*(_row(p, s) for p, s in runs), *lost])
        write_with(folder / "sweep.csv", lambda path: table.to_csv(path, index=False))
        if pictures and runs:
            _draw(folder, runs, table.head(len(runs)))
        said = f"sweep of {len(runs) + len(failed)} runs" + (f", {len(failed)} of them failed" if failed else "")
        print(f"{said}: {folder / 'sweep.csv'}")


def _row(folder: Path, summary: dict[str, Any]) -> dict[str, Any]:
    row = {"run": folder.name} | {k: summary[k] for k in ("model", "tension_n_per_mm2", "yaw_deg", "travel_m")}
    row |= {f"rate{k}_mm_per_m": v for k, v in summary["rate_mm_per_m"].items()}
    row |= {f"offset_{k}_mm": v for k, v in summary["offset_mm"].items()}
    return row | {"steady_rate_mm_per_m": summary.get("steady_rate_mm_per_m"), "failed": None}


def _draw(folder: Path, runs: list[tuple[Path, dict[str, Any]]], table: pd.DataFrame) -> None:
    from belt_sim.pictures import Rates, curves_picture, rates_picture

    shown = {f"{s['model']} {s['tension_n_per_mm2']:g} N/mm²": p / "curves.csv" for p, s in runs}
    curves = {name: _curves(path) for name, path in shown.items() if path.is_file()}
    if 1 < len(curves) <= CURVES_SHOWN:
        curves_picture(folder / "sweep_curves.png", curves, "Points 1-4 against travel")
    rates = {}
    for name, rows in table.sort_values("tension_n_per_mm2").groupby("model", sort=False):
        if rows["tension_n_per_mm2"].nunique() >= MIN_TENSIONS:
            tension, rate = rows["tension_n_per_mm2"].to_numpy(), rows["rate1_mm_per_m"].to_numpy()
            rates[str(name)] = Rates(tension=tension, rate=rate)
    if rates:
        rates_picture(folder / "sweep_rates.png", rates, "Late rate of point 1 against tension")


def _curves(path: Path) -> Curves:
    table = pd.read_csv(path)
    y = table[[f"y{k}_mm" for k in (1, 2, 3, 4)]].to_numpy().T * 1e-3
    return Curves(travel=table["travel_m"].to_numpy(), y=y)
