"""Thinned runs of studies.space_run for models/paper: ``python -m studies.paper_store 'files=outputs/study/r*.json'``.

What is kept is enough for the figures of ``make paper``: points 1-4 and tilts every SPACING of travel, the shapes,
and how to make it again.
"""

import glob
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.io import write_text, write_with
from studies.application import application

SPACING = 0.1  # [m]
KEPT = ("travel_m", "y1_mm", "y2_mm", "y3_mm", "y4_mm", "tilt_upper_mrad", "tilt_lower_mrad")
PRIVATE = ("hydra", "out=", "limit=")


def paper_store(config: dict[str, Any]) -> None:
    """Store every named run, under ``names`` where they are given."""
    files = [Path(f) for f in sorted(glob.glob(config["files"]))]
    names = config["names"] or [f.stem for f in files]
    for file, name in zip(files, names, strict=True):
        print(store(file, Path(config["place"]) / f"{name}.json"))


def store(file: Path, target: Path) -> Path:
    """One run's JSON, curves and shapes."""
    report = json.loads(file.read_text(encoding="utf-8"))
    _thin(file.with_suffix(".csv"), target.with_suffix(".csv"))
    shapes = file.with_name(f"{file.stem}_shapes.csv")
    if shapes.is_file():
        copy = target.with_name(f"{target.stem}_shapes.csv")
        write_with(copy, lambda draft: draft.write_bytes(shapes.read_bytes()))
    return write_text(target, json.dumps(run_record(report, target.stem), indent=2, allow_nan=False) + "\n")


def run_record(report: dict[str, Any], name: str) -> dict[str, Any]:
    """How a run was made and what it cost."""
    config, origin, options = report["config"], report["provenance"], report["options"]
    words = [w for w in origin["command"].split()[1:] if not w.startswith(PRIVATE) and not w.startswith("name=")]
    quoted = [f"'{w}'" if set(w) & set("[]{}") else w for w in words]
    finite = {k: ("inf" if v == math.inf else v) for k, v in options.items()}
    return {
        "command": " ".join(["python -m studies.space_run", f"name={name}", *quoted]),
        "commit": origin["commit"],
        "versions": origin["versions"],
        "model": config["model"]["name"],
        "centre_distance_m": config["rig"]["centre_distance"],
        "tension_N_per_mm2": config["tension"],
        "yaw_deg": config["yaw"],
        "travel_m": config["travel"],
        "options": finite,
        "cpu_s": round(report["cpu_s"], 1),
        "steps": report["steps"],
        "sag_mm": report["sag_mm"],
        "spacing_m": SPACING,
    }


def _thin(source: Path, target: Path) -> None:
    with source.open(encoding="utf-8") as file:
        header = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    columns = dict(zip(header, rows.T, strict=True))
    travel = columns["travel_m"]
    _, first = np.unique(np.floor(travel / SPACING + 0.5), return_index=True)
    kept = [k for k in KEPT if k in columns]
    table = np.stack([columns[k][first] for k in kept], axis=1) + 0.0
    names = ",".join(kept)
    write_with(target, lambda d: np.savetxt(d, table, fmt="%.6g", delimiter=",", header=names, comments=""))


if __name__ == "__main__":
    application("paper_store", paper_store)
