"""Both shells bend under the belt's pull, thin in the middle: a taper + compliance F y, which drives outwards."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import Fault, Size
from belt_sim.virtual_rig.faults._pulleys import with_more


@dataclass(frozen=True, kw_only=True)
class PulleyDeflection(Fault):
    id = "pulley_deflection"
    sizes = {"compliance": Size(unit="1/(N m2)", typical=5e-6, limit=3e-4)}
    positive = True
    lot = 19
    compliance: float = 0.0

    def turn(self, s, line, y, kappa):
        return self.compliance * line.force * y

    def scene(self, parts, case):
        crown = -self.compliance * float(case.settings.tension * case.belt.area)
        return with_more(with_more(parts, "head", crown=crown), "tail", crown=crown)
