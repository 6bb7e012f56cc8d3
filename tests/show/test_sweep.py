"""Pictures of a sweep are keyed by what was swept."""

import pickle
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
import pytest
from moving_belt import case, curves

import belt_sim as bs
from belt_sim.show.curves import (
    DASHES,
    SHOWN_VALUES,
    FinishedRun,
    draw_sweep,
    looks_of,
    sweep_curves,
    sweep_rates,
    swept_keys,
)
from belt_sim.show.style import CYCLE

RATES = {7: 0.1, 10: 0.2, 20: 0.15, 40: 0.12}  # mm per m


def finished(tension=10.0, yaw=-0.042, model="strip", effects="", **more):
    """A run of a made-up belt whose rate goes with the sign of the yaw."""
    keys = {"tension": tension, "yaw": yaw, "effects": effects, "model": model, **more}
    rate = 1e-3 * np.sign(yaw) * RATES.get(tension, 0.1)
    return FinishedRun(
        keys=keys, case=case(), model=model, curves=curves(5.0), late=0.7 * rate, steady=rate, settled=False
    )


SWEEP = [finished(t, y, m) for t, y, m in product(RATES, (-0.042, 0.03), ("strip", "rope"))]


def test_colour_is_the_tension_and_dash_the_model():
    looks, lines = looks_of(SWEEP, swept_keys(SWEEP))
    assert [line.get_label() for line in lines][3:6] == ["40 N/mm²", "strip", "rope"]
    for run, look in zip(SWEEP, looks, strict=True):
        assert look["color"] == CYCLE[list(RATES).index(run.keys["tension"])]
        assert look["linestyle"] == DASHES[("strip", "rope").index(run.model)]
    assert len({str(look) for look in looks}) == len(SWEEP)  # none is taken for another


def test_every_curve_is_drawn():
    figure = sweep_curves(None, SWEEP, swept_keys(SWEEP))
    for ax in figure.axes:
        assert len([line for line in ax.lines if len(line.get_xdata()) > 2]) == len(SWEEP)


def test_rates_are_steady_ones_and_yaws_are_lines_of_their_own():
    figure = sweep_rates(None, SWEEP, "tension", ["yaw", "model"])
    (ax,) = figure.axes
    lines = [line for line in ax.lines if line.get_linestyle() != "None" and len(line.get_xdata()) == len(RATES)]
    assert len(lines) == 4
    for line in lines:
        sign = np.sign(line.get_ydata()[0])
        np.testing.assert_allclose(line.get_ydata(), sign * np.array(list(RATES.values())))
    assert ax.get_ylabel().startswith("steady rate")


@pytest.mark.parametrize("steady", [None, 1e-4])
def test_a_rate_that_has_not_settled_is_hollow(steady):
    runs = [replace(finished(t), steady=steady, settled=t > 15) for t in RATES]
    (ax,) = sweep_rates(None, runs, "tension", []).axes
    dots = [line for line in ax.lines if line.get_marker() == "o"]
    full, hollow = ([d for d in dots if (d.get_markerfacecolor() == "white") == white] for white in (False, True))
    assert [list(d.get_xdata()) for d in full if len(d.get_xdata())] == [[20, 40]]
    assert [list(d.get_xdata()) for d in hollow if len(d.get_xdata())] == [[7, 10]]


@pytest.mark.parametrize(
    ("runs", "made"),
    [
        ([finished(yaw=y) for y in (-0.042, 0.0, 0.03)], {"sweep_curves.png", "sweep_rates.png"}),
        ([finished(effects=e) for e in ("", "[taper]")], {"sweep_curves.png"}),
        ([finished(**{"belt.width": w}) for w in (0.1, 0.2, 0.3)], {"sweep_curves.png", "sweep_rates.png"}),
        ([finished()], set()),
    ],
)
def test_whatever_is_swept_is_drawn(runs, made, tmp_path):
    assert {p.name for p in draw_sweep(tmp_path, runs)} == made == {p.name for p in tmp_path.iterdir()}


def test_of_very_many_values_a_few_are_shown_and_that_is_said():
    runs = [finished(float(t)) for t in range(10, 74)]
    figure = sweep_curves(None, runs, swept_keys(runs))
    assert len([line for line in figure.axes[0].lines if len(line.get_xdata()) > 2]) == SHOWN_VALUES
    assert f"({SHOWN_VALUES} of 64 runs)" in figure.get_suptitle()


@pytest.fixture(scope="module")
def table():
    """Rates against tension."""
    return bs.sweep(tension=[7, 40, 60], model="strip", travel=200)


def test_a_table_of_rates_is_drawn_hollow_where_they_have_not_settled(table):
    """bs.plot of bs.sweep(tension=[...]): as the pictures of a sweep."""
    assert 0 < table["settled"].sum() < 3
    (ax,) = bs.plot(table).axes
    steady, *dots = ax.get_lines()
    assert list(steady.get_ydata()) == list(table["steady_rate_mm_per_m"])
    drawn = {line.get_markerfacecolor() == "white": list(line.get_ydata()) for line in dots}
    assert drawn == {not there: list(rows["rate1_mm_per_m"]) for there, rows in table.groupby("settled")}


def test_a_table_draws_itself_and_its_parts_are_plain(table, tmp_path):
    assert table.plot(tmp_path / "x.png").save(tmp_path / "y.png").is_file()
    assert (tmp_path / "x.png").is_file()
    drawn = (table.plot(kind="offset_upper_mm"), bs.plot(table, kind="offset_upper_mm"))
    assert drawn[0].axes[0].get_ylabel() == drawn[1].axes[0].get_ylabel()
    for plain in (table.copy(), table[["model"]], pd.concat([table, table])):
        assert type(plain) is pd.DataFrame
    assert pickle.loads(pickle.dumps(table)).attrs == table.attrs
    pd.testing.assert_frame_equal(table.to_pandas(), pd.DataFrame(table))
    lines = str(table).splitlines()
    assert lines[0].split() == ["tension_n_per_mm2", "rate1", "rate2", "rate3", "rate4", "settled"]
    assert max(map(len, lines)) <= 80
    assert len(lines) == 6


def test_a_map_of_rates_that_have_not_settled_is_of_the_steady_ones_and_ends_where_its_cases_do():
    table = bs.sweep(tension=[20, 40, 60], yaw=[-0.042, 0.042], model="strip", travel=5.0)
    assert not table["settled"].any()
    (ax, _) = bs.plot(table).axes
    assert ax.figure.get_suptitle() == "Steady rate, 6 cases"
    assert (*ax.get_xlim(), *ax.get_ylim()) == pytest.approx((20, 60, -0.042, 0.042))
