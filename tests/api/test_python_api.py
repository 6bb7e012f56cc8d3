"""Five lines in a notebook: every name of ``import belt_sim as bs``, and how results show themselves."""

import shutil
import subprocess
import sys
from dataclasses import FrozenInstanceError, replace
from inspect import signature

import numpy as np
import pytest
from paper_cases import paper_case
from small_campaign import MODEL, NAMES, SEED, campaign, diagnosed, drawn

import belt_sim as bs
from belt_sim.campaign import write_campaign
from belt_sim.curves import curves_columns
from belt_sim.io import ROOT

TAPER = {"id": "taper", "kappa_t": 2e-5}
SHORT = {"travel": 5.0}
taper = bs.library()["taper"]


class Own(taper):
    """An effect without its decorator."""


@pytest.fixture(scope="module")
def case():
    return paper_case(10)


def test_every_name_is_there_and_no_other():
    assert set(bs.__all__) <= set(dir(bs))
    for name in bs.__all__:
        assert getattr(bs, name) is getattr(bs, name)
    with pytest.raises(AttributeError, match="simulat"):
        bs.simulat  # noqa: B018


def test_names_stay_what_they_are_when_their_homes_are_loaded():
    """A subpackage of the same name would take the function's place as soon as it is imported."""
    for name in bs.__all__:
        getattr(bs, name)
    functions = [name for name in bs.__all__ if name not in ("__version__", "mjx")]  # bs.mjx is a module
    assert all(callable(getattr(bs, name)) for name in functions)
    assert not [n for n in functions if (ROOT / "belt_sim" / n).exists() or (ROOT / "belt_sim" / f"{n}.py").exists()]


def test_importing_the_package_loads_nothing():
    program = "import sys; old = set(sys.modules); import belt_sim as bs; dir(bs); print(*set(sys.modules) - old)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    assert {m.split(".")[0] for m in done.stdout.split()} - set(sys.stdlib_module_names) == {"belt_sim"}


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda file: bs.simulate(model=3), "model = 3: give a name"),
        (lambda file: bs.linearise(model=3), "model = 3: give a name"),
        (lambda file: bs.linearise(tension=[]), r"tension = \[\] N/mm2: give one"),
        (lambda file: bs.linearise(tension=[10, 10]), "give one, or at least two different ones"),
        (lambda file: bs.check_effect(file), r"defines no effect; docs/write_an_effect\.md"),
        (
            lambda file: bs.diagnose(campaign("sag_roll"), effects=[Own]),
            "effects = Own: write @effect above the class Own",
        ),
        (lambda file: bs.simulate(effects=[Own(kappa_t=1e-5)]), "effects = Own: write @effect above the class Own"),
        (lambda file: bs.simulate(effects=[Own]), "effects = Own: write @effect above the class Own"),
        (
            lambda file: bs.simulate(effects=[taper(kappa_t=np.nan)]),
            r"effects\.taper\.kappa_t = nan 1/m: give a finite number",
        ),
        (lambda file: bs.simulate(effects=[taper(kappa_t=1e9)]), r"effects\.taper\.kappa_t = 1e\+09 1/m: give at most"),
        (
            lambda file: bs.simulate(effects=[taper(kappa_t=True)]),
            r"effects\.taper\.kappa_t = True 1/m: give a finite number",
        ),
    ],
)
def test_an_argument_that_cannot_be_used_is_one_line(tmp_path, call, line):
    (tmp_path / "empty.py").write_text("import math\n")
    with pytest.raises(bs.InputError, match=line):
        call(tmp_path / "empty.py")


