"""The logger's files that ship are what their command writes, and what was put in comes out of the import."""

import numpy as np
import pytest

from belt_sim.files import MODELS
from belt_sim.importing import read, understand
from studies.loggers import BEFORE, NOISE, SPACING, TENSIONS, loggers

FILES = sorted((MODELS / "loggers").glob("lauf_*.csv"))


def test_the_files_are_made_anew(tmp_path):
    loggers({"out": str(tmp_path), "seed": 31})
    assert [p.name for p in sorted(tmp_path.iterdir())] == [p.name for p in FILES]
    for path in FILES:
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()


def test_what_was_put_in_comes_out():
    campaign = understand(read(FILES), MODELS / "loggers" / "my_rig.yaml").complete()
    assert sorted({r.tension / 1e6 for r in campaign.runs}) == pytest.approx(TENSIONS)
    assert [r.repeat_of for r in campaign.runs[-2:]] == ["lauf_02", "lauf_05"]
    assert all(abs(r.yaw_at - (BEFORE - SPACING / 2.0)) < SPACING / 2.0 for r in campaign.runs)
    for run in campaign.runs:  # a repeat's, too: how far it is from where its first run's was
        assert SPACING / np.sqrt(12.0) - 1e-3 <= run.yaw_at_u < SPACING
    assert len({tuple(r.travel) for r in campaign.runs}) == 1  # so that repeats compare
    for signal in campaign.signals:
        assert signal.wander_sd == pytest.approx(NOISE.wander_sd, rel=0.4)
        assert signal.white == pytest.approx(NOISE.white / np.sqrt(2.0), rel=0.4)  # two rows a step
        assert 1.0 < signal.wander_length < 9.0
