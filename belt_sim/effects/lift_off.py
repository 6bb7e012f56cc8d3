"""Lift-off: a belt that resists bending leaves its pulley along a layer, fibre by fibre at different heights."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import CHECK_MODEL, Cause, Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class LiftOff(Effect):
    """Steel of thickness h straightens over l = sqrt(D/(sigma h)) beside the tangent point, D its plate stiffness.

    A fibre under more tension has a shorter layer and lies lower there, by l^2/2R of a height of its own. A belt with
    an in-plane moment M so tilts where it leaves the pulley, phi = s (l^2/2R) M/T, and by reciprocity leaves it at
    y' = theta -+ (l^3/8R^2) M/T + s (l^2/2R) phi' (- at the run-up, + at the run-off; s = +1 upper, -1 lower span).
    ``strength`` multiplies l^2 and l^3; 1 is a steel belt, nothing is fitted. What cambers, welds and guides add
    between the ends is not felt by the layer.
    """

    id = "lift_off"
    law = "run-up"
    reference = "plate under tension on a cylinder, any textbook; checked against shell elements on cylinders"
    parity = "odd"
    cause = Cause("the belt leaves its pulleys along a layer", ("tail", "head"), CHECK_MODEL, of_model=True)
    parameters = {
        "strength": Parameter(unit="1", meaning="share of the bending layer that acts", plausible=(0.5, 1.5), scale=1.0)
    }
    strength: float = 1.0

    def hold(self, answer, span, case):
        layer = jnp.sqrt(case.belt.plate_stiffness / (case.settings.tension * case.belt.thickness))
        tail, head = case.rig.tail_radius, case.rig.head_radius
        runup, runoff = jnp.stack([tail, head]), jnp.stack([head, tail])
        side = case.settings.direction * jnp.array([1.0, -1.0])
        lift = [self.strength * side * layer**2 / (2.0 * r) for r in (runup, runoff)]
        lean = [self.strength * layer**3 / (8.0 * r**2) for r in (runup, runoff)]
        moment = span.bending / span.torsion  # M/T per unit of curvature
        # outputs kappa and phi' at run-up and run-off -> what they add to the boundary values
        back = jnp.zeros((2, 5, 4))
        back = back.at[:, 2, 0].set(-lean[0] * moment).at[:, 2, 2].set(lift[0])  # theta at the run-up
        back = back.at[:, 1, 1].set(lean[1] * moment).at[:, 1, 3].set(lift[1])  # theta at the run-off
        back = back.at[:, 4, 0].set(lift[0] * moment).at[:, 3, 1].set(lift[1] * moment)  # phi at either
        out = jnp.stack([answer.runup, answer.runoff, answer.twist_runup, answer.twist_runoff], axis=1)
        loop = out @ back
        more = jnp.linalg.solve(jnp.eye(4) - loop, loop @ out)
        added = back @ (out + more)  # to the boundary values, per unit of what the pulleys give
        return replace(
            answer,
            runup=answer.runup + more[:, 0],
            runoff=answer.runoff + more[:, 1],
            twist_runup=answer.twist_runup + more[:, 2],
            twist_runoff=answer.twist_runoff + more[:, 3],
            mid_tilt=answer.mid_tilt + jnp.einsum("sd,sde->se", answer.mid_tilt, added),
        )

    def scene(self, parts, case):
        return replace(parts, lift_off=parts.lift_off + self.strength)
