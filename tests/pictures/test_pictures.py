"""Every picture is written whole, as a PNG with something on it, and never half."""

import subprocess
import sys

import made_up
import numpy as np
import pytest

from belt_sim import pictures
from belt_sim.errors import BeltError

PNG = b"\x89PNG\r\n\x1a\n"
INKED = 0.01  # the least share of pixels that a picture of curves and words darkens

PICTURES = {
    "curves": lambda p: pictures.curves_picture(p, {"strip": made_up.curves()}, "Strip law at 10 N/mm²"),
    "compared": lambda p: pictures.curves_picture(
        p, {"strip": made_up.curves(), "beam Th2": made_up.curves(-2e-4)}, "Two laws at 10 N/mm²"
    ),
    "overlay": lambda p: pictures.overlay_picture(p, made_up.panels(), "Before and after sag-roll coupling"),
    "before_only": lambda p: pictures.overlay_picture(p, made_up.panels(1, final=False), "One run"),
    "where": lambda p: pictures.where_map_picture(p, made_up.maps(), "Where beam_th2 fails", "Adequate above 23"),
    "drift": lambda p: pictures.drift_chart_picture(p, made_up.drifts(), "Fitted tension by tension"),
    "rates": lambda p: pictures.rates_picture(p, made_up.rates()[0], "Late rate of point 1", made_up.rates()[1]),
    "ranking": lambda p: pictures.ranking_picture(p, made_up.ranking(), "What explains the error"),
}


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_written_whole(name, tmp_path):
    from matplotlib.image import imread

    path = PICTURES[name](tmp_path / "deeper" / f"{name}.png")
    assert path.read_bytes().startswith(PNG)
    assert [p.name for p in path.parent.iterdir()] == [f"{name}.png"]
    pixels = imread(path)[..., :3]
    assert np.mean(pixels.min(axis=-1) < 0.8) > INKED


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BeltError, match="cannot be written"):
        PICTURES["curves"](tmp_path / "file" / "x.png")


def test_importing_the_pictures_does_not_import_matplotlib():
    code = "import sys, belt_sim.pictures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_names_of_lines_that_end_together_keep_apart():
    from belt_sim.pictures.rates import _apart

    heights = _apart([(0.2, "a", ""), (0.201, "b", ""), (0.1, "c", "")], gap=0.02)
    assert np.diff(heights).min() >= 0.02 - 1e-12
    assert heights[0] == 0.1
