"""Channels: the elementary places of the march at which physics can be missing, each taking an input u(travel)."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect

#: channel -> unit of its input; tail and head pulley each
UNITS = {
    "yaw_tail": "rad",
    "yaw_head": "rad",
    "turn_tail": "1/m",
    "turn_head": "1/m",
    "drift_tail": "rad",
    "drift_head": "rad",
    "shift_tail": "m",
    "shift_head": "m",
    "twist_tail": "rad",
    "twist_head": "rad",
}
CHANNELS = tuple(UNITS)


def drift_at(pulley: int) -> str:
    """The channel of sideways drift where the belt runs up a pulley (0: tail, 1: head)."""
    return ("drift_tail", "drift_head")[pulley]


def _declared() -> dict[str, Parameter]:
    sizes = {"rad": 1e-4, "1/m": 1e-5, "m": 1e-4}
    size = {
        name: Parameter(unit=f"{unit}", meaning="height of the pulse", plausible=(-1.0, 1.0), scale=sizes[unit])
        for name, unit in UNITS.items()
    }
    place = {
        name: Parameter(unit="m", meaning=meaning, plausible=(0.0, 1e3), scale=1.0, null=1.0, modifier=True)
        for name, meaning in (("middle", "travel at its height"), ("half", "travel from its height to its foot"))
    }
    return size | place


@effect
@dataclass(frozen=True, kw_only=True)
class Pulse(Effect):
    """A triangular pulse of input at every channel: yaw of a pulley's surface, turn and drift at the run-ups, shift and
    twist over the wrapped arcs."""

    id = "pulse"
    law = "run-up"
    reference = "none: an input to take impulse responses with"
    parameters = _declared()
    yaw_tail: float = 0.0
    yaw_head: float = 0.0
    turn_tail: float = 0.0
    turn_head: float = 0.0
    drift_tail: float = 0.0
    drift_head: float = 0.0
    shift_tail: float = 0.0
    shift_head: float = 0.0
    twist_tail: float = 0.0
    twist_head: float = 0.0
    middle: float = 1.0
    half: float = 1.0

    def _at(self, state, name):
        height = jnp.stack([getattr(self, f"{name}_tail"), getattr(self, f"{name}_head")])
        return height * jnp.maximum(0.0, 1.0 - jnp.abs(state.travel - self.middle) / self.half)

    def yaw(self, yaw, state, case):
        tail, head = self._at(state, "yaw")
        return replace(yaw, tail=yaw.tail + tail, head=yaw.head + head)

    def runup(self, runup, state, case):
        return replace(runup, turn=runup.turn + self._at(state, "turn"), drift=runup.drift + self._at(state, "drift"))

    def wrap(self, runoff, state, case):
        return replace(runoff, y=runoff.y + self._at(state, "shift"), alpha=runoff.alpha + self._at(state, "twist"))
