"""The logger's files that ship are what their command writes, and what was put in comes out of the import."""

import numpy as np
import pytest

from belt_sim.campaign import suspicions
from belt_sim.importing import read, understand
from belt_sim.io import MODEL_FOLDER
from studies.loggers import BEFORE, NOISE, SPACING, TENSIONS, loggers

FILES = sorted((MODEL_FOLDER / "loggers").glob("lauf_*.csv"))


def test_the_files_are_made_anew(tmp_path):
    loggers({"out": str(tmp_path), "seed": 31})
    assert [p.name for p in sorted(tmp_path.iterdir())] == [p.name for p in FILES]
    for path in FILES:
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()


@pytest.fixture(scope="module")
def sound():
    """The campaign of the files as they ship."""
    return understand(read(FILES), MODEL_FOLDER / "loggers" / "my_rig.yaml").complete()


def test_what_was_put_in_comes_out(sound):
    assert sorted({r.tension / 1e6 for r in sound.runs}) == pytest.approx(TENSIONS)
    assert [r.repeat_of for r in sound.runs[-2:]] == ["lauf_02", "lauf_05"]
    assert all(abs(r.yaw_at - (BEFORE - SPACING / 2.0)) < SPACING / 2.0 for r in sound.runs)
    for run in sound.runs:  # a repeat's, too: how far it is from where its first run's was
        assert SPACING / np.sqrt(12.0) - 1e-3 <= run.yaw_at_u < SPACING
    assert len({tuple(r.travel) for r in sound.runs}) == 1  # so that repeats compare
    for signal in sound.signals:
        assert signal.wander_sd == pytest.approx(NOISE.wander_sd, rel=0.4)
        assert signal.white == pytest.approx(NOISE.white / np.sqrt(2.0), rel=0.4)  # two rows a step
        assert 1.0 < signal.wander_length < 9.0


def test_a_sensor_that_fails_is_left_out_where_it_fails(sound, tmp_path):
    rng = np.random.default_rng(31)
    for k, path in enumerate(FILES, start=1):
        lines = path.read_text(encoding="cp1252").splitlines()
        rows, column = range(4, len(lines)), 4 if k == 2 else 5
        silent = rows[int(0.55 * len(rows)) : int(0.58 * len(rows))] if k == 2 else ()
        for at in (*silent, *(rng.integers(24, len(lines) - 20, 3) if k in (2, 5) else ())):
            cells = lines[at].split(";")
            jumped = f"{float(cells[column].replace(',', '.')) + 25.0:.4f}".replace(".", ",")
            cells[column] = "-9999,0000" if at in silent else jumped
            lines[at] = ";".join(cells)
        (tmp_path / path.name).write_text("\r\n".join([*lines, ""]), encoding="cp1252")
    proposal = understand(read(sorted(tmp_path.iterdir())), MODEL_FOLDER / "loggers" / "my_rig.yaml")
    campaign = proposal.complete()
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
