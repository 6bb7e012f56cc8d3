"""The landing rule against contact alone: ``python -m studies.contact CASES.csv [PICTURE.png]``.

On the short rig (a = 2 m) a belt that MuJoCo's contacts carry is yawed while it runs, beside the same belt without yaw;
the difference of y at points 1 and 3 after 1, 1.5 and 2 m stands against the strip law. Nothing in that scene knows how
a belt turns where it lands. Each case is a row of CASES.csv; a case that is there is not run again. The yawed belt and
its control run at once, by mujoco.rollout in two threads. Prints the table, and y extrapolated to rigid contact.
"""

import csv
import math
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

import belt_sim as bs
from belt_sim.case import Case, Schedule
from belt_sim.config import make_case
from belt_sim.jax_setup import prepare
from belt_sim.line.span import torsional_stiffness
from belt_sim.scene_parts import SceneParts
from belt_sim.show import style
from belt_sim.show.style import BLUE, INK, RED
from belt_sim.si import DEGREE, MM
from belt_sim.space.calibration import matching_width
from belt_sim.space.mujoco_interface import compile_model
from belt_sim.space.options import Options, fit_options
from belt_sim.space.rolling_contact import ContactLaw, build_contact

READ = (1.0, 1.5, 2.0)  # [m] of travel after the yaw
RAMP = 0.1  # [m] over which the pulley is yawed; the law has the same ramp
RUN_IN = 0.8  # [m]: one and a half wraps
WINDOW = 0.05  # [m] of travel that a reading is the mean of, two landings
COVERS = (0.0, 0.25, 0.5, 1.0, 1.5)  # E I c of the covers that the law is computed with
CHUNK = 250  # steps of one call of rollout, whose states it returns all


@dataclass(frozen=True, kw_only=True)
class Contact:
    """One case.

    tension [N/mm2]; yaw [degrees]; dx [mm]; dt [ms]; speed [m/s]; timeconst [ms] (solref); dmin, dmax, width [um] and
    power of solimp; impratio; friction; held: 1 = the native engine, which holds landed nodes."""

    tension: float = 20.0
    yaw: float = -0.042
    dx: float = 25.0
    dt: float = 1.0
    speed: float = 0.5
    timeconst: float = 2.0
    dmin: float = 0.998
    dmax: float = 0.9998
    width: float = 100.0
    power: float = 2.0
    impratio: float = 1000.0
    friction: float = 10.0
    held: float = 0.0


FINE = {"dt": 0.5, "timeconst": 1.0}  # as stiff as the step bears: a time constant of two steps
CASES = [
    Contact(),
    Contact(**FINE),
    Contact(timeconst=4.0),
    Contact(friction=0.3),
    Contact(impratio=1e4),
    Contact(speed=1.0),
    Contact(dx=12.5, **FINE),
    Contact(held=1.0),
    Contact(yaw=-0.01, **FINE),
    Contact(tension=40.0),
    Contact(tension=40.0, **FINE),
    Contact(tension=40.0, held=1.0),
    Contact(tension=7.0, yaw=-0.005),
    Contact(tension=7.0, yaw=-0.005, held=1.0),
]


def main() -> None:
    prepare()
    store = Path(sys.argv[1])
    done = read(store) if store.exists() else {}
    for case in CASES:
        if case not in done:
            done[case] = run(case)
            append(store, case, done[case])
    done = {case: done[case] for case in CASES}
    print(HEADINGS, *(row(case, found) for case, found in done.items()), sep="\n")
    print(*rigid(done), *covers(done), sep="\n")
    if len(sys.argv) > 2:
        draw(Path(sys.argv[2]), done)


def run(contact: Contact) -> dict[str, float]:
    """y [mm] of points 1 and 3 at READ, penetration [um], drift without yaw [um/m], CPU seconds; nan: it failed."""
    began = time.process_time()
    if contact.held:
        travel, (yawed, still), sunk = run_native(contact)
    else:
        travel, (yawed, still), sunk = run_contact(model_of(contact), contact)
    found = {"penetration": sunk * 1e6}
    for point in (1, 3):
        moved = yawed[:, point - 1] - still[:, point - 1]
        start = window_mean(travel, moved, -WINDOW)
        for place in READ:
            found[f"y{point}_{place:g}"] = (window_mean(travel, moved, place) - start) / MM
    found["drift"] = (
        (window_mean(travel, still[:, 0], READ[-1]) - window_mean(travel, still[:, 0], -WINDOW)) * 1e6 / READ[-1]
    )
    return found | {"cpu": time.process_time() - began}


