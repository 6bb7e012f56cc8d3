"""The logger's files that ship are what their command writes, and what was put in comes out of the import."""

import numpy as np
import pytest

from belt_sim.campaign import suspicions
from belt_sim.importing import read, understand
from belt_sim.io import MODELS
from studies.loggers import BEFORE, FORMS, NOISE, SPACING, loggers

FILES = sorted((MODELS / "loggers").glob("lauf_*.csv"))


def test_the_files_are_made_anew(tmp_path):
    loggers({"form": "csv", "out": str(tmp_path), "seed": 31})
    assert [p.name for p in sorted(tmp_path.iterdir())] == [p.name for p in FILES]
    for path in FILES:
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()


def test_what_was_put_in_comes_out():
    campaign = understand(read(FILES), MODELS / "loggers" / "my_rig.yaml").complete()
    assert sorted({r.tension / 1e6 for r in campaign.runs}) == pytest.approx(FORMS["csv"].tensions)
    assert [r.repeat_of for r in campaign.runs[-2:]] == ["lauf_02", "lauf_05"]
    assert all(abs(r.yaw_at - (BEFORE - SPACING / 2.0)) < SPACING / 2.0 for r in campaign.runs)
    for run in campaign.runs:  # a repeat's, too: how far it is from where its first run's was
        assert SPACING / np.sqrt(12.0) - 1e-3 <= run.yaw_at_u < SPACING
    assert len({tuple(r.travel) for r in campaign.runs}) == 1  # so that repeats compare
    for signal in campaign.signals:
        assert signal.wander_sd == pytest.approx(NOISE.wander_sd, rel=0.4)
        assert signal.white == pytest.approx(NOISE.white / np.sqrt(2.0), rel=0.4)  # two rows a step
        assert 1.0 < signal.wander_length < 9.0


MACHINE = {
    "machine": {"centre_distance": "6.4 m", "pulley_radius": "250 mm"},
    "belt": {"width": "400 mm", "thickness": "0.8 mm", "youngs_modulus": "210 GPa", "density": "7850"},
}


@pytest.mark.parametrize("name", ["workbook", "tabs"])
def test_machine_and_belt_are_all_that_is_asked(name, tmp_path):
    loggers({"form": name, "out": str(tmp_path), "seed": 31})
    logged = read(sorted(tmp_path.iterdir()))
    assert {q.path[0] for q in understand(logged).missing} == {"machine", "belt"}
    campaign = understand(logged, MACHINE).complete()
    assert sorted({r.tension / 1e6 for r in campaign.runs}) == pytest.approx(FORMS[name].tensions, rel=1e-3)
    assert {round(abs(np.rad2deg(r.yaw)), 6) for r in campaign.runs} == {FORMS[name].yaw}
    assert {s.at for s in campaign.signals} == {"point_1", "point_4"}
    assert all(abs(r.yaw_at - (BEFORE - SPACING / 2.0)) < SPACING / 2.0 for r in campaign.runs)
    assert sum(r.repeat_of is not None for r in campaign.runs) == 2


def test_a_sensor_that_fails_is_left_out_where_it_fails(tmp_path):
    loggers({"form": "dropout", "out": str(tmp_path), "seed": 31})
    proposal = understand(read(sorted(tmp_path.iterdir())), MODELS / "loggers" / "my_rig.yaml")
    campaign, sound = proposal.complete(), understand(read(FILES), MODELS / "loggers" / "my_rig.yaml").complete()
    said = " ".join(n.text for n in proposal.notes)
    assert "-9999 stands for no reading" in said
    assert "3 readings jump away and back" in said
    for run, other in zip(campaign.runs, sound.runs, strict=True):
        for n, y in run.signals.items():
            same = np.isfinite(y)
            assert same.mean() > 0.9
            half_a_row = 0.5 * SPACING * abs(run.yaw)  # by which the mean of two rows moves that lacks one
            assert np.abs(y - other.signals[n])[same].max() < 5.0 * NOISE.white + half_a_row
    assert not [s for s in suspicions(campaign) if s.severity == "stop"]
