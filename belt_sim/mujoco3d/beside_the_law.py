"""Runs of the study beside the strip law: python -m belt_sim.mujoco3d.beside_the_law FILE.json ... --picture FILE.png

FILE.json: what belt_sim.mujoco3d.study has written, sticking and slipping, at any tensions. Prints the largest
difference of each run from the law, of points 1-4 over the whole travel, and draws points 1 and 3 of all.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.mujoco3d.study import paper_case
from belt_sim.pictures.beside import Beside, beside_picture
from belt_sim.si import MM


def read(path: Path) -> Beside:
    """A run of the study and the strip law for its case."""
    content = json.loads(path.read_text())
    travel, y = np.array(content["curves"]["travel"]), np.array(content["curves"]["y"])
    case = paper_case(content["a"], content["tension"], content["yaw"])
    law = march(case, analytic_model("strip"), travel=float(travel[-1]))
    expected = np.array([np.interp(travel, law.travel, point) for point in law.y])
    return Beside(float(content["tension"]), float(content["options"]["friction"]), travel, y, expected)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.json")
    parser.add_argument("--picture", type=Path)
    a = parser.parse_args()
    runs = sorted((read(f) for f in a.files), key=lambda r: (r.tension, -r.friction))
    for r in runs:
        apart, largest = np.abs(r.y - r.law).max(), np.abs(r.law).max()
        print(
            f"{r.tension:g} N/mm2, friction {r.friction:g}, {r.travel[-1]:.0f} m: at most {apart / MM:.3f} mm apart, "
            f"{100 * apart / largest:.1f} % of the largest y"
        )
    if a.picture:
        print(beside_picture(a.picture, runs))


if __name__ == "__main__":
    main()
