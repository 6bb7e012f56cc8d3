"""The bench of the 3D belt as tables."""

from typing import Any

from rich.table import Table

from studies.bench.space.lammps import MISSING
from studies.bench.space.task import FULL, SHORT, Task
from studies.bench.space.workers import WANTED


def cost(product: dict[str, Any] | None) -> Table | None:
    """What runs of the product cost."""
    if product is None:
        return None
    headings = ("3D runs", "ms a step", "steps/m", "Newton its.", "memory MB", "CPU s", "limit s", "off strip law")
    table = Table(*headings, title="one core; late rates of points 1-4 against the strip law", title_justify="left")
    for name, task in (("short", SHORT), ("short_long_step", SHORT), ("full", FULL)):
        p = product[name]
        whole = p["travel_m"] >= p["whole_travel_m"]
        said = "" if whole else f" (from {p['travel_m']:g} m)"
        off = f"{100 * p['off_the_strip_law']:.1f} %" if whole else ""
        table.add_row(
            f"a = {task.rig.centre_distance:g} m, {task.travel:g} m, dt {1e3 * p['dt_s']:g} ms",
            f"{p['ms_per_step']:.2f}",
            f"{p['steps_per_m']:.0f}",
            f"{p['newton_iterations']:.0f}",
            f"{p['memory_bytes'] / 1e6:.0f}",
            f"{p['whole_cpu_s']:.0f}{said}",
            f"{task.limit:.0f}",
            off,
        )
    return table


def contenders(found: dict[str, Any], task: Task) -> Table | None:
    """CPU seconds of the short task by product, explicit integrator and LAMMPS, and how many times the product's."""
    rows = list(_rows(found, task))
    if not rows:
        return None
    table = Table("25 m on the short rig", "ms a step", "CPU s", "times product", "times product, 2 ms")
    product = found.get("product")
    for name, each, seconds in rows:
        ratios = ["", ""]
        if product and seconds is not None:
            ratios = [f"{seconds / product[k]['whole_cpu_s']:.1f}" for k in ("short", "short_long_step")]
        table.add_row(name, each, "" if seconds is None else f"{seconds:.0f}", *ratios)
    return table


def _rows(found: dict[str, Any], task: Task):
    """(name, ms a step, CPU seconds or None)."""
    if "product" in found:
        for name in ("short", "short_long_step"):
            p = found["product"][name]
            label = f"product, {1e3 * p['dt_s']:g} ms, {p['belt_speed_m_per_s']:g} m/s"
            yield label, f"{p['ms_per_step']:.3f}", p["whole_cpu_s"]
    if "explicit" in found:
        e = found["explicit"]
        label = f"same membrane, Euler, {1e6 * e['dt_s']:.2f} us, {e['belt_speed_m_per_s']:g} m/s"
        yield label, f"{e['ms_per_step']:.3f}", e["cpu_s_per_m"] * task.travel
    for across, figures in found.get("lammps", {}).items():
        if across == "elsewhere":
            off = f"{100 * figures['off_the_strip_law']:.0f} %"
            yield f"LAMMPS, 3 across, 1 m/s, another machine: late rate {off} high", "", figures["cpu_s"]
        elif figures is None:
            yield f"LAMMPS, {across} across", MISSING, None
        else:
            yield from _lammps(f"LAMMPS, {across} across, {1e6 * figures['dt_s']:.2f} us", figures)


def _lammps(name: str, figures: dict[str, Any]):
    for speed, seconds in figures["cpu_s"].items():
        yield f"{name}, {speed} m/s", f"{figures['ms_per_step']:.3f}", seconds
    speed, seconds = next(iter(figures["cpu_s_without_pulleys"].items()))
    yield f"{name}, {speed} m/s, bonds alone", f"{figures['ms_per_step_without_pulleys']:.3f}", seconds


def sweeps(workers: dict[str, Any] | None) -> Table | None:
    """One worker against two."""
    if workers is None:
        return None
    table = Table(f"{workers['cases']} cases of {workers['travel_m']:g} m", "wall s", "CPU s", "cores taken by others")
    for name in ("one_worker", "two_workers"):
        w = workers[name]
        others = "unknown" if w["cores_taken_by_others"] is None else f"{w['cores_taken_by_others']:.2f}"
        table.add_row(name.replace("_", " "), f"{w['wall_s']:.0f}", f"{w['cpu_s']:.0f}", others)
    table.add_row(f"ratio (wanted {WANTED:g})", f"{workers['ratio']:.2f}", f"2 x {workers['cpu_ratio'] / 2:.2f}", "")
    return table
