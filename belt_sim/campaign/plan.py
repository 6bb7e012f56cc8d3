"""A campaign folder whose runs are planned, but not measured: campaign.yaml and runs.csv alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from belt_sim.campaign.nouns import Campaign
from belt_sim.campaign.problems import CampaignError, Problem
from belt_sim.campaign.read import contents_of, hash_of, text_of
from belt_sim.campaign.runs import read_runs
from belt_sim.campaign.sheet import read_sheet
from belt_sim.campaign.shipped import campaign_folder


def is_plan(folder: str | Path) -> bool:
    """Whether a folder has runs and a sheet, but nothing measured: no data file, or a signals.csv of a header alone."""
    folder = campaign_folder(folder)
    if not (folder / "runs.csv").is_file() or (folder / "steady.csv").exists():
        return False
    signals = folder / "signals.csv"
    try:
        return not signals.exists() or not any(line.strip() for line in signals.read_bytes().splitlines()[1:])
    except OSError:
        return False


def read_plan(folder: str | Path, *, travel: float, step: float) -> Campaign:
    """The planned campaign: every run is to be recorded over ``travel`` [m] after its yaw, every ``step`` [m].

    Readings stand at 0, and mean nothing. Raises CampaignError with every violation found.
    """
    problems: list[Problem] = []
    contents = contents_of(campaign_folder(folder), problems, measured=False)
    texts = {n: t for n, data in contents.items() if (t := text_of(n, data, problems)) is not None}
    sheet = read_sheet(texts["campaign.yaml"], problems)[0] if "campaign.yaml" in texts else None
    rows = read_runs(texts["runs.csv"], problems) if "runs.csv" in texts else None
    if sheet is not None and not sheet.signals:
        problems.append(
            Problem(file="campaign.yaml", name="signals", remedy="no signal is planned; state at least one")
        )
    if problems or sheet is None or rows is None:
        raise CampaignError(problems)
    runs = []
    for run in rows.runs.values():
        way = np.arange(0.0, run.yaw_at + travel + step / 2.0, step)
        runs.append(replace(run, travel=way, signals={s.name: np.zeros(len(way)) for s in sheet.signals}))
    return sheet.campaign(runs, hash_of(contents))
