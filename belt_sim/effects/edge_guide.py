"""Edge guides: rollers beside the spans that push the belt's edge back."""

from dataclasses import replace

import jax.numpy as jnp

from belt_sim.effects.base import METRES, Cause, Effect, effect, parameter
from belt_sim.laws.influence import span_fields, supports

_NEAREST = 0.25  # [m] to a pulley: nearer, a step of the march no longer follows the span's stiffness


@effect
class EdgeGuide(Effect):
    """Two rollers, one at each edge, ``gap`` away from the belt in the middle: P = k max(0, |y| - gap), inwards.

    The belt beside the roller is where its ends and P put it, y = y_ends - P give, so that P = k (|y_ends| - gap) /
    (1 + k give). P bends the span's run-up back until the belt no longer runs sideways: y saturates. ``at`` counts
    from the tail pulley's axis; a sticking belt does not move on the pulleys themselves.
    """

    id = "edge_guide"
    law = "span"
    reference = "physics sheet, section 7; clamped beam with an elastic stop, any textbook"
    parity = "odd"
    cause = Cause(
        "a guide roller pushes the belt back at its edge",
        ("upper", "lower"),
        "Look for contact and wear at the guide rollers, and swing them away for one run.",
    )
    stiffness: float = parameter("N/m", "rollers of the upper span", plausible=(10.0, 1e8), scale=1e5)
    stiffness_lower: float = parameter("N/m", "rollers of the lower span", plausible=(10.0, 1e8), scale=1e5)
    gap: float = parameter(
        "m",
        "play between edge and roller",
        plausible=(0.0, 0.02),
        scale=1e-3,
        modifier=True,
        # so close that a search does not end where only the next reading touches
        grid=(0.0, 1.5e-4, 3e-4, 4.5e-4, 6.5e-4, 1e-3, 1.5e-3, 2.2e-3, 4e-3, 8e-3),
    )
    at: float = parameter(
        "m",
        "distance from the tail pulley's axis",
        plausible=(0.25, 50.0),
        scale=1.0,
        modifier=True,
        grid=(0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
        shop=METRES,
    )

    def influence(self, span, case):
        fields = span_fields(span)
        share = self._from_tail(span.length) / span.length
        near_runoff, near_runup = supports(span, share, fields)
        return near_runup, near_runoff

    def _from_tail(self, length):
        return jnp.clip(self.at, _NEAREST, length - _NEAREST)

    def bend(self, bend, boundary, known, case):
        place = boundary.start + jnp.stack([k.place @ boundary.ends[:, i] for i, k in enumerate(known)])
        give, runup, runoff, tilt = (
            jnp.stack([getattr(k, name) for k in known]) for name in ("give", "runup", "runoff", "tilt")
        )
        upper_first = boundary.direction > 0  # the first span is the one that runs up the tail pulley
        stiff = jnp.stack(
            [
                jnp.where(upper_first, self.stiffness, self.stiffness_lower),
                jnp.where(upper_first, self.stiffness_lower, self.stiffness),
            ]
        )
        push = -stiff * (place - jnp.clip(place, -self.gap, self.gap)) / (1.0 + stiff * give)
        return replace(
            bend, runup=bend.runup + push * runup, runoff=bend.runoff + push * runoff, tilt=bend.tilt + push * tilt
        )

    def scene(self, parts, case):
        x = float(case.rig.centre_distance) - float(self._from_tail(case.rig.span_length))
        for span, stiffness in (("upper", self.stiffness), ("lower", self.stiffness_lower)):
            if stiffness > 0.0:
                for side in (1.0, -1.0):
                    parts = parts.with_guide(span=span, x=x, gap=self.gap, side=side, stiffness=stiffness)
        return parts
