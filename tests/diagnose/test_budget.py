"""What a sample diagnosis does, counted: marches, programs and eigen-decompositions may not grow unnoticed.

The counts do not depend on the machine. A change that needs more says why, and moves the limit.
"""

from collections import Counter

import numpy as np
import pytest

import belt_sim as bs
from belt_sim.diagnosis import forward
from belt_sim.discovery import responses
from belt_sim.jax_setup import StoredProgram
from belt_sim.line import march

FEW = {
    "slack_belt": ["sag_roll", "taper", "yaw_offset_tail"],
    "machine_fault": ["side_drag", "taper", "yaw_offset_tail", "edge_profile"],  # two faults, no law
}
#: runs marched at a point, programs asked for, calls of eigh
LIMITS = {
    ("machine_fault", "strip"): {"rows": 6590, "programs": 13, "eigh": 1480},
    ("slack_belt", "beam_th2"): {"rows": 4150, "programs": 10, "eigh": 1772},
}
SLACK = 1.05  # rounding of another processor may cost a step


@pytest.mark.parametrize(
    ("campaign", "model"), [pytest.param(*c, marks=[pytest.mark.long] * (c[0] == "machine_fault")) for c in LIMITS]
)
def test_a_diagnosis_does_no_more_than_it_did(monkeypatch, campaign, model):
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
    bs.diagnose(campaign, model, effects=FEW[campaign], advise=False)
    for name, limit in LIMITS[campaign, model].items():
        assert 0 < done[name] <= SLACK * limit, f"{name}: {done[name]}, {limit} before"
