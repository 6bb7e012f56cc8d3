"""Batches of 3D cases on JAX: what engine=mjx and engine=quasi_static do alike around their own steps."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import InputError, SimulationError
from belt_sim.scene_parts import SceneParts
from belt_sim.space.belt import ActiveFeatures, active_features
from belt_sim.space.options import RUNAWAY, Options
from belt_sim.space.recording import POINTS

_BYTES = 900  # of a case, a station and a pair of lines: 0.72-0.85 GB measured for 256 cases of the full rig
_SMALL_GPU = 4e9  # bytes, where it does not say
_MOST = 256  # cases of a chunk on one GPU: more are no faster, and more is lost when it is stopped


@dataclass(frozen=True)
class BatchEngine:
    """The entries of an engine on JAX.

    refuse(belt, options, parts): raises CannotRepresent for what the engine cannot do. lay_case(case, belt, travel,
    options, parts, features): a case that the engine can run, with its ``kind`` and the ``stations`` of its mesh.
    in_batches(cases, chunk, ...): curves of cases of one kind, which are run at once, chunk by chunk.
    """

    refuse: Callable[[str, Options, SceneParts], None]
    lay_case: Callable[[Case, str, float, Options, SceneParts, ActiveFeatures], Any]
    in_batches: Callable[..., Iterator[list[Curves | SimulationError]]]

    def prepare_case(
        self,
        case: Case,
        *,
        belt: str = "flex",
        travel: float,
        options: Options | None = None,
        parts: SceneParts | None = None,
        features: ActiveFeatures | None = None,
    ) -> Any:
        """A case that is to be run over ``travel`` [m]; features: in its batch, None = in this case.

        Raises CannotRepresent for what the engine cannot do.
        """
        options = options or Options()
        parts = parts or SceneParts.from_case(case, options.friction)
        self.refuse(belt, options, parts)
        return self.lay_case(case, belt, travel, options, parts, features or active_features([parts]))

    def simulate_batch(
        self,
        cases: Sequence[Case],
        *,
        belt: str = "flex",
        travel: float,
        options: Options | None = None,
        parts: Sequence[SceneParts] | None = None,
        chunk: int | None = None,
        **watched: Any,
    ) -> list[Curves | SimulationError]:
        """Curves of all cases, in order, over ``travel`` [m], at most ``chunk`` of them at once (None: as many as fit).

        Cases may differ in everything but the mesh: tension [Pa], yaw schedules [rad], effects (parts), material. A
        case that fails is a SimulationError, with the curves so far in its ``curves``, and stops no other. watched:
        observers of the first case (engine=mjx). Raises InputError for meshes with unlike numbers of stations.
        """
        options = options or Options()
        parts = parts or [SceneParts.from_case(case, options.friction) for case in cases]
        features = active_features(parts)
        ready = [
            self.prepare_case(c, belt=belt, travel=travel, options=options, parts=p, features=features)
            for c, p in zip(cases, parts, strict=True)
        ]
        if len({r.kind for r in ready}) > 1:
            counts = sorted({r.stations for r in ready})
            raise InputError("cases", f"{counts} stations", "", "give cases of one mesh and direction to a batch")
        return [found for some in self.in_batches(ready, chunk, **watched) for found in some]

    def simulate(self, case: Case, *, parts: SceneParts | None = None, **run: Any) -> Curves:
        """Curves of one case; run: as of ``simulate_batch``. y = 0 at travel 0.

        Raises SimulationError when it diverges.
        """
        found = self.simulate_batch([case], parts=None if parts is None else [parts], **run)[0]
        if isinstance(found, SimulationError):
            raise found
        return found


def cases_per_chunk(stations: int, lines: int) -> int:
    """Cases at once on one device: on a GPU what half of its memory holds, but at most _MOST; on a CPU one, as more
    gain nothing there."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return 1
    memory = (device.memory_stats() or {}).get("bytes_limit", _SMALL_GPU)
    return max(min(int(0.5 * memory / (_BYTES * stations * lines**2)), _MOST), 1)


def is_on_pulleys(rows: np.ndarray, width: float) -> np.ndarray:
    """Which rows of readings (k, 17 or more) are finite and of a belt of ``width`` [m] that is still on its pulleys."""
    return np.isfinite(rows).all(axis=1) & (np.abs(rows[:, POINTS]).max(axis=1) < RUNAWAY * width)


def failure_with(curves: Curves, why: str) -> SimulationError:
    """A SimulationError that carries the curves so far; ``why`` may name {where}, the last travel in them."""
    where = f"after {curves.travel[-1] if len(curves.travel) else 0.0:.2f} m"
    failure = SimulationError(why.format(where=where))
    failure.curves = curves
    return failure
