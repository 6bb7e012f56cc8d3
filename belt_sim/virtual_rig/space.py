"""A campaign measured on the three-dimensional belt: what is hidden is geometry, friction or gravity in the scene.

The scene is of no law, so that the effect of the same name changes it by its own ``scene``. The rig imports none: who
asks for a campaign says how effects are made (``belt_sim.effects.load.load_effects``).
"""

import math
import multiprocessing
import secrets
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Machine, Quantity
from belt_sim.case import GRAVITY, Case, Schedule, Settings
from belt_sim.curves import Curves
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.jax_setup import cores
from belt_sim.scene_parts import SceneParts
from belt_sim.space.options import Options, accurate_speed, refuse_sliding_limp
from belt_sim.units import N_PER_MM2
from belt_sim.virtual_rig.faults import Fault
from belt_sim.virtual_rig.hidden import HiddenFaults, specified_hidden
from belt_sim.virtual_rig.make import BASES, Truth, build_campaign, check_base, check_seed, describe_truth
from belt_sim.virtual_rig.march import TrueErrors, add_noise, draw_errors, true_machine
from belt_sim.virtual_rig.plan import TEST_BELT, Noise, Plan, grid

#: A narrow belt, so that the bending stress of its edges, 2 E b beta/L = 5.3 N/mm2 at the yaw below, stays under its
#: tension, and K L = 0.48 ... 1.17 makes the tension felt; Lambda = 0.41 at 10 N/mm2, 0.002 at 60.
SHORT_RIG = Machine(
    centre_distance=Quantity(value=2.0, u=5e-4),
    head_radius=Quantity(value=0.170, u=1e-4),
    tail_radius=Quantity(value=0.170, u=1e-4),
)
NARROW_BELT = replace(
    TEST_BELT,
    width=Quantity(value=0.1, u=5e-5),
    thickness=Quantity(value=3e-4, u=1e-6),
    youngs_modulus=Quantity(value=210e9, u=2e9),
)
TENSIONS = (10.0 * N_PER_MM2, 20.0 * N_PER_MM2, 40.0 * N_PER_MM2, 60.0 * N_PER_MM2)
YAW = 2.5e-4  # [rad]
RUN_TRAVEL, SPACING = 12.0, 0.1  # [m]

#: What the sensors do. They are no better than this on purpose: noise much below what the simulator itself is off by
#: (python -m studies.space_error) would let a diagnosis see the mesh. The signals are tenths of a millimetre.
SENSORS = Noise(
    white=5e-6, zero=1e-5, wander_sd=1e-5, wander_length=2.0, tilt_white=2e-5, tension_rel=0.005, yaw_u=1e-6
)


def space_plan(tensions: Sequence[float] = TENSIONS, repeats: int = 2, length: float = RUN_TRAVEL) -> Plan:
    """Ten runs: four tensions, yaw to either side, two runs made again."""
    runs = []
    for run in grid(tensions, (-YAW, YAW), repeats):  # each at the speed at which the belt really runs in the scene
        string_speed = math.sqrt(run.tension / NARROW_BELT.density.value)
        runs.append(replace(run, speed=round(accurate_speed(string_speed), 2)))
    return Plan(runs=tuple(runs), length=length, spacing=SPACING, machine=SHORT_RIG, belt=NARROW_BELT)


#: Engine -> a share of every reading, and what wanders beside it [m]: how far a campaign with nothing hidden is off the
#: 1D line, mesh and law together (python -m studies.space_error). The worst signal is stated: this error is the same in
#: every repeat, where a diagnosis cannot see it. native: the best factor of a signal is 1.0 % off 1 (rms; 2.4 % at
#: most), what it leaves over is 1.6 um (2.7 um at most); quasi_static: 0.3 % (0.5 at most), 1.6 um (1.8 at most).
OWN_ERROR = {"native": (0.02, 3e-6), "quasi_static": (0.005, 2e-6)}


