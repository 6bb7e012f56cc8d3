"""Pulley deflection: shells and axles that bend under the belt's pull."""

from dataclasses import dataclass, replace

from belt_sim.effects.base import Effect, Parameter, effect


@effect
@dataclass(frozen=True, kw_only=True)
class PulleyDeflection(Effect):
    """Both pulleys bend away from the pull in the middle, an anti-crown in proportion to it: kappa_t = compliance F y.

    Where a crown holds the belt in the middle (kappa_t = -c y), this drives it out, the more the tighter it is.
    """

    id = "pulley_deflection"
    law = "run-up"
    reference = "physics sheet, section 7 (crown); beam between two bearings under an even load"
    parity = "odd"
    parameters = {
        "compliance": Parameter(
            unit="1/(N m2)", meaning="anti-crown per unit of belt force", plausible=(0.0, 3e-4), scale=5e-6
        )
    }
    compliance: float = 0.0

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + self.compliance * case.tension_force * state.y)

    def scene(self, parts, case):
        hollow = self.compliance * float(case.tension_force)
        for pulley in ("tail", "head"):
            parts = parts.with_pulley(pulley, crown=getattr(parts, pulley).crown - hollow)
        return parts
