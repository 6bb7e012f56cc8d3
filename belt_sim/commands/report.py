"""belt-sim report: write the report of a finished diagnosis again."""

from pathlib import Path

from belt_sim.commands.run_dir import RunDir


def run(run_dir: RunDir) -> None:
    """Write report.html and pictures from diagnosis.json and drawings.json."""
    from belt_sim.commands.outputs import draw_diagnosis
    from belt_sim.reports.page import write_report
    from belt_sim.results.json import read_diagnosis

    folder = Path(run_dir.text_setting("diagnosis", "the run folder of a diagnosis"))
    diagnosis = read_diagnosis(folder)
    draw_diagnosis(folder, diagnosis)
    print(write_report(folder / "report.html", diagnosis))