def with_simulator_error(sensors: Noise, engine: str = "native") -> tuple[Noise, str]:
    """The sensors' noise with the simulator's own error added in squares, and a sentence for the file."""
    gain, wander = OWN_ERROR[engine]
    stated = replace(
        sensors, gain=(sensors.gain**2 + gain**2) ** 0.5, wander_sd=(sensors.wander_sd**2 + wander**2) ** 0.5
    )
    return stated, f"gain and wander cover the simulator's own error ({gain:.1%} of a reading, {wander * 1e6:g} um)"


#: Fine enough for minutes; what it costs in accuracy the campaign file states (python -m studies.space_error).
OPTIONS = Options(dx=0.02, run_in=0.0)
REFERENCE = "belt-sim virtual-rig engine=mujoco: a membrane belt in 3D ({engine}); {error}"
_POINTS = {f"point_{k + 1}": k for k in range(4)}
_TILTS = {"upper_mid_span": 0, "lower_mid_span": 1}


#: what can be hidden in the scene: its weight, and effects that have a ``scene``
WEIGHT = "sag_roll"
IN_SCENE = (
    *("camber", "cant", "crown", "edge_guide", "flatness", "idler_skew", "idler_skew_lower", "lift_off"),
    *("machine_tilt", "off_centre_load", "off_centre_load_lower", "pulley_deflection", WEIGHT, "side_drag"),
    *("side_drag_lower", "slip", "taper", "temperature_difference", "thickness_wedge", "unequal_tension", "weld"),
    *("wobble", "yaw_compliance", "yaw_offset_head", "yaw_offset_tail"),
)
#: (entries {id, numbers}) -> effects
EffectLoader = Callable[[list[dict[str, Any]]], Sequence[Any]]


def make_space_campaign(
    load: EffectLoader,
    *,
    hidden: HiddenFaults | Sequence[str | dict] = (),
    seed: int | None = None,
    base: str | None = None,
    plan: Plan | None = None,
    options: Options = OPTIONS,
    title: str = "Virtual rig in three dimensions",
    name: str = "",
    workers: int | None = None,
    engine: str | None = None,
    tell: Callable[[], Any] = lambda: None,
) -> tuple[Campaign, Truth]:
    """Measure the plan on the 3D belt; the same seed and machine give the same campaign.

    load: makes the effects of what is hidden; hidden: ids, or dictionaries {"id", parameters in SI}, or as drawn; base:
    the law that the campaign is meant for, strip unless stated, or beam_th2: a belt without weight, which sag_roll
    makes heavy; name: of the plan; workers: processes, one a core; engine: quasi_static or native, by default
    quasi_static where it can do what is hidden; tell: called as each run is measured.
    """
    what = hidden if isinstance(hidden, HiddenFaults) else specified_hidden(hidden, None)
    for fault in what.faults:
        if fault.id not in IN_SCENE:
            remedy = f"has no scene; use one of {', '.join(IN_SCENE)}, or engine=line"
            raise InputError("hidden", fault.id, "", remedy)
    effects = scene_effects(load, what.faults)
    usual = (b for b in reversed(BASES) if not any(b in f.part_of for f in what.faults))
    base = check_base(base or next(usual), what.faults)
    plan = plan or space_plan()
    seed = secrets.randbits(63) if seed is None else check_seed(seed)
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3)]
    errors = draw_errors(plan, SENSORS, streams[0])
    cases = true_cases(plan, base, errors, what.faults)
    if not engine:  # quasi_static is many times faster, where it can do what the faults make of the scene
        engine = "quasi_static"
        try:
            refuse_sliding_limp("flex", options, scene_parts(cases[0], effects, options))
        except CannotRepresent:
            engine = "native"
    run = partial(run_scene, effects=effects, options=options, travel=plan.length, engine=engine)
    readings = take_readings(plan, measure(cases, run, workers, tell))
    readings = add_noise(readings, plan.travel, SENSORS.sheets(plan), SENSORS, streams[1])
    stated_noise, words = with_simulator_error(SENSORS, engine)
    campaign = build_campaign(plan, stated_noise, readings, title, REFERENCE.format(engine=engine, error=words))
    return campaign, describe_truth(seed, base, what, SENSORS, errors, None, streams[2], name)


