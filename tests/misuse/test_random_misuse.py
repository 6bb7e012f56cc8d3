"""Random damage to what is read (studies/misuse.py) ends in a result or in one line: never in a traceback or a wait."""

import random
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from belt_sim.effects.load import load_effects
from belt_sim.errors import BeltError
from belt_sim.importing.mapping import mapping_of
from studies.misuse import BAD, EFFECTS, KINDS, LOGGERS, finish, in_folder, misuse, mutate_bytes, mutate_tree

#: Seconds without an answer that are a hang, on a machine that does other things too.
PATIENCE = 120.0
SEEDS = range(2)
QUICK = ("reading", "slip", "mapping", "effects")
#: Cases of the long test.
MANY = 1000


@pytest.mark.parametrize("kind", QUICK)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_damaged_input_is_used_or_refused(kind, seed):
    outcome, said, case = in_folder(kind, seed, PATIENCE)
    assert outcome not in BAD, f"{case.words}: {said}"


def test_a_slip_that_is_accepted_counts_as_silent(tmp_path):
    case = KINDS["reading"][0](tmp_path, random.Random(1))
    outcome, _ = finish(type(case)(["--version"], "accepted", refused=True), PATIENCE)
    assert outcome == "silent"


MAPPING = yaml.safe_load((LOGGERS / "my_rig.yaml").read_text(encoding="utf-8"))


@settings(max_examples=75, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(rng=st.randoms(use_true_random=False), of_text=st.booleans())
def test_a_mapping_however_damaged_is_read_or_refused(rng, of_text):
    text = yaml.safe_dump(mutate_tree(MAPPING, rng)[0], sort_keys=False)
    text = mutate_bytes(text, rng)[0] if of_text else text
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "mapping.yaml"
        file.write_bytes(text.encode("utf-8", "surrogatepass"))
        with suppress(BeltError):
            assert mapping_of(file).schema_ == "belt-mapping/1"


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(rng=st.randoms(use_true_random=False))
def test_an_effects_file_however_damaged_is_read_or_refused(rng):
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "effects.yaml"
        file.write_text(yaml.safe_dump(mutate_tree(EFFECTS, rng)[0]), encoding="utf-8")
        with suppress(BeltError):
            assert all(e.id for e in load_effects(str(file)))


@pytest.mark.long
def test_a_thousand_cases():
    found = misuse(MANY, seed=7, limit=PATIENCE)
    assert sum(found.values()) == MANY
    assert not [key for key in found if key[1] in BAD]
