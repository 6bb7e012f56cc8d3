"""Camber: a belt that is evenly curved in its own plane when nothing holds it."""

from dataclasses import dataclass, replace

import numpy as np

from belt_sim.effects.base import Cause, Effect, Parameter, effect
from belt_sim.laws.influence import natural_curvature_rows, span_fields


@effect
@dataclass(frozen=True, kw_only=True)
class Camber(Effect):
    """The bending moment is EI (kappa - kappa_c) all round the belt; kappa_c > 0: the edge at +y is the shorter one.

    It leaves a flat belt where it is. A hanging one it tilts, T phi'' = EI Z (kappa - kappa_c), and so the belt drifts
    as on two pulleys tapered by kappa_c (1 - integral of the curvature per unit of run-up angle), which is about
    kappa_c Lambda / (1 + Lambda), Lambda of ``belt_sim.laws.span.softening``.
    """

    id = "camber"
    law = "span"
    reference = "physics sheet, sections 3 and 7; Benson 2002 (JDSMC 124(1) 25)"
    parity = "even"
    on_belt = True
    cause = Cause(
        "the belt is curved in its own plane (camber)",
        ("upper", "lower"),
        "Stretch a string along one edge of a free length of belt and measure the bow.",
    )
    parameters = {
        "kappa_c": Parameter(
            unit="1/m",
            meaning="natural curvature",
            plausible=(-1e-3, 1e-3),
            scale=2e-5,
            shop=(12.5e3, "mm of bow over 10 m"),
        )
    }
    kappa_c: float = 0.0

    def influence(self, span, case):
        """Added at the run-up, the run-off [1/m] and to the tilt [rad], shape (3,), by a natural curvature of 1 1/m."""
        rows = natural_curvature_rows(span_fields(span), span)
        weights = np.ones(rows.shape[1])  # Simpson's rule
        weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
        return rows @ weights * (span.length / (rows.shape[1] - 1) / 3.0)

    def bend(self, bend, boundary, known, case):
        runup, runoff, tilt = self.kappa_c * known
        return replace(
            bend,
            runup=bend.runup + runup,
            runoff=bend.runoff + runoff,
            natural_runup=bend.natural_runup + self.kappa_c,
            natural_runoff=bend.natural_runoff + self.kappa_c,
            tilt=bend.tilt + tilt,
        )

    def scene(self, parts, case):
        return parts.with_camber(lambda s: np.full(np.shape(s), self.kappa_c)) if self.kappa_c else parts
