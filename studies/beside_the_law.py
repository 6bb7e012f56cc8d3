"""3D runs beside the strip law: python -m studies.beside_the_law 'files=outputs/study/r*.json' picture=FILE.png

Prints how far each run of studies.space_run, sticking or slipping, is at most from the law, of points 1-4 over the
whole travel, and draws points 1 and 3 of all, a panel a tension.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.config import case_from
from belt_sim.errors import InputError
from belt_sim.pictures import style
from belt_sim.pictures.colours import BLUE, INK, RED
from belt_sim.si import MM
from studies.application import application

_POINTS = ((0, BLUE), (2, RED))


@dataclass(frozen=True)
class Beside:
    """One run. tension [N/mm2]; friction [1]; travel [m], shape (n,); y, law [m], shape (4, n): 3D and strip law."""

    tension: float
    friction: float
    travel: np.ndarray
    y: np.ndarray
    law: np.ndarray


def read(path: Path) -> Beside:
    """A run of the study and the strip law for its case."""
    content = json.loads(path.read_text(encoding="utf-8"))
    table = np.genfromtxt(path.with_suffix(".csv"), delimiter=",", names=True)
    travel, y = table["travel_m"], np.array([table[f"y{k}_mm"] for k in (1, 2, 3, 4)]) * MM
    law = march(case_from(content["config"]), analytic_model("strip"), travel=float(travel[-1]))
    expected = np.array([np.interp(travel, law.travel, point) for point in law.y])
    return Beside(float(content["config"]["tension"]), float(content["options"]["friction"]), travel, y, expected)


def beside_the_law(config: dict[str, Any]) -> None:
    """Tell and draw all runs that the pattern names."""
    found = sorted(glob(config["files"]))
    if not found:
        raise InputError("files", config["files"], "", "no such file; make some with python -m studies.space_run")
    runs = sorted((read(Path(f)) for f in found), key=lambda r: (r.tension, -r.friction))
    for r in runs:
        apart, largest = np.abs(r.y - r.law).max(), np.abs(r.law).max()
        print(
            f"{r.tension:g} N/mm2, friction {r.friction:g}, {r.travel[-1]:.0f} m: at most {apart / MM:.3f} mm apart, "
            f"{100 * apart / largest:.1f} % of the largest y"
        )
    if config["picture"]:
        print(picture(config["picture"], runs))


@style.picture
def picture(path: str | Path, runs: Sequence[Beside]) -> Path:
    """Points 1 and 3 of 3D runs (sticking: lines, slipping: dashes) over the strip law (thick and faint)."""
    tensions = sorted({r.tension for r in runs})
    rows = -(-len(tensions) // 2)
    fig, axes = style.figure(9.0, 2.9 * rows, rows, min(len(tensions), 2), sharex=True)
    panels = [axis for row in axes for axis in row]
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
