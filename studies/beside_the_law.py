"""3D runs beside the strip law: python -m studies.beside_the_law 'files=outputs/study/r*.json' picture=FILE.png

Runs are those of studies.space_run, or of a sweep (``belt-sim simulate -m engine=quasi_static tension=...``), as
'files=SWEEP/*/summary.json'. Prints how far each, sticking or slipping, is at most from the law with its effects,
of points 1-4 over the whole travel, all relative to the largest y and each relative to itself; with
'windows=[[20,60],[100,200]]' the slopes over these metres of travel too. Draws points 1 and 3, a panel a tension.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.effects.load import load_effects
from belt_sim.errors import InputError
from belt_sim.model import analytic_model
from belt_sim.settings import case_from, make_case
from belt_sim.show import style
from belt_sim.show.style import BLUE, INK, RED
from belt_sim.units import MM, MM_PER_M, N_PER_MM2
from studies.application import application

_POINTS = ((0, BLUE), (2, RED))


@dataclass(frozen=True)
class ComparedRun:
    """One run. tension [N/mm2]; friction [1]; stations [m]: their distance; effects: their ids; travel [m], shape (n,);
    y, law [m], shape (4, n): 3D and strip law."""

    tension: float
    friction: float
    stations: float
    effects: tuple[str, ...]
    travel: np.ndarray
    y: np.ndarray
    law: np.ndarray


def read(path: Path) -> ComparedRun:
    """A run of studies.space_run, or a case of a sweep (its summary.json), and the strip law for it."""
    content = json.loads(path.read_text(encoding="utf-8"))
    of_sweep = path.name == "summary.json"
    file = path.with_name("curves.csv") if of_sweep else path.with_suffix(".csv")
    table = np.genfromtxt(file, delimiter=",", names=True)
    travel, y = table["travel_m"], np.array([table[f"y{k}_mm"] for k in (1, 2, 3, 4)]) * MM
    if of_sweep:  # a sticking belt on the test rig
        case, effects = make_case(tension=content["tension_n_per_mm2"], yaw=content["yaw_deg"]), load_effects(None)
        options: dict[str, Any] = {"dx": 0.025, "friction": np.inf}
    else:
        case, effects, options = (
            case_from(content["config"]),
            load_effects(content["config"]["effects"]),
            content["options"],
        )
    law = analytic_model("strip").run(case, effects, travel=float(travel[-1]))
    expected = np.array([np.interp(travel, law.travel, point) for point in law.y])
    stations, friction = float(options["dx"]), float(options["friction"])
    tension = float(case.settings.tension) / N_PER_MM2
    return ComparedRun(tension, friction, stations, tuple(e.id for e in effects), travel, y, expected)


def run_lines(run: ComparedRun, windows: Sequence[tuple[float, float]]) -> list[str]:
    """What is said of a run; windows [m]: travels over which slopes are compared."""
    apart, largest = np.abs(run.y - run.law), np.abs(run.law)
    own = ", ".join(f"{100 * share:.1f}" for share in apart.max(axis=1) / np.maximum(largest.max(axis=1), 1e-12))
    what = "".join(f", {e}" for e in run.effects)
    lines = [
        f"{run.tension:g} N/mm2, friction {run.friction:g}, {run.travel[-1]:.0f} m, stations {run.stations / MM:g} mm"
        f"{what}: at most {apart.max() / MM:.3f} mm apart, {100 * apart.max() / largest.max():.1f} % of the largest y "
        f"(points 1-4 of their own {own} %)"
    ]
    for begin, end in windows:
        inside = (run.travel >= begin) & (run.travel <= end)
        if run.travel[-1] < end - 1.0:
            continue
        slopes = [np.polyfit(run.travel[inside], y[:, inside].T, 1)[0] for y in (run.y, run.law)]
        seen, expected = (" ".join(f"{s / MM_PER_M:+.4f}" for s in these) for these in slopes)
        lines.append(f"    {begin:g}-{end:g} m, points 1-4: {seen} mm/m, strip law {expected}")
    return lines


def beside_the_law(config: dict[str, Any]) -> None:
    """Tell and draw all runs that the pattern names."""
    found = sorted(glob(config["files"]))
    if not found:
        raise InputError("files", config["files"], "", "no such file; make some with python -m studies.space_run")
    runs = sorted((read(Path(f)) for f in found), key=lambda r: (r.tension, -r.friction))
    for r in runs:
        print("\n".join(run_lines(r, config["windows"])))
    if config["picture"]:
        print(picture(config["picture"], runs))


@style.picture
def picture(path: str | Path, runs: Sequence[ComparedRun]) -> Path:
    """Points 1 and 3 of 3D runs (sticking: lines, slipping: dashes) over the strip law (thick and faint)."""
    tensions = sorted({r.tension for r in runs})
    rows = -(-len(tensions) // 2)
    fig, panels = style.figure(9.0, 2.9 * rows, rows, min(len(tensions), 2), sharex=True)
    for tension, axis in zip(tensions, panels, strict=False):
        these = [r for r in runs if r.tension == tension]
        for k, (point, colour) in enumerate(_POINTS):
            longest = max(these, key=lambda r: r.travel[-1])
            axis.plot(longest.travel, longest.law[point] / MM, color=colour, alpha=0.25, linewidth=5.0,
                      label=f"strip law, point {point + 1}")  # fmt: skip
            for r in these:
                line = "-" if np.isinf(r.friction) else "--"
                name = "sticking" if np.isinf(r.friction) else f"friction {r.friction:g}"
                label = f"3D, {name}" if k == 0 else None
                axis.plot(r.travel, r.y[point] / MM, line, color=INK if line == "--" else colour, linewidth=1.1,
                          label=label)  # fmt: skip
        axis.set_title(f"{tension:g} N/mm$^2$")
        axis.set(xlabel="travel [m]", ylabel="y [mm]")
    panels[0].legend(fontsize=8)
    return style.save(fig, path)


if __name__ == "__main__":
    application("beside_the_law", beside_the_law)
