"""How a run in three dimensions is discretised and driven, and the constants that its engines share."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from belt_sim.case import Case
from belt_sim.errors import CannotRepresent, InputError
from belt_sim.scene_parts import SceneParts
from belt_sim.units import two_digits

#: chords before the tangent point at which a station is caught; it is let go HYSTERESIS chords further out
CATCH_DISTANCE = 0.5
HYSTERESIS = 0.02
#: chords of travel over which a station forgets how far off its path it was caught
FORGETTING = 0.5
#: free stations over which the direction of a span is taken, and the time [s] over which it is averaged: waves pass
DIRECTION_STATIONS = 4
SPAN_TIME = 0.02
#: links beside a pulley over which moment, stress and direction are averaged; the last link, which turns, is left out
RUNUP_LINKS = 2
#: stations to either side of a wrap's end among which the belt passes the pulley's axis
AXIS_STATIONS = 4
#: of the bending layer: time [s] over which it is averaged, and the share of the mean stress that a fibre has at least
LAYER_TIME = 0.05
SLACKEST_FIBRE = 0.1
#: [s], of a pulley that gives way to the belt's moment
COMPLIANCE_TIME = 0.02
#: of a limp belt: stations over which its inclination is taken, and the largest distance [chords] of its kinks
KINK_STATIONS = 8
FURTHEST_KINK = 0.6
#: damping ratio of the tail pulley against the stretch of both spans; it acts on deviations from steady motion
TAIL_DAMPING_RATIO = 1.0
#: [1/s], drag of a belt at rest, about critical for the lowest sway of a span
REST_DRAG = 15.0
#: of a residual stress r (1 - 12 y^2/b^2), what it takes off the tension in the torsional stiffness, over r
RESIDUAL_TORSION = 0.8
#: [N/m], of the springs that hold a landed node; [kg], inertia of the tail pulley on its slide and about its axis
HOLD_STIFFNESS = 1e13
TAIL_MASS = 60.0
#: belt widths: a belt that has run further sideways has left its pulleys
RUNAWAY = 3.0

#: The three belts: a limp chain, particles tied by bonds, a two-dimensional membrane.
BELTS = ("rope", "grid", "flex")
BONDS = ("longitudinal", "transverse", "diagonal")
#: A force on the sliding tail pulley, or the belt's length at fixed pulleys.
TENSIONINGS = ("force", "length")
#: What carries the belt on the pulleys: springs that hold landed nodes, or MuJoCo's contacts.
CONTACTS = ("held", "mujoco")
#: chords of travel in a step: no more than one station lands in it at either end
MOST_CHORDS = 0.7
#: belt_speed of a run at its case's own speed
AS_THE_CASE = "case"


_MAY_BE_ZERO = ("friction", "run_in", "settle", "damping")
_UNITS = {
    **dict.fromkeys(("dx", "run_in", "sample", "frame"), "m"),
    **dict.fromkeys(("dt", "settle", "yaw_time"), "s"),
    **{"belt_speed": "m/s", "acceleration": "m/s2", "damping": "1/s", "across": "nodes"},
}
_SHARED = {"dx", "belt_speed", "friction", "run_in", "sample"}
_IN_TIME = {"dt", "acceleration", "settle", "yaw_time", "damping", "frame"}
#: the options that an engine obeys (native, and those in JAX, each a module with a BatchEngine of its name), those of a
#: run that MuJoCo's contacts carry, and those of such a scene as a file; a change of any other is refused
OBEYED: dict[str, set[str]] = {
    "native": _SHARED | _IN_TIME | {"tensioning"},
    "mjx": _SHARED | _IN_TIME | {"tensioning"},
    "quasi_static": _SHARED | {"tensioning", "steps"},
    "mujoco": _SHARED | {"dt", "yaw_time", "damping", "frame"},
    "scene": {"dx", "belt_speed", "friction", "dt", "damping"},
}
ENGINES = tuple(name for name in OBEYED if name not in ("mujoco", "scene"))
#: engines that show their instants as they go
WATCHED = tuple(name for name in ENGINES if "frame" in OBEYED[name])
#: the options of the belt itself, which every engine obeys
OF_BELT: dict[str, set[str]] = {"rope": set(), "grid": {"across", "bonds"}, "flex": {"across"}}


@dataclass(frozen=True, kw_only=True)
class Options:
    """Numerical settings of a run; the defaults are those of the error budget in studies/notes/three_dimensions.md.

    dx [m]: distance of stations along the belt; across: nodes over the width (2 carry the exact EI and tension
    torsion); dt [s], None = 1 ms, shorter where that would break off, with engine=mjx longer for a slow belt;
    belt_speed [m/s] of the run, None = ``accurate_speed``, "case" = that of the case; friction [1]: Coulomb coefficient
    between belt and pulleys, inf = sticking; bonds: which bonds tie the grid; tensioning: how the belt gets its
    tension, see TENSIONINGS; run_in [m]: travel before 0, straight; acceleration [m/s2]; settle [s]: time at rest for
    the sag, and half of it after a yaw step; yaw_time [s]: duration of a yaw step; damping [1/s]: drag of the free
    belt, across its travel, per unit of its mass (limp belts get more); sample [m]: travel between points of the
    curves; frame [m]: travel between frames; steps: of engine=quasi_static, to a point of the curves.
    """

    dx: float = 0.025
    across: int = 2
    dt: float | None = None
    belt_speed: float | str | None = None
    friction: float = math.inf
    bonds: tuple[str, ...] = BONDS
    tensioning: str = "force"
    run_in: float = 1.5
    acceleration: float = 1.0
    settle: float = 1.0
    yaw_time: float = 0.3
    damping: float = 1.0
    sample: float = 0.025
    frame: float = 0.025
    steps: int = 2

    def __post_init__(self) -> None:
        for field in fields(self):
            name, value = field.name, getattr(self, field.name)
            if value is None and field.default is None:
                continue
            number, zero = isinstance(value, int | float) and not isinstance(value, bool), name in _MAY_BE_ZERO
            right = number and (value > 0.0 or (zero and value == 0.0))
            remedy = "give 0 or a positive number" if zero else "give a positive number"
            if name in ("across", "steps"):
                right, remedy = number and value >= 1 and value % 1 == 0, "give a whole number, 1 or more"
            elif name == "belt_speed":
                right, remedy = right or value == AS_THE_CASE, f"give m/s, {AS_THE_CASE}, or leave it out"
            elif name == "tensioning":
                right, remedy = value in TENSIONINGS, f"choose one of {', '.join(TENSIONINGS)}"
            elif name == "bonds":
                right = isinstance(value, tuple) and "longitudinal" in value and set(value) <= set(BONDS)
                remedy = f"give a list: longitudinal, and any of {', '.join(BONDS[1:])}"
            if not right:
                raise InputError(f"model.{name}", value, _UNITS.get(name, ""), remedy)

    @staticmethod
    def from_settings(settings: Mapping[str, Any]) -> "Options":
        """From the numbers of a configuration; None keeps the recommended value. Raises InputError for a wrong one."""
        known, given = {f.name: f.default for f in fields(Options)}, dict[str, Any]()
        for key, value in settings.items():
            if key not in known:
                raise InputError(f"model.{key}", value, "", f"use one of {', '.join(known)}, contact, scene")
            if isinstance(value, list | tuple):
                given[key] = tuple(map(str, value))
            elif isinstance(value, int | float) and not isinstance(value, bool):
                given[key] = int(value) if isinstance(known[key], int) and value % 1 == 0 else float(value)
            elif value is not None:
                given[key] = value
        return Options(**given)

    @property
    def step(self) -> float:
        """A step in time [s], of options that were fitted to a case."""
        assert self.dt is not None
        return self.dt

    @property
    def run_speed(self) -> float:
        """Belt speed [m/s], of options that were fitted to a case."""
        assert isinstance(self.belt_speed, float)
        return self.belt_speed


def refuse_unobeyed(options: Options, belt: str, engine: str, contact: str = CONTACTS[0]) -> None:
    """Raise InputError for an option that differs from its default and that would change nothing here."""
    by, how = (engine, f"engine={engine}") if contact == CONTACTS[0] else (contact, f"model.contact={contact}")
    for field in fields(Options):
        value = getattr(options, field.name)
        if value == field.default or field.name in OBEYED[by] | OF_BELT[belt]:
            continue
        if field.name in OF_BELT["grid"]:
            how, others = f"mujoco_{belt}", [f"model=mujoco_{b}" for b, own in OF_BELT.items() if field.name in own]
        elif by == "scene":
            how, others = "a scene", ["belt-sim simulate"]
        else:
            others = [f"engine={e}" for e in ENGINES if field.name in OBEYED[e]]
        remedy = f"{how} does not obey it: leave it out, or use {' or '.join(others)}"
        raise InputError(f"model.{field.name}", value, "", remedy)


def is_limp(belt: str, options: Options) -> bool:
    """Belts without in-plane bending stiffness in their spans."""
    return belt == "rope" or (belt == "grid" and "diagonal" not in options.bonds)


def refuse_sliding_limp(belt: str, options: Options, parts: SceneParts) -> None:
    """Raise CannotRepresent for a limp belt with finite friction: it sticks at the last station on a pulley."""
    if math.isfinite(parts.friction) and is_limp(belt, options):
        raise CannotRepresent(f"model.friction = {parts.friction:g}: a limp belt sticks here; leave it out")


#: String speed over belt speed. Landings shake the spans; at a 35th of it sag and tension stay within 1 %.
SLOWNESS = 35.0
_FASTEST = 2.0  # [m/s]


def string_speed(case: Case) -> float:
    """Speed of waves along a span, sqrt(sigma / rho) [m/s]."""
    return math.sqrt(float(case.settings.tension) / float(case.belt.density))


def accurate_speed(waves: float) -> float:
    """The fastest belt speed [m/s] at which inertia does not matter, for a string speed ``waves`` [m/s]."""
    return min(_FASTEST, waves / SLOWNESS)


_SHAKEN = 20.0  # string speed over belt speed; y after 1 m is still that at a 35th within 3 % (7 N/mm2, a = 2 m)
_COURANT = 0.5
_CONTACT_SPEED = 0.5  # [m/s]: slower than a held belt, because its landings are impacts
#: of a contact: stiffness times step^2 over a node's mass, and MuJoCo's largest impedance. Where one edge sinks in by
#: 1 um more than the other, the belt creeps round by 11 urad on each pulley
CONTACT_STIFFNESS, IMPEDANCE = 100.0, 0.9999
_DEEPEST = 1e-7  # [m] by which tension may press a node in: y is 1.3 % off at 0.06 um, 10 % at 0.4 um
#: [m/s], string speed^2 over belt speed: in a step a node goes straight on, (v dt)^2 / 2R off the pulley, and a slack
#: belt does not press it back
_ROLLED_OFF = 8000.0
_LIMP_DRAG = 2.0  # times string speed / span length: a third of critical for the lowest sway of a span
USUAL_STEP_TIME = 1e-3  # [s], unless told otherwise
#: [m] of travel that a step of engine=mjx takes at least. A slow belt's waves are as slow (``accurate_speed``), so that
#: they are resolved as a fast one's are: test rig, 7 N/mm2, 2.3 for 1 ms: y within 0.05 % of the largest, moments 0.7 %
_WAY_OF_STEP = USUAL_STEP_TIME * _FASTEST


def fit_options(options: Options, case: Case, belt: str, engine: str = "native") -> Options:
    """Options for this case, with a belt speed in m/s and a step in s; engine: one of OBEYED, "held" is "native".

    Springs (tendons) lend MuJoCo's metric no stiffness across their direction, so that their step stays below dx /
    string speed; limp or shaken spans get a drag that calms them. Raises InputError for a step in which a link on a
    pulley would turn further than its strain can bear (engine=mjx: several stations would land), for a belt speed at
    which landings shake the belt, and for a drag below what calms it.
    """
    waves = string_speed(case)
    fastest, pace = waves / _SHAKEN, accurate_speed(waves)
    if engine == CONTACTS[1]:
        pace = min(_CONTACT_SPEED, fastest, waves**2 / _ROLLED_OFF)
        landings = 2.0 * float(case.rig.span_length) * pace / (options.dx * waves)  # in a period of the lowest sway
        pace *= min((max(math.floor(landings - 0.5), 0.0) + 0.5) / landings, 1.0)  # halfway between two resonances
    if options.belt_speed is not None:
        as_the_case, accurate = options.belt_speed == AS_THE_CASE, pace
        pace = float(case.settings.speed if as_the_case else options.belt_speed)  # type: ignore[arg-type]
        if not 0.0 < pace <= fastest:
            most = f"give at most {fastest:.2f}, above which landings shake a belt of this tension"
            remedy = f"{most}; without a speed asked for it is {accurate:.2f} m/s"
            raise InputError("speed" if as_the_case else "model.belt_speed", f"{pace:.3g}", "m/s", remedy)
    dt = max(USUAL_STEP_TIME, _WAY_OF_STEP / pace) if engine == "mjx" else USUAL_STEP_TIME
    if belt != "rope" and "dt" in OBEYED.get(engine, OBEYED["native"]):
        radius = min(float(case.rig.head_radius), float(case.rig.tail_radius))
        way = radius * (2.0 * float(case.settings.tension) / float(case.belt.youngs_modulus)) ** 0.5
        longest = two_digits((MOST_CHORDS * options.dx if engine == "mjx" else way) / pace)
        remedy = f"give at most {longest:.2g} at {pace:.2f} m/s, or a slower belt_speed"
        deepest = _DEEPEST * CONTACT_STIFFNESS / (1.0 - IMPEDANCE)
        if engine == CONTACTS[1] and longest > (soft := math.sqrt(deepest * radius) / waves):
            longest = two_digits(soft)
            remedy = f"give at most {longest:.2g}: in a longer step nodes sink in by over {1e6 * _DEEPEST:g} um"
        if options.dt is not None and options.dt > longest:
            raise InputError("model.dt", options.dt, "s", remedy)
        dt = min(dt, longest)
    dt = dt if options.dt is None else options.dt
    dt = dt if belt == "flex" else min(dt, _COURANT * options.dx / waves)
    damping = options.damping
    if is_limp(belt, options) or engine == CONTACTS[1]:
        least = _LIMP_DRAG * waves / float(case.rig.span_length)
        if Options.damping != damping < least * (1.0 - 1e-9):
            remedy = f"give at least {0.01 * math.ceil(100.0 * least):g}, or leave it out: with less the spans ring"
            raise InputError("model.damping", damping, "1/s", remedy)
        damping = max(damping, least)
    return replace(options, belt_speed=pace, dt=dt, damping=damping)
