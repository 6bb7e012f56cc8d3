"""The samples in models/campaigns are what their command writes."""

import pytest

from belt_sim.campaign import read_campaign
from belt_sim.io import CAMPAIGNS
from belt_sim.virtual_rig import reveal
from studies.samples import SAMPLES, write_sample

LARGEST = 400_000  # bytes


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    folder = tmp_path_factory.mktemp("samples")
    for name in SAMPLES:
        write_sample(name, folder)
    return folder


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_is_made_anew_bit_for_bit(name, fresh):
    kept = sorted((CAMPAIGNS / name).iterdir())
    assert [p.name for p in kept] == sorted(p.name for p in (fresh / name).iterdir())
    for path in kept:
        assert path.read_bytes() == (fresh / name / path.name).read_bytes()


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_is_small_and_its_truth_opens(name):
    folder = CAMPAIGNS / name
    assert sum(path.stat().st_size for path in folder.iterdir()) < LARGEST
    assert [e["id"] for e in reveal(folder).effects] == [f["id"] for f in SAMPLES[name]["hidden"]]
    assert len(read_campaign(folder).runs) == 10
