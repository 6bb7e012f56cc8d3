"""The belt of a plain MuJoCo scene beside the held belt: ``python -m studies.contact TABLE.csv``.

Each case is a rig, a tension, a step and a distance of nodes; the tail pulley is yawed by -0.042 degrees, and both
belts run 5 m. A row says how far y of points 1 and 3 is at most from the held belt's, of its largest y, the mean tilt
of both spans from 1 m on, and how far the tilt swings about the held belt's from there. A row of TABLE.csv that is
there is not run again; every core takes a case. Nothing in the scene knows how a belt turns where it lands.
"""

import csv
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

import belt_sim as bs
from belt_sim.curves import Curves
from studies.application import show_help

FAR, YAW = 5.0, -0.042  # [m], [degrees]
SETTLED = 1.0  # [m]: the tilt swings with the start of the run before


@dataclass(frozen=True)
class Contact:
    """One case: rig; tension [N/mm2]; step dt [ms] and distance of nodes dx [mm] of the scene."""

    rig: str
    tension: float
    dt: float = 1.0
    dx: float = 25.0


RIGS = [(rig, tension) for rig, tensions in (("test_rig", (10, 20, 40)), ("rope_example", (7, 20, 40)))
        for tension in tensions]  # fmt: skip
CASES = [Contact(*rig, dt, dx) for dt, dx in ((1.0, 25.0), (0.5, 25.0), (1.0, 12.5)) for rig in RIGS]


def run(case: Contact, contact: str, travel: float = FAR) -> Curves:
    """Curves of one belt; contact: as ``model.contact``."""
    model: dict[str, object] = {"name": "mujoco_flex", "contact": contact}
    if contact == "mujoco":
        model |= {"dt": 1e-3 * case.dt, "dx": 1e-3 * case.dx}
    curves = bs.simulate(model=model, rig=case.rig, tension=case.tension, yaw=YAW, travel=travel).curves
    assert isinstance(curves, Curves)
    return curves


def difference(scene: Curves, held: Curves) -> dict[str, float]:
    """Percent: y of points 1 and 3 of the largest y of the held belt, mean and swing of tilt of its larger mean."""
    y = np.array([np.interp(scene.travel, held.travel, row) for row in held.y])
    off = 100.0 * np.abs(np.asarray(scene.y) - y).max(axis=1) / np.abs(held.y).max()
    tilt = np.array([np.interp(scene.travel, held.travel, row) for row in np.asarray(held.tilt)])
    far = np.asarray(scene.travel) >= SETTLED
    apart, most = (np.asarray(scene.tilt) - tilt)[:, far], 0.01 * np.abs(tilt[:, far].mean(axis=1)).max()
    of_tilt = np.abs(apart.mean(axis=1)).max() / most, apart.std(axis=1).max() / most
    return dict(zip(("point_1", "point_3", "tilt", "swing"), map(float, (off[0], off[2], *of_tilt)), strict=True))


def main() -> None:
    store = Path(sys.argv[1])
    done = {tuple(r.values())[:4]: r for r in csv.DictReader(store.open())} if store.exists() else {}
    keys = {tuple(v if isinstance(v, str) else f"{v:g}" for v in astuple(case)): case for case in CASES}
    asked = {key: case for key, case in keys.items() if key not in done}
    with ProcessPoolExecutor() as workers:
        held = {(case.rig, case.tension): workers.submit(run, case, "held") for case in asked.values()}
        under_way = {workers.submit(run, case, "mujoco"): key for key, case in asked.items()}
        for ended in as_completed(under_way):
            key, case = under_way[ended], asked[under_way[ended]]
            apart = difference(ended.result(), held[case.rig, case.tension].result())
            found = {name: f"{value:.1f}" for name, value in apart.items()}
            done[key] = dict(zip(("rig", "tension", "dt_ms", "dx_mm"), key, strict=True)) | found
            print(*done[key].values(), sep="  ", flush=True)
            with store.open("w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, list(done[key]))
                writer.writeheader()
                writer.writerows(done[k] for k in keys if k in done)


if __name__ == "__main__":
    show_help(__doc__)
    main()