def scene_effects(load: EffectLoader, faults: Sequence[Fault]) -> tuple[Any, ...]:
    """The effects that change the scene as faults say."""
    entries = []
    for fault in faults:
        numbers = dict(vars(fault))
        if fault.id == "wobble":  # one size here; there a cosine and a sine, by where the pulley turns forwards
            size, phase = numbers["beta_1"], numbers["phase"]
            numbers = {"beta_cos": size * math.cos(phase), "beta_sin": -size * math.sin(phase)}
        entries += [{"id": fault.id, **numbers}] if fault.id != WEIGHT else []
    return tuple(load(entries))


def true_cases(plan: Plan, base: str, errors: TrueErrors, faults: Sequence[Fault] = ()) -> list[Case]:
    """The runs of a plan as they really are; a belt of base beam_th2 weighs what a fault says, nothing without one."""
    weight = float(base == "strip") + sum(vars(f)["strength"] for f in faults if f.id == WEIGHT)
    rig, belt = true_machine(plan, errors, weight * GRAVITY)
    runs = len(plan.runs)
    relative, turned = np.broadcast_to(errors.tension_rel, runs), np.broadcast_to(errors.yaw, runs)
    return [
        Case(
            rig=rig,
            belt=belt,
            settings=Settings(
                tension=run.tension * (1 + float(relative[k])),
                yaw=Schedule.step(run.yaw + float(turned[k]), run.yaw_at),
                yaw_head=Schedule.step(run.yaw_head, run.yaw_at),
                speed=run.speed,
                direction=run.direction,
            ),
        )
        for k, run in enumerate(plan.runs)
    ]


def measure(
    cases: Sequence[Case], run: Callable[[Case], Curves], workers: int | None = None,
    tell: Callable[[], Any] = lambda: None,
) -> list[Curves]:  # fmt: skip
    """The curves of cases in order, each told as it comes; a process a core unless ``workers`` says otherwise.

    Raises SimulationError when a run diverges; runs that have not begun are then left out.
    """
    workers, found = min(workers or cores(), len(cases)), []
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, spawn) as pool:
        for curves in pool.map(run, cases) if workers > 1 else map(run, cases):
            found.append(curves)
            tell()
    return found


def scene_parts(case: Case, effects: Sequence[Any], options: Options) -> SceneParts:
    """The scene as the effects leave it."""
    parts = SceneParts.from_case(case, options.friction)
    for effect in effects:
        parts = effect.scene(parts, case)
    return parts


def run_scene(case: Case, effects: Sequence[Any], options: Options, travel: float, engine: str = "native") -> Curves:
    """One run in the scene as the effects leave it, at the speed that the setting states (no inertia)."""
    own: dict[str, Any] = {"belt": "flex", "travel": travel + 2 * options.sample, "options": options}
    own["parts"] = scene_parts(case, effects, options)
    if engine == "quasi_static":
        from belt_sim.space.quasi_static import simulate as equilibria

        return equilibria(case, **own)
    from belt_sim.space.native import run_native

    return run_native(case, **own | {"options": replace(options, belt_speed=float(case.settings.speed))})


def take_readings(plan: Plan, curves: Sequence[Curves]) -> np.ndarray:
    """Readings without noise [m or rad], shape (signals, n, runs), lateral ones from where the yaw is applied."""
    readings = np.empty((len(plan.signals), len(plan.travel), len(curves)))
    for j, place in enumerate(plan.signals.values()):
        for k, (curve, run) in enumerate(zip(curves, plan.runs, strict=True)):
            rows = curve.y[_POINTS[place]] if place in _POINTS else np.asarray(curve.tilt)[_TILTS[place]]
            readings[j, :, k] = np.interp(plan.travel, curve.travel, rows)
            if place in _POINTS:
                readings[j, :, k] -= np.interp(run.yaw_at, curve.travel, rows)
    return readings
