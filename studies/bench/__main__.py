"""``python -m studies.bench``: a table on the screen, outputs/bench/bench.json beside it."""

import os
import platform
from typing import Any

from rich.console import Console
from rich.table import Table

from belt_sim.files import ROOT, write_json
from belt_sim.jax_setup import prepare
from belt_sim.provenance import provenance
from studies.bench.diagnosis import prediction_figures, whole_diagnoses
from studies.bench.speed import batch_figures, delay_figures, plain_figures
from studies.bench.warm import warm_start

SCHEMA = "belt-bench/1"
BATCH_LIMIT = 5.0  # [s] for ten thousand cases on two cores, after compilation
WARM_LIMIT = 3.0  # [s] for a second call of the command


def main() -> None:
    """Measure, print, write."""
    prepare()
    console = Console()
    console.print("strip model, 100 m of travel, four curves kept every 0.1 m")
    batch, plain, delay = batch_figures(), plain_figures(), delay_figures()
    warm, prediction = warm_start(), prediction_figures()
    console.print(_contenders(batch, plain, delay))
    console.print(_limits(batch, warm))
    console.print(_prediction(prediction))
    diagnoses = whole_diagnoses()
    console.print(_diagnoses(diagnoses))
    content = {
        "schema": SCHEMA,
        "batch": batch,
        "plain_loop": plain,
        "jitcdde": delay,
        "ratio": {"plain_loop": _ratio(plain, batch), "jitcdde": _ratio(delay, batch)},
        "warm_start": warm,
        "prediction": prediction,
        "diagnoses": diagnoses,
        "machine": {"cores": os.cpu_count(), "load": os.getloadavg()[0], "processor": platform.processor()},
        "provenance": provenance(),
    }
    console.print(str(write_json(ROOT / "outputs" / "bench" / "bench.json", content)))


def _ratio(other: dict[str, Any] | None, batch: dict[str, Any]) -> float | None:
    return None if other is None else other["per_case_ms"] / batch["per_case_ms"]


def _contenders(batch, plain, delay) -> Table:
    table = Table("", "ms a case", "ratio", "largest error", "error of y1 at 1 m")
    rows = [
        (f"batch march, {batch['cases']} cases, 2 threads", batch),
        ("plain Python loop, 1st order, 20 mm", plain),
        ("jitcdde", delay),
    ]
    for name, row in rows:
        if row is None:
            table.add_row(name, "not installed, or no C compiler")
            continue
        error = row["error"]
        cells = (f"{row['per_case_ms']:.3f}", f"{_ratio(row, batch):.0f}")
        table.add_row(name, *cells, f"{error['largest']:.1e}", f"{error['at_1_m']:.1e}")
    return table


def _limits(batch, warm) -> Table:
    table = Table("", "measured", "limit")
    table.add_row(f"{batch['cases']} cases after compilation", f"{batch['seconds']:.2f} s", f"{BATCH_LIMIT:.0f} s")
    table.add_row("the same, first call", f"{batch['first_call_s']:.2f} s", "")
    table.add_row("belt-sim simulate, first call", f"{warm['first_s']:.2f} s", "")
    table.add_row("belt-sim simulate, later calls", f"{warm['warm_s']:.2f} s", f"{WARM_LIMIT:.0f} s")
    table.add_row("the same with its picture", f"{warm['warm_with_picture_s']:.2f} s", f"{WARM_LIMIT:.0f} s")
    return table


def _prediction(figures) -> Table:
    table = Table("predictions of all runs, all candidates", "processor time a point", "the first, compiled or loaded")
    for way, words in (("old", "compiled for one campaign, 8 points at a time"), ("new", "compiled once for all")):
        table.add_row(words, f"{figures[f'{way}_ms']:.1f} ms", f"{figures[f'{way}_first_s']:.2f} s")
    table.add_row("they differ by", f"{figures['apart_m']:.1e} m")
    return table


def _diagnoses(rows) -> Table:
    table = Table("belt-sim diagnose", "by the clock", "wanted", "processor time", "memory", "compiled", "verdict")
    for row in rows:
        seconds = (f"{row['wall_s']:.1f} s", f"{row['limit_s']:.0f} s", f"{row['processor_s']:.1f} s")
        table.add_row(
            row["what"], *seconds, f"{row['memory_mb'] / 1024:.1f} GB", f"{row['compiled']} programs", row["verdict"]
        )
    return table


if __name__ == "__main__":
    main()
