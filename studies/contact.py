"""The belt of a plain MuJoCo scene beside the held belt: ``python -m studies.contact TABLE.csv [PICTURE.png]``.

Each case is a rig, a tension and a step; the tail pulley is yawed by -0.042 degrees, and both belts run 5 m. A row says
how far y of points 1 and 3 is at most from the held belt's, of its largest y, and the mean tilt of both spans from 1 m
on. A row of TABLE.csv that is there is not run again. Nothing in the scene knows how a belt turns where it lands.
"""

import csv
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import belt_sim as bs
from belt_sim.curves import Curves
from belt_sim.show import style
from belt_sim.show.style import BLUE, INK, RED
from belt_sim.units import MM

FAR, YAW = 5.0, -0.042  # [m], [degrees]
SETTLED = 1.0  # [m]: the tilt swings with the start of the run before


@dataclass(frozen=True)
class Contact:
    """One case: rig; tension [N/mm2]; dt [ms]."""

    rig: str
    tension: float
    dt: float = 1.0


CASES = [Contact(rig, tension) for rig, tensions in (("test_rig", (10, 20, 40)), ("rope_example", (7, 20, 40)))
         for tension in tensions]  # fmt: skip
CASES += [Contact("rope_example", 20, 0.5), Contact("rope_example", 40, 0.5)]


def run(case: Contact, contact: str, travel: float = FAR) -> Curves:
    """Curves of one belt; contact: as ``model.contact``."""
    model = {"name": "mujoco_flex", "contact": contact} | ({"dt": 1e-3 * case.dt} if contact == "mujoco" else {})
    curves = bs.simulate(model=model, rig=case.rig, tension=case.tension, yaw=YAW, travel=travel).curves
    assert curves is not None
    return curves


def difference(scene: Curves, held: Curves) -> dict[str, float]:
    """Percent: y of points 1 and 3 of the largest y of the held belt, mean tilt of the larger tilt."""
    y = np.array([np.interp(scene.travel, held.travel, row) for row in held.y])
    off = 100.0 * np.abs(np.asarray(scene.y) - y).max(axis=1) / np.abs(held.y).max()
    one, other = (np.asarray(c.tilt)[:, np.asarray(c.travel) >= SETTLED].mean(axis=1) for c in (scene, held))
    tilt = 100.0 * np.abs(one - other).max() / np.abs(other).max()
    return {"point_1": float(off[0]), "point_3": float(off[2]), "tilt": float(tilt)}


def main() -> None:
    store = Path(sys.argv[1])
    done = {(r["rig"], r["tension"], r["dt_ms"]): r for r in csv.DictReader(store.open())} if store.exists() else {}
    pictures: dict[Contact, tuple[Curves, Curves]] = {}
    rows = []
    for case in CASES:
        key = (case.rig, f"{case.tension:g}", f"{case.dt:g}")
        if key not in done or len(sys.argv) > 2:
            pictures[case] = run(case, "mujoco"), run(case, "held")
            found = {name: f"{value:.1f}" for name, value in difference(*pictures[case]).items()}
            done[key] = dict(zip(("rig", "tension", "dt_ms"), key, strict=True)) | found
        rows.append(done[key])
        print(*rows[-1].values(), sep="  ", flush=True)
        with store.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
    if len(sys.argv) > 2:
        draw(Path(sys.argv[2]), pictures)


@style.picture
def draw(path: Path, found: dict[Contact, tuple[Curves, Curves]]) -> Path:
    """y of points 1 and 3 of both belts, a panel a case."""
    shown = [case for case in found if case.dt == 1.0]
    fig, axes = style.figure(11.0, 6.0, 2, 3)
    for ax, case in zip(np.ravel(axes), shown, strict=True):
        scene, held = found[case]
        for point, colour in ((0, BLUE), (2, RED)):
            ax.plot(held.travel, held.y[point] / MM, color=INK, linewidth=2.5, alpha=0.3)
            ax.plot(scene.travel, scene.y[point] / MM, color=colour, label=f"point {point + 1}")
        ax.set_title(f"{case.rig.replace('_', ' ')}, {case.tension:g} N/mm$^2$")
        ax.set_xlabel("travel [m]")
        ax.set_ylabel("y [mm]")
    np.ravel(axes)[0].legend(fontsize=8)
    style.title(fig, "Belt carried by MuJoCo's contacts (colour) over the held belt (grey)")
    return style.save(fig, path)


if __name__ == "__main__":
    main()
