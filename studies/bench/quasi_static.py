"""What a step of the batched 3D belt costs: ``python -m studies.bench.quasi_static [native] [TABLE.csv PICTURE.png]``.

Milliseconds a step against the number of cases and of stations, compilation apart, beside the time in which the memory
would bring the bytes that the step moves; with ``native`` beside MuJoCo's run of the same belt in the same process.
Time is that of the clock on a GPU, and CPU time on a CPU, which minds less what else the machine does.
"""

import sys
import time
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
from matplotlib.ticker import LogLocator

from belt_sim.case import Belt, Case, Rig, Schedule, Settings
from belt_sim.io import write_with
from belt_sim.jax_setup import in_float64, prepare
from belt_sim.show import style
from belt_sim.show.style import BLUE, RED
from belt_sim.space.options import Options
from belt_sim.space.quasi_static import prepare_case, run_batch

RIG = Rig(centre_distance=11.28, head_radius=0.17, tail_radius=0.17, gravity=9.81)
BELT = Belt(width=0.2, thickness=3e-4, youngs_modulus=210e9, density=7850.0, poisson_ratio=0.3)
TRAVEL = 0.5  # [m], after a run-in of as much
REPEATS = 3
ON_CPU = ((1, 0.025), (2, 0.025), (4, 0.025), (1, 0.04), (1, 0.0125))  # cases, distance of stations [m]
ON_GPU = (*((cases, 0.025) for cases in (1, 4, 16, 64, 256, 1024)), (64, 0.04), (64, 0.0125))


def case_at(tension: float) -> Case:
    """The full rig at a tension [N/mm2], yawed by -0.042 deg."""
    return Case(rig=RIG, belt=BELT, settings=Settings(tension=tension * 1e6, yaw=Schedule.step(-0.042 * np.pi / 180)))


def clock() -> float:
    """Seconds: of this process's work on a CPU, by the clock on a GPU."""
    return time.process_time() if jax.default_backend() == "cpu" else time.perf_counter()


@in_float64
def step_time(cases: int, dx: float) -> dict[str, Any]:
    """A row of the table: cases, stations, milliseconds and bytes a step of all ``cases`` together, the best of some
    runs, and the bytes a second that the memory brings at the same time."""
    options = Options(dx=dx, run_in=TRAVEL)
    ready = [prepare_case(case_at(t), travel=TRAVEL, options=options) for t in np.geomspace(10, 60, cases)]
    arrays = jax.tree.map(lambda *v: np.stack(v), *[(r.belt, r.state, r.commands) for r in ready])
    arrays = jax.device_put(arrays)
    march = run_batch.lower(*arrays).compile()
    steps = ready[0].commands.travel.size
    taken = min(_seconds(march, *arrays) for _ in range(REPEATS)) / steps
    moved = float((march.cost_analysis() or {}).get("bytes accessed", np.nan))  # the loop's body is counted once
    row = {"device": str(jax.devices()[0].device_kind), "cases": cases, "stations": ready[0].stations}
    return row | {"ms": 1e3 * taken, "megabytes": 1e-6 * moved, "gigabytes_a_second": 1e-9 * bandwidth()}


def _seconds(function: Any, *arrays: Any) -> float:
    begun = clock()
    jax.block_until_ready(function(*arrays))
    return clock() - begun


@in_float64
def bandwidth(numbers: int = 20_000_000) -> float:
    """Bytes a second of a = b + s c on arrays that no cache holds."""
    b, c = jnp.ones(numbers), jnp.ones(numbers)
    triad = jax.jit(lambda b, c: b + 3.0 * c)
    _seconds(triad, b, c)
    return 3 * 8 * numbers / min(_seconds(triad, b, c) for _ in range(REPEATS))


def native_beside(near: float = 0.5, far: float = 2.0) -> None:
    """CPU seconds a metre of one case, without what a run begins with: MuJoCo's run and this engine's."""
    from belt_sim.space.native import run_native

    options = Options(run_in=TRAVEL)
    spent = []
    for travel in (near, far):
        begun = time.process_time()
        run_native(case_at(40.0), travel=travel, options=options)
        spent.append(time.process_time() - begun)
    native = (spent[1] - spent[0]) / (far - near)
    here = 1e-3 * step_time(1, options.dx)["ms"] * options.steps / options.sample
    print(f"native {native:.2f} CPU s a metre, quasi_static {here:.2f}, {native / here:.1f} times less; ")
    print(f"{near:g} m with its beginning take native {spent[0]:.1f} CPU s")


@style.picture
def picture(path: Path, table: pd.DataFrame) -> Path:
    """Milliseconds a step against stations and cases, with the slope of each line."""
    fig, [[stations, cases]] = style.figure(9.6, 4.2, columns=2)
    for (device, rows), colour in zip(table.groupby("device", sort=False), (BLUE, RED), strict=False):
        usual = rows[rows["stations"] == rows["stations"].mode()[0]]
        fewest = rows[rows["cases"].isin(rows.loc[rows["stations"] != usual["stations"].iloc[0], "cases"])]
        for axes, part, by in ((cases, usual, "cases"), (stations, fewest, "stations")):
            part = part.sort_values(by)
            if len(part) > 1:
                high = part.tail(3)
                slope = np.polyfit(np.log(high[by]), np.log(high["ms"]), 1)[0]
                alike = "" if by == "cases" else f", {int(part['cases'].iloc[0])} at once"
                label = f"{device}{alike}: slope {slope:.2f} over the last {len(high)}"
                axes.loglog(part[by], part["ms"], "o-", color=colour, label=label)
    cases.set_ylim(bottom=0.05)  # room for the names
    for axes, by in ((cases, "cases"), (stations, "stations")):
        axes.set(xlabel=by, ylabel="ms a step")
        for axis in (axes.xaxis, axes.yaxis):  # plain numbers, few of them between the tens
            axis.set_major_formatter("{x:g}")
            axis.set_minor_locator(LogLocator(subs=(2, 5)))
            axis.set_minor_formatter("{x:g}")
        axes.legend(loc="lower right", fontsize="small")
    style.title(fig, "A step of the batched 3D belt")
    return style.save(fig, path)


def main(arguments: list[str]) -> None:
    """Measure and draw; rows of other devices that the table has already are kept."""
    prepare(space=True)
    found = []
    for cases, dx in ON_CPU if jax.default_backend() == "cpu" else ON_GPU:
        found.append(step_time(cases, dx))
        row = found[-1]
        least = row["megabytes"] / row["gigabytes_a_second"]
        print(row, f"{row['ms'] / least:.2f} times as long as the memory needs for these bytes", flush=True)
    if "native" in arguments:
        native_beside()
    files = [Path(a) for a in arguments if a != "native"]
    if files:
        table = pd.DataFrame(found)
        if files[0].is_file():
            before = pd.read_csv(files[0])
            table = pd.concat([before[~before["device"].isin(table["device"])], table])
        write_with(files[0], lambda draft: table.to_csv(draft, index=False, float_format="%.4g"))
        print(picture(files[1], table))


if __name__ == "__main__":
    main(sys.argv[1:])
