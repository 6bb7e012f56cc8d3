"""What a sample diagnosis does, counted: marches, programs and eigen-decompositions may not grow unnoticed.

The counts do not depend on the machine. A change that needs more says why, and moves the limit.
"""

from collections import Counter

import numpy as np
import pytest
from small_campaign import campaign

import belt_sim as bs
from belt_sim.diagnosis import forward
from belt_sim.discovery import responses
from belt_sim.jax_setup import StoredProgram
from belt_sim.line import march

#: campaign -> its base model, candidates, and the most of runs marched at a point, programs and calls of eigh
LIMITS = {
    "small": ("beam_th2", ["sag_roll", "taper", "yaw_offset_tail"], {"rows": 2064, "programs": 10, "eigh": 1058}),
    "machine_fault": (  # two faults, no law
        "strip", ["side_drag", "taper", "yaw_offset_tail", "edge_profile"],
        {"rows": 6590, "programs": 13, "eigh": 1480},
    ),
}  # fmt: skip
SLACK = 1.05  # rounding of another processor may cost a step


@pytest.mark.parametrize("name", ["small", pytest.param("machine_fault", marks=pytest.mark.long)])
def test_a_diagnosis_does_no_more_than_it_did(monkeypatch, name):
    model, few, limits = LIMITS[name]
    done: Counter[str] = Counter()
    plan, make, eigh = forward.Forward._march, StoredProgram._make, np.linalg.eigh

    def count(name, function):
        def counted(*arguments, **more):
            done[name] += len(arguments[1]) * len(arguments[0].samples.runs) if name == "rows" else 1
            return function(*arguments, **more)

        return counted

    monkeypatch.setattr(forward.Forward, "_march", count("rows", plan))
    monkeypatch.setattr(StoredProgram, "_make", count("programs", make))
    monkeypatch.setattr(np.linalg, "eigh", count("eigh", eigh))
    for cached in (forward.compile_march, responses._compile_march, responses._compile_changes, march._compile_march):
        cached.cache_clear()  # what other tests have compiled
    bs.diagnose(campaign("sag_roll") if name == "small" else name, model, effects=few, advise=False)
    for what, limit in limits.items():
        assert 0 < done[what] <= SLACK * limit, f"{what}: {done[what]}, {limit} before"