def test_settings_are_in_the_units_of_the_command_line(case):
    asked = bs.simulate(tension=10, yaw=0.042, **SHORT)
    np.testing.assert_allclose(asked.curves.y, bs.simulate(case, **SHORT).curves.y, rtol=1e-9)
    assert asked.case.settings.tension == 10e6
    with pytest.raises(bs.InputError, match="did you mean 10000000 Pa"):
        bs.simulate(tension=10e6, **SHORT)
    with pytest.raises(TypeError, match="unexpected keyword argument 'tensoin'"):
        bs.simulate(tensoin=3)
    with pytest.raises(bs.InputError, match="rig = mine: use one of rope_example, test_rig"):
        bs.simulate(rig="mine")
    with pytest.raises(bs.InputError, match=r"effects = Taper: give it numbers: Taper\(kappa_t=\.\.\.\)"):
        bs.simulate(effects=[bs.library()["taper"]])
    with pytest.raises(bs.InputError, match="campaign = list: give a campaign, its folder"):
        bs.compare([1.0], "strip")
    with pytest.raises(bs.InputError, match="either a case or its settings"):
        bs.simulate(case, tension=10)


def test_settings_are_the_same_in_every_signature():
    """They stand in each of them, for completion; here they are held together."""
    named = ("tension", "yaw", "yaw_head", "speed", "direction", "rig", "belt")
    for ask in (bs.simulate, bs.sweep, bs.scene, bs.linearise, bs.make_case):
        parameters = signature(ask).parameters
        own = [n for n, p in parameters.items() if p.kind is p.KEYWORD_ONLY]
        assert tuple(own[: len(named)]) == named, ask
        assert {parameters[name].default for name in named} == {None}, ask


def test_rigs_and_belts_may_be_objects_mappings_or_names(case):
    by_name = bs.simulate(rig="test_rig", belt="paper_belt", tension=10, yaw=0.042, **SHORT)
    by_object = bs.simulate(rig=case.rig, belt=case.belt, tension=10, yaw=case.settings.yaw, **SHORT)
    mapping = {"centre_distance": 11.28, "pulley_radius": 0.17, "gravity": 9.81}
    by_mapping = bs.simulate(rig=mapping, tension=10, yaw=0.042, **SHORT)
    for other in (by_object, by_mapping):
        np.testing.assert_allclose(by_name.curves.y, other.curves.y, rtol=1e-9)


def test_effects_may_be_mappings_or_objects_and_models_too(case):
    by_mapping = bs.simulate(case, model="strip", effects=[TAPER], **SHORT)
    by_object = bs.simulate(case, model=bs.model_named("strip"), effects=[bs.library()["taper"](kappa_t=2e-5)], **SHORT)
    np.testing.assert_array_equal(by_mapping.curves.y, by_object.curves.y)
    assert np.abs(by_mapping.curves.y - bs.simulate(case, **SHORT).curves.y).max() > 1e-6
    twice = [TAPER, bs.library()["taper"](kappa_t=2e-5)]
    with pytest.raises(bs.InputError, match="name each effect once"):
        bs.simulate(case, effects=twice, **SHORT)
    with pytest.raises(bs.BeltError, match="rope has no runup law for taper"):
        bs.simulate(case, model="rope", effects=[TAPER], **SHORT)


def test_a_simulation_shows_itself(case):
    s = bs.simulate(case, effects=[TAPER], **SHORT)
    first, *_ = str(s).splitlines()
    assert first.startswith("strip_lift_off + taper, 10 N/mm2: late rates in mm per m at points 1: ")
    assert f"{1e3 * s.rates[0]:+.4f}" in first
    html = s._repr_html_()
    assert html.count("<tr>") == 5
    assert f"{1e3 * s.curves.y[0, -1]:+.4f}" in html
    with pytest.raises(FrozenInstanceError):
        s.travel = 3.0


def test_a_formula_says_that_it_gives_no_curves(case):
    formula = bs.simulate(case, model="ritzinger")
    assert "it gives no curves" in repr(formula)
    assert formula.offsets is None
    with pytest.raises(bs.BeltError, match="it gives no curves"):
        formula.to_pandas()
    with pytest.raises(bs.BeltError, match="reads no effects; leave it out"):
        bs.simulate(case, model="ritzinger", effects=[TAPER])


