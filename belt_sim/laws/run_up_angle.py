"""Where a sagging span meets its pulley."""

from belt_sim.case import Case


def sag_angle(case: Case):
    """psi = q L/(2 F) [rad]: the span leaves a pulley this far from the top or the bottom (physics sheet, 6)."""
    return case.weight_per_length * case.rig.span_length / (2.0 * case.tension_force)