def run_native(contact: Contact) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], float]:
    """The same of the engine that holds landed nodes, which needs no control run and knows no penetration."""
    model = {"name": "mujoco_flex", "dx": contact.dx * MM, "dt": contact.dt * 1e-3, "sample": 0.5 * WINDOW}
    curves = bs.simulate(case_of(contact), model=model, travel=READ[-1] + WINDOW).curves
    assert curves is not None
    travel = np.append(-WINDOW, curves.travel)
    y = np.vstack([np.zeros(4), curves.y.T])
    return travel, (y, np.zeros_like(y)), 0.0


def case_of(contact: Contact) -> Case:
    """The short rig at its tension, its pulley yawed while it runs."""
    case = make_case(rig="rope_example", tension=contact.tension)
    return replace(case, settings=replace(case.settings, yaw=Schedule.ramp(contact.yaw * DEGREE, at=0.0, over=RAMP)))


def model_of(contact: Contact) -> mujoco.MjModel:
    """The scene with this contact."""
    case = case_of(contact)
    asked = Options(dx=contact.dx * MM, dt=contact.dt * 1e-3, belt_speed=contact.speed, friction=contact.friction)
    options = fit_options(asked, case, "flex")
    spec, _ = build_contact(case, "flex", options, SceneParts.from_case(case, contact.friction), contact_law(contact))
    model = compile_model(spec)
    model.opt.impratio = contact.impratio
    return model


def contact_law(contact: Contact) -> ContactLaw:
    """As the scene wants it."""
    solimp = contact.dmin, contact.dmax, contact.width * 1e-6, 0.5, contact.power
    return ContactLaw(contact.timeconst * 1e-3, solimp, contact.friction)


def run_contact(model: mujoco.MjModel, contact: Contact) -> tuple[np.ndarray, np.ndarray, float]:
    """Travel [m], shape (n,), y of points 1-4 with the yaw and without it [m], shape (2, n, 4), and how far nodes have
    sunk in at the end of the run-in, on average [m]."""
    with ThreadPoolExecutor(2) as pool:
        (yawed, _), (still, sunk) = pool.map(lambda yaw: _one(model, contact, yaw), (contact.yaw, 0.0))
    edges = [(sensor(model, f"edge-{p}-left"), sensor(model, f"edge-{p}-right")) for p in (1, 2, 3, 4)]
    y = np.array(
        [np.stack([0.5 * (s[:, right] - s[:, left]) for left, right in edges], axis=-1) for s in (yawed, still)]
    )
    radius = float(case_of(contact).rig.head_radius)
    return still[:, sensor(model, "head-spin")] * radius - RUN_IN, y, sunk


def _one(model: mujoco.MjModel, contact: Contact, yaw: float) -> tuple[np.ndarray, float]:
    """Sensor readings of every step, shape (n, k), and how far nodes have sunk in at the end of the run-in [m].

    A thread for each belt: a pool of rollout would hand one belt's warm start to the other.
    """
    data, dt, warm, sunk = mujoco.MjData(model), model.opt.timestep, None, math.nan
    mujoco.mj_resetDataKeyframe(model, data, model.key("running").id)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    straight, sensed = data.ctrl.copy(), []
    straight[model.actuator("tail_yaw").id] = 0.0
    steps = round((RUN_IN + RAMP + READ[-1] + WINDOW) / contact.speed / dt)
    first, over = round(RUN_IN / contact.speed / dt), RAMP / contact.speed / dt
    with rollout.Rollout(nthread=0) as alone:
        for begin in range(0, steps, CHUNK):
            k = np.arange(begin, min(begin + CHUNK, steps))
            control = np.tile(straight, (1, len(k), 1))
            control[0, :, model.actuator("tail_yaw").id] = yaw * np.clip((k + 1 - first) / over, 0.0, 1.0)
            states, chunk = alone.rollout(model, data, state, control, initial_warmstart=warm)
            state, warm = states[0, -1], data.qacc_warmstart.copy()
            sensed.append(chunk[0])
            if begin <= first < begin + CHUNK:
                sunk = -float(np.mean(data.contact.dist[: data.ncon]))
    return np.concatenate(sensed), sunk


