"""The contact angle on the tail pulley takes a random walk of its own in every run."""

from dataclasses import dataclass

from belt_sim.virtual_rig.fault import TAIL, Size
from belt_sim.virtual_rig.strangers._courses import chance
from belt_sim.virtual_rig.strangers._stranger import Stranger


@dataclass(frozen=True, kw_only=True)
class WalkingAngle(Stranger):
    id = "walking_angle"
    sizes = {"size": Size(unit="rad/m^0.5", typical=5e-6, limit=1e-3)}
    positive = True
    place, variable, form = "runup_tail", "travel", "random"
    size: float = 0.0
    seed: int = 0

    def turn(self, s, line, y, kappa):
        return self.size * chance(self.seed, line.run, s) * TAIL

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"seed": int(rng.integers(2**31))}
