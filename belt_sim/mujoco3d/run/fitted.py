"""Options as a case needs them: the belt speed chosen or checked, the step of belts made of springs bounded."""

from dataclasses import replace

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.mujoco3d.machine.pace import accurate, string_speed
from belt_sim.mujoco3d.options import AS_THE_CASE, Options, is_limp

_SHAKEN = 20.0  # string speed over belt speed; y after 1 m is still that at a 35th within 3 % (7 N/mm2, a = 2 m)
_COURANT = 0.5
_CONTACT_SPEED = 0.5  # [m/s]: slower than a held belt, because its landings are impacts
_LIMP_DRAG = 2.0  # times string speed / span length: a third of critical for the lowest sway of a limp span


def fitted(options: Options, case: Case, belt: str) -> Options:
    """Options for this case, with a belt speed in m/s.

    Springs (tendons) lend MuJoCo's metric no stiffness across their direction, so that their step stays below
    dx / string speed; limp spans get a drag that calms them between landings.
    Raises InputError when a link on a pulley would turn further in a step than its strain can bear.
    """
    waves, pace = string_speed(case), _pace(options, case)
    dt = options.dt if belt == "flex" else min(options.dt, _COURANT * options.dx / waves)
    radius = min(float(case.rig.head_radius), float(case.rig.tail_radius))
    longest = radius / pace * (2.0 * float(case.settings.tension) / float(case.belt.youngs_modulus)) ** 0.5
    if belt != "rope" and dt > longest:
        raise InputError("options.dt", dt, "s", f"give at most {longest:.1e} at {pace:.2f} m/s, or a slower belt_speed")
    damping = options.damping
    if is_limp(belt, options):
        damping = max(damping, _LIMP_DRAG * waves / float(case.rig.span_length))
    return replace(options, belt_speed=pace, dt=dt, damping=damping)


def for_contact(options: Options) -> Options:
    """Options of a belt that contacts carry: without a speed of its own it runs at _CONTACT_SPEED."""
    return options if options.belt_speed is not None else replace(options, belt_speed=_CONTACT_SPEED)


def _pace(options: Options, case: Case) -> float:
    """Belt speed [m/s]; raises InputError for one at which landings shake the belt too much."""
    waves = string_speed(case)
    if options.belt_speed is None:
        return accurate(waves)
    as_the_case = options.belt_speed == AS_THE_CASE
    name = "settings.speed" if as_the_case else "options.belt_speed"
    pace = float(case.settings.speed if as_the_case else options.belt_speed)
    if not 0.0 < pace <= waves / _SHAKEN:
        raise InputError(
            name, f"{pace:.3g}", "m/s",
            f"give at most {waves / _SHAKEN:.2f}, above which landings shake a belt of this tension, or leave "
            f"options.belt_speed out for {accurate(waves):.2f} m/s",
        )  # fmt: skip
    return pace