def sensor(model: mujoco.MjModel, name: str) -> int:
    """Where a sensor's number stands in sensordata."""
    return int(model.sensor(name).adr[0])


def window_mean(travel: np.ndarray, y: np.ndarray, place: float) -> float:
    """Mean of y over WINDOW of travel about ``place`` [m]."""
    return float(np.mean(y[np.abs(travel - place) <= 0.5 * WINDOW]))


@lru_cache
def law(tension: float, yaw: float, dx: float, cover: float = 0.0) -> dict[str, float]:
    """y [mm] by the strip law with a soft cover of E I c = ``cover``.

    It is the law of a strip with the torsional stiffness of two lines of nodes, F b'^2 / 4. The lines lack 7-15 % of
    the strip's (engine.py adds that in the native engine, MJCF cannot). A strip of another width with the same
    E b^3 h / 12 and b h has it.
    """
    case = case_of(Contact(tension=tension, yaw=yaw, dx=dx))
    belt = case.belt
    lines = matching_width(float(belt.width), dx * MM, 2, float(belt.poisson_ratio))
    wanted, width = float(case.tension_force) * lines**2 / 4.0, float(belt.width)
    for _ in range(20):
        share = width / float(belt.width)
        strip = replace(
            belt, width=width, thickness=belt.thickness / share, youngs_modulus=belt.youngs_modulus / share**2
        )
        width *= (wanted / float(torsional_stiffness(replace(case, belt=strip)))) ** 0.5
    effects = [{"id": "soft_cover", "c": cover / float(belt.bending_stiffness)}] if cover else None
    curves = bs.simulate(replace(case, belt=strip), model="strip", effects=effects, travel=READ[-1] + 0.1).curves
    assert curves is not None
    return {f"y{p}_{s:g}": float(np.interp(s, curves.travel, curves.y[p - 1])) / MM for p in (1, 3) for s in READ}


def read(store: Path) -> dict[Contact, dict[str, float]]:
    """The cases of a table."""
    names = [f.name for f in fields(Contact)]
    with store.open(encoding="utf-8", newline="") as file:
        rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader(file)]
    return {Contact(**{n: r.pop(n) for n in names}): r for r in rows}


def append(store: Path, case: Contact, found: dict[str, float]) -> None:
    """One more row."""
    store.parent.mkdir(parents=True, exist_ok=True)
    entry = {k: f"{v:g}" for k, v in asdict(case).items()} | {k: f"{v:.5g}" for k, v in found.items()}
    new = not store.exists()
    with store.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(entry))
        if new:
            writer.writeheader()
        writer.writerow(entry)


HEADINGS = """| case | y_1 [mm] at 1 / 1.5 / 2 m (law) | y_3 (law) | sunk in um | drift um/m | CPU s |
|---|---|---|---|---|---|"""


def row(case: Contact, found: dict[str, float]) -> str:
    """A line of the table: what differs from the first case, y of points 1 and 3 and the law's, penetration, drift."""
    expected = law(case.tension, case.yaw, case.dx)

    def numbers(point: int, of: dict[str, float]) -> str:
        return " / ".join(f"{of[f'y{point}_{s:g}']:.3f}" for s in READ)

    said = [f"{numbers(p, found)} ({numbers(p, expected)})" for p in (1, 3)]
    rest = (f"{found['penetration']:.0f}", f"{found['drift']:.1f}", f"{found['cpu']:.0f}")
    return "| " + " | ".join([label(case), *said, *rest]) + " |"


def label(case: Contact) -> str:
    """What differs from the first case, and the tension."""
    standard = asdict(Contact())
    return ", ".join(f"{k} {v:g}" for k, v in asdict(case).items() if v != standard[k] or k == "tension")


def series(done: dict[Contact, dict[str, float]]) -> dict[tuple[float, float, float], list[Contact]]:
    """(tension, yaw, dx) -> the cases that differ in step and stiffness alone, the hardest first."""
    found: dict[tuple[float, float, float], list[Contact]] = {}
    for case in done:
        if case == Contact(tension=case.tension, yaw=case.yaw, dx=case.dx, dt=case.dt, timeconst=case.timeconst):
            found.setdefault((case.tension, case.yaw, case.dx), []).append(case)
    return {k: sorted(v, key=lambda c: done[c]["penetration"]) for k, v in found.items() if len(v) > 1}


