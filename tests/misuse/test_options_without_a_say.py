"""Options and sizes that could do nothing, or nothing that is meant: each is refused by name, or said."""

import numpy as np
import pytest

import belt_sim as bs
from belt_sim.api.campaigns import import_files
from belt_sim.case import Case, Rig, Schedule, Settings
from belt_sim.commands.cli import run_command
from belt_sim.errors import InputError
from belt_sim.io import MODEL_FOLDER
from belt_sim.settings import belt_from, rig_from
from belt_sim.validity import geometric
from belt_sim.virtual_rig.hidden import fault_from_spec, specified_hidden


def test_what_hides_nothing_or_twice_is_refused():
    with pytest.raises(InputError, match=r"hidden taper\.kappa_t = 0 1/m: hides nothing"):
        fault_from_spec({"id": "taper", "kappa_t": 0.0})
    with pytest.raises(InputError, match="hidden = taper: name each fault once"):
        specified_hidden(["taper", {"id": "taper", "kappa_t": 1e-5}], lambda: None)


@pytest.mark.parametrize(("name", "number"), [("edge_guide", "stiffness"), ("pulley_deflection", "compliance")])
def test_a_size_of_the_wrong_sign_is_refused(name, number):
    with pytest.raises(InputError, match=f"effects.{name}.{number} = -1e-06 .*: must be 0 or more"):
        bs.simulate(tension=20.0, travel=1.0, model="strip", effects=[{"id": name, number: -1e-6}])


@pytest.mark.parametrize("option", ["travel", "step"])
def test_check_refuses_a_plan_s_options_of_a_campaign_that_is_measured(option):
    with pytest.raises(InputError, match=f"{option} = .* is of planned runs"):
        bs.check("slack_belt", model="strip", **{option: 2.0})


def test_a_fit_leaves_out_the_numbers_of_sensors_that_are_missing():
    found = bs.fit("slack_belt", ["sensor_gain"], model="strip")
    assert {*found.values} == {"sensor_gain.g1", "sensor_gain.g4"}
    assert np.isfinite(list(found.u.values())).all()
    assert any("sensor_gain.g2, sensor_gain.g3: no reading" in note for note in found.notes)


def test_an_import_takes_the_sealed_truth_of_another_campaign_away_and_says_so(tmp_path, capsys):
    logger = MODEL_FOLDER / "loggers"
    files, folder = [str(logger / "lauf_01.csv")], tmp_path / "c"
    import_files(files, folder, mapping=logger / "my_rig.yaml", pictures=False)
    (folder / "truth.sealed").write_text("of another campaign")
    (folder / "notes.txt").write_text("kept")
    import_files(files, folder, mapping=logger / "my_rig.yaml", pictures=False, overwrite=True)
    assert not (folder / "truth.sealed").exists()
    assert (folder / "notes.txt").read_text() == "kept"
    assert "removed " in capsys.readouterr().out


def test_faces_narrower_than_the_belt_are_told_before_a_run():
    rig, belt = vars(rig_from("test_rig")), belt_from("paper_belt")
    settings = Settings(tension=20e6, yaw=Schedule.step(0.0))
    narrow, wide = (Case(rig=Rig(**rig | {"face_width": w}), belt=belt, settings=settings) for w in (0.15, 0.3))
    assert [x.id for x in geometric(narrow)] == ["off_pulley"]
    assert geometric(wide) == ()


@pytest.mark.parametrize(
    ("option", "says"), [("draft=true", "draft = True: write the name"), ("mapping=5", "mapping = 5: give a mapping")]
)
def test_a_draft_or_mapping_that_is_no_file_is_one_line(tmp_path, monkeypatch, capsys, option, says):
    monkeypatch.chdir(tmp_path)
    file = MODEL_FOLDER / "loggers" / "lauf_01.csv"
    assert run_command(["import", f"files=[{file}]", option, "hydra.run.dir=run", "pictures=false"]) != 0
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("number", ["012", "0x10", "1:30", "1:30.5"])
def test_numbers_to_other_bases_than_ten_are_refused_in_an_effects_file(tmp_path, number):
    """YAML 1.1 reads them as 10, 16, 90 and 90.5."""
    file = tmp_path / "effects.yaml"
    file.write_text(f"schema: belt-effects/1\neffects:\n- {{id: edge_guide, stiffness: {number}}}\n")
    with pytest.raises(InputError, match=rf"effects\.edge_guide\.stiffness = {number}.*: give a finite number"):
        bs.simulate(tension=20.0, travel=1.0, model="strip", effects=file)


def test_what_is_of_a_travel_or_of_an_fmu_is_refused_without(tmp_path):
    with pytest.raises(InputError, match=r"at = \[1\.0\] m: steady rates in closed form have no travel"):
        bs.sweep(tension=[10, 20], travel=None, at=[1.0], model="strip")
    plant = bs.linearise(tension=20.0, model="strip")
    for option in ({"fmi": 3}, {"libraries": "all"}):
        with pytest.raises(InputError, match=f"{next(iter(option))} = .*: is of the FMU, and fmu is null"):
            bs.export(plant, tmp_path, fmu=None, **option)
    assert not any(tmp_path.iterdir())
