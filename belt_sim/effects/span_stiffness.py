"""Properties of the spans: sag-roll coupling, shear, flatness of the strip."""

from dataclasses import replace

import jax.numpy as jnp

from belt_sim.effects.base import CHECK_MODEL, Cause, Effect, effect, parameter


@effect
class SagRoll(Effect):
    """Adds kappa = y'' + phi Z to a beam of second order; strength multiplies Z = q/F (1 = the full strip law)."""

    title = "Sag-roll coupling: a hanging belt relieves its in-plane bending by tilting"
    law = "span"
    reference = "docs/theory.md (strip); edge ropes of Ritzinger 1997 and Ernst 1965 describe the same sag"
    parity = "odd"
    cause = Cause("a slack belt hangs, and tilts instead of bending", ("upper", "lower"), CHECK_MODEL, of_model=True)
    strength: float = parameter("1", "strength of the effect (theory: 1)", plausible=(0.5, 1.5), scale=1.0, default=1.0)

    def span(self, span, case):
        return replace(span, sag_curvature=span.sag_curvature + self.strength * case.sag_curvature)


@effect
class Shear(Effect):
    """A side force Q shears the belt by n Q/(G b h), and it lands along its sheared middle line.

    Timoshenko's beam, y' = theta - n EI kappa'/(G b h): bends decay with K^2 = (F/EI)/(1 + n F/(G b h)), and the moment
    4 EI/L per radian of a clamped end becomes (4 + P)/(1 + P) EI/L, P = 12 n EI/(G b h L^2). Where the belt runs up,
    dy/ds = -alpha + n M'/(G b h), M' [N] the slope of its moment there, loads on the span included; alpha stays the
    angle of the cross-sections, also on the pulley. Under an even side load the belt moves at first as if it had run
    6 n EI/(G b h L) further, and later at a higher rate. n = (12 + 11 nu)/(10 + 10 nu) for a rectangle; the membrane of
    the 3D belt has n = 1.
    """

    title = "Shear flexibility of short, wide spans"
    law = "span"
    reference = "paper eq. 8; Cowper 1966 for n; landing: shell elements that roll onto a pulley"
    parity = "odd"
    cause = Cause("a short, wide span gives way in shear", ("upper", "lower"), CHECK_MODEL, of_model=True)
    coefficient: float = parameter(
        "1", "shear coefficient n of the cross-section", plausible=(1.0, 1.3), scale=1.177, default=1.177
    )

    def span(self, span, case):
        return replace(span, shear=span.shear + self._angle_per_force(case))

    def runup(self, runup, state, case):
        return replace(runup, drift=runup.drift + self._angle_per_force(case) * state.side_force)

    def _angle_per_force(self, case):
        return self.coefficient / (case.belt.shear_modulus * case.belt.area)


@effect
class Flatness(Effect):
    """The strip has the residual stress amplitude (1 - 12 y^2/b^2) across its width: a parabola without resultant.

    amplitude > 0: long edges, which are pressed; amplitude < 0: a long middle. The stress at rest works on the twist
    like tension does, T = b^3 h (sigma - 0.8 amplitude)/12 + G b h^3/3 (the integral of s y^2 over the section).
    Narrow edges under pressure do not buckle, so EI stays as it is (studies/notes/shell.md compares both with a shell).
    From amplitude = 1.25 sigma on the spans twist by themselves and no linear law holds: the share of the tension in T
    is then taken as 0.
    """

    title = "Flatness: residual stress of the rolled strip changes how easily a span twists"
    law = "span"
    reference = "residual stress of rolled strip: Fischer et al. 2000 (Int. J. Mech. Sci. 42); T by virtual work"
    parity = "odd"
    needs = frozenset({"sag"})
    cause = Cause(
        "the strip is not flat (long edges or a long middle)",
        ("upper", "lower"),
        "Slacken the belt and look for wavy edges or a loose middle.",
    )
    amplitude: float = parameter("Pa", "residual stress in the middle of the width", plausible=(-2e7, 2e7), scale=3e6)

    def span(self, span, case):
        belt = case.belt
        change = -jnp.minimum(0.8 * self.amplitude, case.settings.tension)
        return replace(span, torsion=span.torsion + belt.width**3 * belt.thickness / 12.0 * change)

    def scene(self, parts, case):
        return replace(parts, residual=parts.residual + self.amplitude)
