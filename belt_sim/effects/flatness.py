"""Flatness: residual stress of the rolled strip, with edges or a middle that go slack at low tension."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class Flatness(Effect):
    """The strip has the residual stress s(y) = amplitude (1 - 12 y^2/b^2), which fades from tension to pressure.

    amplitude > 0 [Pa]: long edges; amplitude < 0: a long middle. Fibres of the strip that would be pressed buckle and
    carry nothing. With u = 2 |y| / b and c the place where the stress is zero, at tension sigma:

        long edges, sigma >= 2 amplitude:  EI as it is,  T_sigma = b^3 h (sigma - 0.8 amplitude) / 12
        below:  c^3 = sigma / (2 amplitude),  EI c^3,  T_sigma = b^3 h amplitude c^5 / 10
        long middle of r = -amplitude, sigma >= r:  EI as it is,  T_sigma = b^3 h (sigma + 0.8 r) / 12
        below:  3 c^2 - 2 c^3 = 1 - sigma / r,  EI (1 - c^3),  T_sigma = 3/4 b^3 h r ((1 - c^5)/5 - c^2 (1 - c^3)/3)

    T_sigma = integral of s y^2 over the section is the share of the torsional stiffness that comes from tension.
    """

    id = "flatness"
    law = "span"
    reference = "residual stress of rolled strip: Fischer et al. 2000 (Int. J. Mech. Sci. 42); sections integrated here"
    parity = "odd"
    parameters = {
        "amplitude": Parameter(
            unit="Pa", meaning="residual stress in the middle of the width", plausible=(-4e7, 4e7), scale=5e6
        )
    }
    amplitude: float = 0.0

    def span(self, span, case):
        belt, tension = case.belt, case.settings.tension
        section = belt.width**3 * belt.thickness
        change, bending = _section(self.amplitude, tension)
        return replace(span, bending=span.bending * bending, torsion=span.torsion + section * change)


def _section(amplitude, tension):
    """Change of T_sigma / (b^3 h) [Pa] and the share of EI that is left [1]."""
    pressed = amplitude >= 0.0
    size = jnp.abs(amplitude)
    largest = jnp.where(pressed, 2.0 * size, size)  # [Pa], pressure where it is greatest
    slack = tension < largest
    share = jnp.where(slack, tension / jnp.where(slack, largest, 1.0), 1.0)  # of that pressure, 0..1
    edge = jnp.cbrt(share)
    middle = 0.5 - jnp.sin(jnp.arcsin(jnp.clip(2.0 * share - 1.0, -1.0, 1.0)) / 3.0)
    edges_torsion = size * edge**5 / 10.0
    middle_torsion = 0.75 * size * ((1.0 - middle**5) / 5.0 - middle**2 * (1.0 - middle**3) / 3.0)
    buckled = jnp.where(pressed, edges_torsion, middle_torsion) - tension / 12.0
    left = jnp.where(pressed, edge**3, 1.0 - middle**3)
    return jnp.where(slack, buckled, -0.8 * amplitude / 12.0), jnp.where(slack, left, 1.0)