def to_rigid(cases: list[Contact], done: dict[Contact, dict[str, float]], name: str) -> tuple[float, float]:
    """y [mm] where nothing sinks in, and its slope over the penetration, by the two hardest contacts."""
    (p1, y1), (p2, y2) = ((done[c]["penetration"], done[c][name]) for c in cases[:2])
    slope = (y2 - y1) / (p2 - p1)
    return y1 - slope * p1, slope


def rigid(done: dict[Contact, dict[str, float]]) -> Iterator[str]:
    """Lines: y extrapolated to contact into which nothing sinks, beside the law."""
    for (tension, yaw, dx), cases in series(done).items():
        expected = law(tension, yaw, dx)
        for point in (1, 3):
            names = [f"y{point}_{s:g}" for s in READ]
            most = max(abs(e) for e in expected.values())
            y0 = [to_rigid(cases, done, n)[0] for n in names]
            told = " / ".join(f"{y:.4f} ({expected[n]:.4f})" for y, n in zip(y0, names, strict=True))
            off = " / ".join(f"{100 * (y - expected[n]) / most:+.0f}" for y, n in zip(y0, names, strict=True))
            yield f"rigid, {tension:g} N/mm2, {yaw:g} deg, {dx:g} mm: y_{point} {told}, {off} % of the largest y off"


def covers(done: dict[Contact, dict[str, float]]) -> Iterator[str]:
    """Lines: the soft cover (effect soft_cover) that brings the strip law nearest to a contact, and how near.

    Given as E I c, the turn by the cover over the turn by the span's curvature.
    """
    names = [f"y{p}_{s:g}" for p in (1, 3) for s in READ]
    for case, found in done.items():
        if case.held:
            continue
        y = np.array([found[n] for n in names])
        laws = np.array([[law(case.tension, case.yaw, case.dx, share)[n] for n in names] for share in COVERS])
        best = min(
            (float(np.sum((y - at_cover(laws, share)) ** 2)), float(share))
            for share in np.linspace(0.0, COVERS[-1], 201)
        )[1]
        most = np.abs(laws[0]).max()
        rms = [100 * float(np.sqrt(np.mean((y - of) ** 2))) / most for of in (laws[0], at_cover(laws, best))]
        yield f"{label(case)}: E I c = {best:.2f}; rms of the difference {rms[0]:.1f} %, with the cover {rms[1]:.1f} %"


def at_cover(laws: np.ndarray, share: float) -> np.ndarray:
    """The law's six numbers with a cover between those of COVERS."""
    return np.array([np.interp(share, COVERS, column) for column in laws.T])


@style.picture
def draw(path: Path, done: dict[Contact, dict[str, float]]) -> Path:
    """y of points 1 and 3 over the give of the contact, the law at its edge."""
    panels = {k: v for k, v in series(done).items() if k[2] == Contact().dx}
    fig, [axes] = style.figure(11.0, 3.6, 1, len(panels))
    for ax, ((tension, yaw, dx), cases) in zip(axes, panels.items(), strict=True):
        expected, sunk = law(tension, yaw, dx), np.array([done[c]["penetration"] for c in cases])
        for point, colour in ((1, BLUE), (3, RED)):
            for place, mark in zip(READ, "os^", strict=True):
                name = f"y{point}_{place:g}"
                y0, slope = to_rigid(cases, done, name)
                ax.plot(sunk, [done[c][name] for c in cases], mark, color=colour, label=f"point {point}, {place:g} m")
                ax.plot([0.0, sunk[1]], [y0, y0 + slope * sunk[1]], color=colour, linewidth=0.8)
                ax.plot(0.0, expected[name], mark, color=INK, fillstyle="none", markersize=9, clip_on=False)
        ax.set_title(f"{tension:g} N/mm$^2$, yaw {yaw:g} deg")
        ax.set_xlabel("the belt has sunk in [um]")
    axes[0].set_ylabel("y [mm]")
    axes[-1].legend(fontsize=7)
    style.title(fig, "Belt carried by contact: filled; strip law: open, where nothing sinks in")
    return style.save(fig, path)


if __name__ == "__main__":
    main()
