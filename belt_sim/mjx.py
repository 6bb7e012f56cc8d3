"""bs.mjx: belts on MuJoCo MJX for loops of one's own, many at once, on JAX; docs/python.md has an example.

``prepare`` cases of one mesh, ``command`` and ``step`` them under jax.jit, jax.vmap (``stack_cases``), jax.lax.scan and
jax.grad; ``simulate_batch`` runs whole cases; ``SteeringEnvironment`` has the form of MuJoCo Playground.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from belt_sim.case import Case, Schedule
from belt_sim.case import Numbers as Array
from belt_sim.errors import InputError
from belt_sim.jax_setup import in_float64
from belt_sim.space.mjx import (
    MjxData,
    MjxModel,
    PreparedCase,
    command,
    diverged,
    march,
    plan,
    simulate,
    simulate_batch,
    stack_cases,
    step,
)
from belt_sim.space.mjx import prepare_cases as prepare
from belt_sim.space.mjx import scene_of as scene
from belt_sim.space.options import Options
from belt_sim.space.run import READING, Command

__all__ = [
    "READING", "Command", "MjxData", "MjxModel", "PreparedCase", "Ranges", "SteeringEnvironment", "SteeringState",
    "command", "diverged", "march", "plan", "prepare", "scene", "simulate", "simulate_batch", "stack_cases", "step",
]  # fmt: skip


# ---- a belt to be steered, as an environment in the form of MuJoCo Playground

SETS_IN = 0.1  # [m] of travel over which what is wrong with the pulley sets in after a reset


class SteeringState(NamedTuple):
    """data: of the belt, the model of this belt in ``info``; obs (8,): y of points 1-4, tilts, tension, yaw, each over
    its scale; reward; done: 1 once the belt has run off or its motion is not finite; metrics: y1 [m], yaw [rad]."""

    data: MjxData
    obs: Array
    reward: Array
    done: Array
    metrics: dict[str, Array]
    info: dict[str, Any]


@dataclass(frozen=True)
class Ranges:
    """What a reset draws, evenly between - and + of each: yaw_offset [rad] of the tail pulley, taper [1/m] of it."""

    yaw_offset: float = 1e-3
    taper: float = 0.0


class SteeringEnvironment:
    """Belts of one mesh that differ in tension, each to be kept where it was at the reset; from then on the tail pulley
    stands askew by an unknown angle, and may be conical.

    ``reset`` and ``step`` are pure functions for jax.jit, jax.vmap (one key, one action a belt) and jax.grad; they want
    float64 (``jax_enable_x64``). The action, between -1 and 1, is the yaw of the tail pulley over ``most_yaw`` [rad],
    which it reaches evenly over ``control_travel`` [m], the travel of one ``step``. reward = -(y1 / y_scale)^2 - effort
    (change of action)^2.
    """

    action_size, observation_size = 1, 8

    def __init__(
        self, cases: Sequence[Case], *, options: Options | None = None, ranges: Ranges | None = None,
        speed: float = 1.0, control_travel: float = 0.1, most_yaw: float = 1e-3, y_scale: float = 1e-3,
        effort: float = 0.01,
    ) -> None:  # fmt: skip
        """cases: of one mesh, whose yaw counts for nothing; speed [m/s]: of all belts, which are brought to it here.

        Raises InputError for a speed that they do not reach in their run-in.
        """
        self.ranges, self.most_yaw, self.y_scale, self.effort = ranges or Ranges(), most_yaw, y_scale, effort
        self.speed, self.control_travel, self.tilt_scale, self.tension_scale = speed, control_travel, 1e-2, 1e8
        aligned = {"yaw": Schedule.step(0.0), "yaw_head": Schedule.step(0.0)}
        cases = [replace(case, settings=replace(case.settings, **aligned)) for case in cases]
        self.ready = prepare(cases, options=replace(options or Options(), belt_speed=speed))
        self.substeps = max(round(control_travel / (speed * float(self.ready[0].model.dt))), 1)
        begin = in_float64(jax.jit(lambda *run: march(*run)[0]))
        running = []
        for one in self.ready:  # brought to rest, then to its speed at travel 0
            rows = plan(one, 0.0)
            until = int(np.argmax(rows.travel >= 0.0))
            if rows.speed[until] < speed:
                raise InputError("model.run_in", one.scene.options.run_in, "m", f"too short to reach {speed:g} m/s")
            running.append(begin(one.model, one.data, jax.tree.map(lambda c, until=until: c[: until + 1], rows)))
        self.models = jax.tree.map(lambda *v: jnp.stack([jnp.asarray(x) for x in v]), *[r.model for r in self.ready])
        self.running = jax.tree.map(lambda *v: jnp.stack(v), *running)

    def reset(self, rng: Array) -> SteeringState:
        """One of the belts, whose tail pulley goes askew and conical from now on."""
        which, askew, conical = jax.random.split(rng, 3)
        k = jax.random.randint(which, (), 0, len(self.ready))
        model, data = jax.tree.map(lambda v: v[k], (self.models, self.running))
        turned = jax.random.uniform(askew, (), float, -1.0, 1.0) * self.ranges.yaw_offset
        taper = jax.random.uniform(conical, (), float, -1.0, 1.0) * self.ranges.taper
        wrong = {"yaw_offset": jnp.stack([0.0 * turned, turned]), "taper": jnp.stack([0.0 * taper, taper])}
        model = model._replace(belt=replace(model.belt, surfaces=model.belt.surfaces._replace(**wrong)))
        info = {"model": model, "began": data.travel, "y": data.reading[READING["y"]], "action": 0.0 * turned}
        return self._state(data, info, 0.0 * turned)

    def step(self, state: SteeringState, action: Array) -> SteeringState:
        """The belt after ``control_travel``; action, (1,): between -1 and 1."""
        info, wanted = state.info, jnp.clip(jnp.asarray(action).reshape(()), -1.0, 1.0)
        model: MjxModel = info["model"]

        def one(data: MjxData, part: Array) -> tuple[MjxData, None]:
            yaw = self.most_yaw * (info["action"] + part * (wanted - info["action"]))
            now = command(model, data, jnp.asarray(self.speed), jnp.stack([0.0 * yaw, yaw]), turning=jnp.inf)
            share = jnp.clip((now.travel - info["began"]) / SETS_IN, 0.0, 1.0)
            return step(model, data, now._replace(share=share)), None

        parts = (jnp.arange(self.substeps) + 1.0) / self.substeps
        data, _ = jax.lax.scan(jax.checkpoint(one), state.data, parts)  # type: ignore[attr-defined]
        return self._state(data, info | {"action": wanted}, wanted - info["action"])

    def _state(self, data: MjxData, info: dict[str, Any], change: Array) -> SteeringState:
        read = data.reading
        y, yaw = read[READING["y"]] - info["y"], self.most_yaw * info["action"]
        scaled = [y / self.y_scale, read[READING["tilt"]] / self.tilt_scale]
        obs = jnp.concatenate([*scaled, jnp.stack([read[READING["tension"]] / self.tension_scale, info["action"]])])
        reward = -((y[0] / self.y_scale) ** 2) - self.effort * change**2
        done = diverged(info["model"], data).astype(float)
        return SteeringState(data, obs, reward, done, {"y1": y[0], "yaw": yaw}, info)
