"""A belt that lies off is centred by the schedule that was found, by law and in 3D: ``python -m studies.centring``."""

from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.simulate import model_named, simulate
from belt_sim.case import Schedule
from belt_sim.commands.cases import CentringGoal
from belt_sim.curves import Curves, read_curves
from belt_sim.settings import case_from
from belt_sim.show import style
from belt_sim.show.style import FAINT, INK, POINT_NAMES, POINTS
from belt_sim.units import DEGREE, MM
from studies.application import application


@style.picture
def picture(path: Path, law: Curves, space: Curves | None, wanted: CentringGoal, schedule: Schedule) -> Path:
    """Points 1-4 and the yaw, against travel; space: those in three dimensions."""
    fig, [[ax], [below]] = style.figure(8.4, 5.6, rows=2, sharex=True, height_ratios=[3, 1])
    for k, (colour, name) in enumerate(zip(POINTS, POINT_NAMES, strict=True)):
        ax.plot(law.travel, (law.y[k] + wanted.start) / MM, color=colour, label=name)
        if space is not None:
            ax.plot(space.travel, (space.y[k] + wanted.start) / MM, color=colour, linestyle=":", linewidth=2.6)
    for level in (-wanted.within, wanted.within):
        ax.axhline(level / MM, color=FAINT, linewidth=0.8)
    ax.set(ylabel="from the middle [mm]")
    ax.legend(loc="upper right")
    ax.set_title("strip law; dotted: in three dimensions" if space is not None else "strip law", fontweight="normal")
    travel = np.asarray(law.travel)
    part = np.clip((travel[:, None] - schedule.at) / np.maximum(schedule.over, 1e-9), 0.0, 1.0)
    below.plot(travel, (part * schedule.change).sum(axis=1) / DEGREE, color=INK)
    below.set(xlabel="belt travel [m]", ylabel="yaw [degrees]", xlim=(0.0, 120.0))
    style.title(fig, "A slack belt is centred")
    return style.save(fig, path)


def run_line(name: str, travel: np.ndarray, y: np.ndarray, wanted: CentringGoal) -> str:
    """One line of a run, y (4, n) [m]."""
    centred, over = wanted.centring_travel(travel, y), wanted.overshoot(y)
    rest = wanted.largest_distance(y)[travel >= centred].max()
    return f"{name}: centred after {centred:.1f} m, within {rest / MM:.2f} mm then, beyond by {over / MM:.2f} mm"


def centring(config: dict[str, Any]) -> None:
    """Tell, and draw."""
    case, wanted = case_from(config), CentringGoal.from_setting(config["objective"])
    assert wanted is not None
    law = simulate(case, model=model_named("strip"), travel=config["travel"]).curves
    assert law is not None
    print(run_line("strip law", np.asarray(law.travel), np.asarray(law.y), wanted))
    space = read_curves(Path(config["space"])) if config["space"] else None
    if space is not None:
        print(run_line("3D", space.travel, space.y, wanted))
    if config["picture"]:
        print(picture(Path(config["picture"]), law, space, wanted, case.settings.yaw))


if __name__ == "__main__":
    application("centring", centring)
