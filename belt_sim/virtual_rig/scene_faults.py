"""Hidden effects as changes of a three-dimensional scene: what the machine is, not what a law says of it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.case import Case
from belt_sim.errors import InputError
from belt_sim.rig import GRAVITY
from belt_sim.scene_parts import SceneParts
from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.library import fault_of


@dataclass(frozen=True)
class SceneFault:
    """A fault of the catalogue that has a geometry, a friction or a gravity in the scene."""

    fault: Fault

    @property
    def id(self) -> str:
        return self.fault.id

    def scene(self, parts: SceneParts, case: Case) -> SceneParts:
        """The scene with this fault."""
        return SCENE_FAULTS[self.id](self.fault, parts, case)


def scene_fault(spec: str | dict) -> SceneFault:
    """A fault from an id or a dictionary, as for the line; raises InputError for one without a scene."""
    if not isinstance(spec, str | dict):
        raise InputError("hidden", spec, "", "give ids, or dictionaries with an id")
    if isinstance(spec, dict) and "d" in spec:
        raise InputError("hidden d", spec["d"], "", "give the effect's own parameters with engine=mujoco")
    fault = fault_of(spec)
    if fault.id not in SCENE_FAULTS:
        raise InputError("hidden", fault.id, "", f"has no scene; use one of {', '.join(SCENE_FAULTS)}, or engine=line")
    return SceneFault(fault)


def _weight(fault, parts: SceneParts, case: Case) -> SceneParts:
    """A belt without weight, as base beam_th2 has it, gets its weight."""
    return replace(parts, gravity=parts.gravity + fault.strength * GRAVITY)


def _tail_turned(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_pulley("tail", yaw_offset=fault.beta_0)


def _head_turned(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_pulley("head", yaw_offset=fault.beta_0)


def _taper(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_pulley("tail", taper=fault.kappa_t)


def _crown(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_pulley("tail", crown=fault.c)


def _cant(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_pulley("tail", cant=fault.gamma)


def _wobble(fault, parts: SceneParts, case: Case) -> SceneParts:
    """The scene counts the pulley's turn from head to tail on top, the fault along the travel."""
    return parts.with_pulley("tail", wobble=fault.beta_1, wobble_phase=fault.phase * float(case.settings.direction))


def _compliance(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_pulley("tail", yaw_compliance=fault.c_m)


def _slip(fault, parts: SceneParts, case: Case) -> SceneParts:
    if not fault.inverse_friction > 0.0:
        return parts
    return replace(parts, friction=min(parts.friction, 1.0 / fault.inverse_friction))


def _camber(fault, parts: SceneParts, case: Case) -> SceneParts:
    return parts.with_camber(lambda s: np.full(np.shape(s), fault.kappa_c))


def _weld(fault, parts: SceneParts, case: Case) -> SceneParts:
    """Curved by nature over the weld's length, which begins in the middle of the span that runs to the tail pulley."""
    rig, length = case.rig, float(fault.LENGTH)
    lower = 0.0 if float(case.settings.direction) > 0 else float(rig.span_length + rig.wrap_tail)
    around, middle = float(rig.belt_length), lower + 0.5 * float(rig.span_length)

    def camber(s):
        off = (s - middle + 0.5 * around) % around - 0.5 * around
        return np.where(np.abs(off) < 0.5 * length, fault.angle / length * (1 + np.cos(2 * np.pi * off / length)), 0.0)

    return parts.with_camber(camber)


#: All of them begin at travel 0; until then the belt lies straight on an aligned machine.
SCENE_FAULTS: dict[str, Callable] = {
    "yaw_offset_tail": _tail_turned,
    "yaw_offset_head": _head_turned,
    "cant": _cant,
    "taper": _taper,
    "crown": _crown,
    "wobble": _wobble,
    "yaw_compliance": _compliance,
    "slip": _slip,
    "sag_roll": _weight,
    "camber": _camber,
    "weld": _weld,
}
