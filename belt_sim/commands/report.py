"""belt-sim report: write the report of a finished diagnosis again."""

import json
from pathlib import Path
from typing import Any

from belt_sim.commands.diagnose import draw_pictures
from belt_sim.commands.run_folder import plain
from belt_sim.errors import InputError


def run(cfg: Any) -> None:
    """Write report.html and pictures from diagnosis.json and drawings.json."""
    from belt_sim.diagnose.drawings_file import read_drawings
    from belt_sim.report.report import write_report

    folder = Path(str(plain(cfg)["diagnosis"]))
    try:
        content = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        remedy = "give the run folder of a diagnosis (it holds diagnosis.json)"
        raise InputError("diagnosis", str(folder), "", remedy) from error
    drawn = read_drawings(folder / "drawings.json")
    draw_pictures(content, drawn, folder)
    print(write_report(folder / "report.html", content, drawn))
