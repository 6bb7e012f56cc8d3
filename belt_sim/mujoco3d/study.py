"""One 3D run from the command line, with what it cost: python -m belt_sim.mujoco3d.study --out DIR --set dt=5e-4 ...

Writes DIR/NAME.json: the resolved options, the curves at every 0.1 m (SI), late rates and the cost. The tables of
docs/three_dimensions.md are made of these files.
"""

import argparse
import json
import resource
import signal
import time
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import yaml

from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import Curves, late_rates
from belt_sim.effects.load import load_effects
from belt_sim.errors import RunFailed
from belt_sim.mujoco3d.model import SpaceModel
from belt_sim.mujoco3d.options import Options
from belt_sim.rig import Belt, Rig
from belt_sim.si import DEGREE, MM_PER_M, N_PER_MM2

#: the paper's belt; steel and its density are assumed, the paper does not give them
BELT = Belt(width=0.2, thickness=3e-4, youngs_modulus=210e9, density=7850.0)
_EVERY = 4  # rows of the curves between rows of the file


def paper_case(centre_distance: float, tension: float, yaw: float) -> Case:
    """A rig of the paper at a tension [N/mm2] with the tail pulley yawed by ``yaw`` [deg] at travel 0."""
    rig = Rig(centre_distance=centre_distance, head_radius=0.17, tail_radius=0.17)
    settings = Settings(tension=tension * N_PER_MM2, yaw=Schedule.step(yaw * DEGREE))
    return Case(rig=rig, belt=BELT, settings=settings)


def options_from(pairs: list[str]) -> Options:
    """Options from ``name=value`` pairs."""
    kinds: dict[str, Any] = {f.name: type(f.default) for f in fields(Options)}
    values: dict[str, Any] = {}
    for pair in pairs:
        name, _, text = pair.partition("=")
        kind = kinds[name]
        values[name] = tuple(text.split("+")) if kind is tuple else text if kind is str else kind(float(text))
    return Options(**values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--belt", default="flex")
    parser.add_argument("--a", type=float, default=11.28, help="centre distance, m")
    parser.add_argument("--tension", type=float, default=40.0, help="N/mm2")
    parser.add_argument("--yaw", type=float, default=-0.042, help="deg")
    parser.add_argument("--travel", type=float, default=3.0, help="m")
    parser.add_argument("--set", nargs="*", default=[], metavar="OPTION=VALUE")
    parser.add_argument(
        "--effects", default=None, metavar="YAML", help="as of belt-sim simulate: [{id: ..., ...: ...}]"
    )
    parser.add_argument("--limit", type=int, default=0, help="stop after this many seconds and keep what there is")
    a = parser.parse_args()
    signal.signal(signal.SIGALRM, _out_of_time)
    signal.alarm(a.limit)
    options = options_from(a.set)
    started, failure = time.process_time(), None
    try:
        case, effects = paper_case(a.a, a.tension, a.yaw), load_effects(yaml.safe_load(a.effects or "null"))
        model = SpaceModel(belt=a.belt, options=options)
        curves = model.run(case, effects, travel=a.travel)
    except RunFailed as error:
        curves, failure = error.curves, str(error)
    report = {k: v for k, v in vars(a).items() if k not in ("out", "set")}
    report |= {"options": asdict(options), "failure": failure, "mujoco": mujoco.__version__}
    report |= {"cpu_s": time.process_time() - started, **_cost(curves), "curves": _columns(curves)}
    a.out.mkdir(parents=True, exist_ok=True)
    unfinished = a.out / f"{a.name}.part"
    unfinished.write_text(json.dumps(report))
    unfinished.rename(a.out / f"{a.name}.json")
    rates = np.round(late_rates(curves) / MM_PER_M, 4).tolist() if len(curves.travel) > 10 else None
    print(a.name, "late mm/m", rates, f"cpu {report['cpu_s']:.0f} s", failure or "")


def _out_of_time(*_: object) -> None:
    raise RunFailed("stopped by --limit")


def _cost(curves: Curves) -> dict[str, float]:
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    steps = float(curves.extra["steps"][-1]) if curves.extra and len(curves.travel) else 0.0
    return {"memory_bytes": memory, "steps": steps}


def _columns(curves: Curves) -> dict[str, list]:
    table = {"travel": curves.travel, "sag": curves.sag} | dict(curves.extra or {})
    table |= {name: getattr(curves, name) for name in ("y", "angle", "moment", "edge_stress", "tilt")}
    out = {}
    for name, values in table.items():
        kept = np.asarray(values) if name == "sag" else np.asarray(values)[..., ::_EVERY]
        out[name] = np.vectorize(lambda v: float(f"{v:.7g}"))(kept).tolist() if kept.size else []
    return out


if __name__ == "__main__":
    main()
