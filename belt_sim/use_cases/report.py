"""Report: a diagnosis as one HTML page."""

import os
from pathlib import Path

from belt_sim.reports.page import write_report
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.json import read_diagnosis


def report(diagnosis: Diagnosis | str | os.PathLike[str], path: str | os.PathLike[str]) -> Path:
    """Write the report of a diagnosis (or of the run folder of one) to ``path`` (.html), which needs no network."""
    found = diagnosis if isinstance(diagnosis, Diagnosis) else read_diagnosis(Path(diagnosis))
    return write_report(path, found)