def test_curves_as_tables(case):
    s = bs.simulate(case, **SHORT)
    table = s.to_pandas()
    assert list(table.columns) == list(curves_columns(s.curves))
    np.testing.assert_allclose(table["y1_mm"], 1e3 * s.curves.y[0])
    data = pytest.importorskip("xarray") and s.to_xarray()
    np.testing.assert_array_equal(data["y"].sel(point=3), s.curves.y[2])
    assert data["y"].dims == ("point", "travel")
    assert {n: data[n].attrs["units"] for n in ("y", "travel", "tilt")} == {"y": "m", "travel": "m", "tilt": "rad"}


def test_without_xarray_one_clear_line(case, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(bs.BeltError, match="xarray is not installed; run") as caught:
        bs.simulate(case, **SHORT).to_xarray()
    assert "\n" not in str(caught.value)


def test_a_campaign_tells_itself_in_one_paragraph(tmp_path):
    read = bs.load_campaign(write_folder(tmp_path))
    assert "\n" not in repr(read)
    assert len(repr(read)) < 400
    for words in ("sag_roll: 6 runs at 7, 14 and 40 N/mm2", "3 at yaw > 0, 3 at yaw < 0", "y1 (point 1, mm)", "30 m"):
        assert words in repr(read)
    held = replace(read, runs=tuple(replace(r, use="hold_out") for r in read.runs[:2]) + read.runs[2:])
    assert "6 runs (2 held out)" in repr(held)


def write_folder(tmp_path):
    write_campaign(campaign("sag_roll"), tmp_path / "slack")
    return tmp_path / "slack"


def test_what_a_diagnosis_found_can_be_added_to_the_model(tmp_path):
    """From a campaign to a diagnosis, its effects in the model, tables, a picture and a report."""
    told: list[tuple[int, str]] = []
    measured = bs.load_campaign(write_folder(tmp_path))

    def progress(replicates: int, stage: str) -> None:
        told.append((replicates, stage))

    seen: list[bs.Diagnosis] = []
    d = bs.diagnose(measured, MODEL, NAMES, bootstraps=200, seed=SEED, progress=progress, shown=seen.append)
    assert d.verdict is bs.Verdict.EXPLAINED
    (early,) = seen  # all that pictures of it show
    assert early.discovery is None
    assert (early.ranking, early.drawings, early.sentence) == (d.ranking, d.drawings, d.sentence)
    assert sum(n for n, _ in told) >= 200
    assert "preparing the runs" in [what for _, what in told]
    before, after = bs.compare(measured, "beam_th2"), bs.compare(measured, "beam_th2", d.effects)
    assert after.error.fit.before == pytest.approx(before.error.fit.before)
    assert after.error.fit.after < 0.2 * before.error.fit.before
    assert "fitted runs: rms" in str(after)
    assert "fitted runs: rms" not in str(before)
    table = after.to_pandas()
    assert len(table) == len(after.per_run) == 12
    assert table["after"].tolist() == [r.after for r in after.per_run]
    assert bs.report(d, tmp_path / "report.html").read_text(encoding="utf-8").count(d.sentence) == 1
    assert bs.plot(d, tmp_path / "overlay.png")._repr_png_() == (tmp_path / "overlay.png").read_bytes()


def test_effects_are_asked_for_by_name_file_or_class(tmp_path):
    from belt_sim.api.simulate import candidates_of

    wind = ROOT / "models" / "effects" / "wind.py"
    asked = ["taper", str(wind), bs.library()["crown"]]
    assert [c.id for c in candidates_of(asked, MODEL)] == ["taper", "wind", "crown"]
    assert "shear" not in [c.id for c in candidates_of(None, MODEL)]  # left out unless named
    assert "shear" in [c.id for c in candidates_of(None, MODEL, leave_out=())]
    assert {"camber", "weld", "edge_guide"} <= {c.id for c in candidates_of(None, MODEL)}
    shutil.copy(wind, tmp_path / "wind.py")
    with pytest.raises(bs.InputError, match="effects = wind: two files have an effect of this id"):
        candidates_of([str(wind), str(tmp_path / "wind.py")], MODEL)
    with pytest.raises(bs.BeltError, match="strip has sag_roll built in"):
        candidates_of(["sag_roll"], bs.model_named("strip"))


def test_a_diagnosis_shows_itself():
    d = diagnosed("sag_roll")
    said = str(d)
    assert said == repr(d)
    assert said.splitlines()[0] == f"Explained: {d.sentence}"
    assert len(said.splitlines()) < 8
    html = d._repr_html_()
    assert all(c.id in html for c in d.ranking)
    assert "7 N/mm², unseen" in html
    assert "a &lt; b" in replace(d, sentence="a < b")._repr_html_()  # what is no tag is escaped
    table = d.to_pandas()
    assert table["id"].tolist() == [c.id for c in d.ranking]
    grid = pytest.importorskip("xarray") and d.to_xarray()
    row = d.per_run[-1]
    assert float(grid["after"].sel(run=row.run, signal=row.signal)) == row.after
    assert float(grid["tension"].sel(run=row.run)) == row.tension


def test_a_diagnosis_of_a_run_folder_is_loaded(tmp_path):
    from belt_sim.api.plot import report_pictures, write_diagnosis

    found = drawn("sag_roll")
    write_diagnosis(tmp_path, found, lambda: report_pictures(found))
    back = bs.load_diagnosis(tmp_path)
    assert str(back) == str(found)
    kept = {path.stem: path.read_text(encoding="utf-8") for path in tmp_path.glob("*.svg")}
    assert report_pictures(back) == kept  # they are drawn of the numbers as files keep them
    assert bs.report(tmp_path, tmp_path / "again.html").is_file()


def test_numbers_are_fitted_with_their_covariance():
    """What is hidden comes back within three of its own uncertainties."""
    found = bs.fit(campaign("sag_roll"), ["sag_roll"], MODEL)
    assert list(found.values) == list(found.u) == ["sag_roll.strength"]
    assert abs(found.values["sag_roll.strength"] - 1.0) < 3 * found.u["sag_roll.strength"]
    assert found.covariance.shape == (1, 1)
    assert found.rms[1] < found.rms[0]
    assert found.chi2[1] < found.chi2[0]
    assert bs.compare(campaign("sag_roll"), MODEL, found.effects, drawn=False).error is not None
    both = bs.fit(campaign("sag_roll"), ["sag_roll", "taper"], MODEL)
    assert abs(both.values["taper.kappa_t"]) < 4 * both.u["taper.kappa_t"]  # from zero, and there is none
    with pytest.raises(bs.InputError, match="name at least one"):
        bs.fit(campaign("sag_roll"), [], MODEL)


def test_a_campaign_draws_its_readings(tmp_path):
    picture = campaign("sag_roll").plot(str(tmp_path / "readings.svg"))
    assert len(picture.axes) >= len(campaign("sag_roll").runs)
    assert (tmp_path / "readings.svg").stat().st_size > 10_000


def test_rows_further_apart_change_no_result(tmp_path):
    """``keep`` thins curves.csv: the rates, and y at the rows that are left, are the same bit for bit."""
    asked = {"tension": 10.0, "travel": 30.0}
    fine = bs.simulate(model="strip", **asked)
    coarse = bs.simulate(model={"name": "strip", "keep": 5.0}, **asked)
    np.testing.assert_array_equal(coarse.rates, fine.rates)
    np.testing.assert_array_equal(coarse.curves.y, fine.curves.y)
    written = coarse.written_curves
    np.testing.assert_allclose(written.travel, np.arange(0.0, 31.0, 5.0), atol=1e-9)
    np.testing.assert_array_equal(written.y, fine.curves.y[:, ::50])
