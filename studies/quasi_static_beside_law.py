"""A sweep of batched 3D belts beside the strip law: ``python -m studies.quasi_static_beside_law SWEEP PICTURE.png``.

SWEEP is the folder of ``belt-sim simulate -m engine=quasi_static tension=...`` of a sticking belt on the
test rig. Prints a row
a tension, in % of the largest y: point 1 at 3 and 10 m and at the end, and the most of all four points; draws points 1
and 3.
"""

import json
import sys
from pathlib import Path

import numpy as np

import belt_sim as bs
from belt_sim.jax_setup import prepare
from belt_sim.show import style
from belt_sim.show.style import BLUE, RED
from belt_sim.units import MM
from studies.beside_the_law import ComparedRun

COLUMNS = 4


def read(folder: Path) -> ComparedRun:
    """The 3D run of a case's folder, and the strip law at its tension and yaw."""
    said = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    table = np.genfromtxt(folder / "curves.csv", delimiter=",", names=True)
    travel, y = table["travel_m"], np.array([table[f"y{k}_mm"] for k in (1, 2, 3, 4)]) * MM
    tension, yaw = float(said["tension_n_per_mm2"]), float(said["yaw_deg"])
    law = bs.simulate(model="strip", tension=tension, yaw=yaw, travel=float(travel[-1]) + 0.1).curves
    assert law is not None
    expected = np.array([np.interp(travel, law.travel, point) for point in law.y])
    return ComparedRun(tension, np.inf, 0.025, (), travel, y, expected)


def row(run: ComparedRun) -> str:
    """One line of the table."""
    off = 100.0 * (run.y - run.law) / np.abs(run.law).max()
    at = " / ".join(f"{np.interp(s, run.travel, off[0]):.2f}" for s in (3.0, 10.0, run.travel[-1]))
    return f"| {run.tension:g} | {at} | {np.abs(off).max():.2f} |"


@style.picture
def draw(path: Path, runs: list[ComparedRun]) -> Path:
    """A panel a tension: points 1 and 3 in 3D (thin) over the strip law (thick and faint)."""
    rows = -(-len(runs) // COLUMNS)
    fig, axes = style.figure(11.0, 2.1 * rows + 0.6, rows, COLUMNS, sharex=True)
    for run, ax in zip(runs, [ax for line in axes for ax in line], strict=False):
        for point, colour in ((0, BLUE), (2, RED)):
            ax.plot(run.travel, run.law[point] / MM, color=colour, alpha=0.25, linewidth=5.0, label="strip law")
            ax.plot(run.travel, run.y[point] / MM, color=colour, linewidth=1.1, label=f"3D, point {point + 1}")
        ax.set_title(f"{run.tension:g} N/mm$^2$")
    for ax in axes[-1]:
        ax.set_xlabel("travel [m]")
    for line in axes:
        line[0].set_ylabel("y [mm]")
    axes[0][0].legend(fontsize=7)
    style.title(fig, "The batched 3D belt beside the strip law")
    return style.save(fig, path)


def main(sweep: Path, picture: Path) -> None:
    """Read, tell, draw."""
    prepare()
    runs = sorted((read(f.parent) for f in sweep.glob("*/curves.csv")), key=lambda r: r.tension)
    print("\n".join(row(r) for r in runs))
    print(draw(picture, runs))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
