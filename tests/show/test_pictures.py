"""Every picture is written whole, as a PNG with something on it, and never half."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.text import Text
from paper_cases import paper_case
from small_campaign import drawn

from belt_sim.api.plot import pictures_by_kind, plot
from belt_sim.api.simulate import simulate
from belt_sim.errors import BeltError, InputError
from belt_sim.results.errors import SteadyError
from belt_sim.show.curves import curves_picture, steady_picture
from belt_sim.show.diagnosis import AROUND, drift_chart_picture, overlay_picture
from belt_sim.show.style import title

PNG = b"\x89PNG\r\n\x1a\n"
ROUNDED = 1.0  # [px] by which a text may seem to leave its page
INKED = 0.01  # the least share of pixels that a picture of curves and words darkens
OF_DIAGNOSIS = ("overlay", "headline", "where", "drift")
MOVED = (-1e6, -1e3, -0.1, -2e-3, -5e-4, -1e-4)  # times as far as a belt runs
TENSIONS = (7e6, 10e6, 20e6)
STEADY = [
    SteadyError(run=f"r{k}", point=1, tension=t, measured=1e-4, modelled=1.1e-4, u=1e-5, ratio=1.0)
    for k, t in enumerate(TENSIONS)
]

NAMES = {"base": "before", "final": "after"}


@pytest.fixture(scope="module")
def runs():
    """The same case by two laws."""
    return {m: simulate(paper_case(10), model=m, travel=5.0).curves for m in ("strip", "beam_th2")}


def inked(path) -> bool:
    from matplotlib.image import imread

    pixels = imread(path)[..., :3]
    return np.mean(pixels.min(axis=-1) < 0.8) > INKED


def whole(path) -> bool:
    return path.read_bytes().startswith(PNG) and [p.name for p in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize("kind", OF_DIAGNOSIS)
def test_every_picture_of_a_diagnosis_is_written_whole(kind, tmp_path):
    d = drawn("sag_roll")
    assert set(pictures_by_kind(d)) == set(OF_DIAGNOSIS)
    path = tmp_path / "deeper" / "picture.png"
    plot(d, path, kind=kind)
    assert whole(path)
    assert inked(path)


@pytest.mark.parametrize("kind", [*OF_DIAGNOSIS, *MOVED])
def test_no_word_of_a_picture_is_cut_off(kind, runs):
    if kind in MOVED:
        scaled = replace(runs["strip"], y=runs["strip"].y * kind)
        figure = curves_picture(None, {"strip": scaled}, "A long headline " * 9)
    else:
        figure = plot(drawn("sag_roll"), kind=kind).figure
    figure.canvas.draw()
    page = figure.bbox.padded(ROUNDED)
    ticks = {t for ax in figure.findobj(Axis) for t in ax.get_ticklabels()}  # those beyond the axis are not drawn
    words = [t for t in figure.findobj(Text) if t.get_text() and t not in ticks]
    assert words
    assert [t.get_text() for t in words if not inside(page, t)] == []


def inside(page, text) -> bool:
    """Whether every corner of a text lies on the page."""
    return all(page.contains(x, y) for x, y in text.get_window_extent().corners())


def test_a_value_at_the_limit_of_its_fit_is_marked():
    before, after = drawn("sag_roll").drawings.drifts
    ended = replace(before, u=np.where(np.arange(len(before.u)) == 0, 0.0, 1.0))
    figure = drift_chart_picture(None, [ended, after], "Young's modulus", names=NAMES)
    marks = [line for line in figure.axes[0].lines if line.get_marker() == "^"]
    assert [line.get_ydata() for line in marks] == [before.value[:1]]


@pytest.mark.parametrize("names", [("strip",), ("strip", "beam_th2")])
def test_curves_of_one_and_of_several_models(names, runs, tmp_path):
    path = curves_picture(tmp_path / "curves.png", {n: runs[n] for n in names}, "At 10 N/mm²")
    assert whole(path)
    assert inked(path)


def test_before_alone(tmp_path):
    panels = [replace(p, final=None) for p in drawn("sag_roll").drawings.overlays[:1]]
    assert inked(overlay_picture(tmp_path / "one.png", panels, "One run", names=NAMES))


def test_steady_rates(tmp_path):
    assert inked(steady_picture(tmp_path / "steady.png", STEADY, "strip", "Late rates"))


def test_a_picture_that_is_not_there_is_told():
    with pytest.raises(InputError, match="kind = curves: use one of overlay, where"):
        plot(drawn("sag_roll"), kind="curves")
    with pytest.raises(InputError, match="no picture"):
        plot(simulate(model="ritzinger"))


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path, runs):
    (tmp_path / "file").write_text("")
    with pytest.raises(BeltError, match="cannot be written"):
        curves_picture(tmp_path / "file" / "x.png", runs, "Nowhere")


def test_importing_the_pictures_does_not_import_matplotlib():
    code = "import sys, belt_sim.show.curves, belt_sim.show.diagnosis; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_look_is_ours_whatever_the_users_matplotlibrc_says(runs, tmp_path):
    import matplotlib

    with matplotlib.rc_context({"text.usetex": True, "axes.facecolor": "red"}):  # LaTeX is not installed
        path = curves_picture(tmp_path / "curves.png", runs, "At 10 N/mm²")
        assert matplotlib.rcParams["text.usetex"]  # theirs stays theirs
    assert whole(path)


@pytest.mark.parametrize(("ending", "begins"), [("svg", b"<?xml"), ("PDF", b"%PDF"), ("png", PNG)])
def test_a_picture_is_what_its_ending_says(ending, begins, runs, tmp_path):
    path = curves_picture(tmp_path / f"curves.{ending}", runs, "At 10 N/mm²")
    assert path.read_bytes().startswith(begins)
    with pytest.raises(InputError, match=r"give a name that ends in \.png, \.svg, \.pdf"):
        curves_picture(tmp_path / "curves.docx", runs, "Nowhere")


@pytest.mark.parametrize("width", [3.0, 4.0, 5.0, 6.0])
def test_a_headline_keeps_a_unit_beside_its_number(width):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, 2.0))
    title(figure, "Model strip is off below 12.3 N/mm², worst in y1 of a run at 7 N/mm² and 0.04 °")
    assert not [line for line in figure.get_suptitle().split("\n") if line[0] in "N°"]


def test_panels_are_placed_by_distances():
    panels = drawn("sag_roll").drawings.overlays[:2]
    fig = overlay_picture(None, panels, "Two", names=NAMES)
    (left, right), (width, height) = (ax.get_position() for ax in fig.axes[:2]), fig.get_size_inches()
    assert (right.x0 - left.x1) * width == pytest.approx(AROUND["across"])
    assert [left.x0 * width, (1.0 - right.x1) * width] == pytest.approx([AROUND["left"], AROUND["right"]])
    assert [left.y0 * height, (1.0 - left.y1) * height] == pytest.approx([AROUND["bottom"], AROUND["top"]])
