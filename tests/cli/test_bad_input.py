"""Whatever a user gets wrong is one line on standard error, a non-zero exit, and no traceback."""

import errno
from pathlib import Path

import pytest
from command import SHORT, refusal
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import belt_sim as bs
from belt_sim.campaign import CampaignError

# (what is typed, what the line must hold)
WRONG = [
    (["tension=-4"], "tension = -4 N/mm2: must be 0.1 to 1500 N/mm2"),
    (["tension=40e6"], "did you mean 40000000 Pa, that is 40 N/mm2?"),
    (["tension="], "give a finite number"),
    (["hydra=3"], "hydra = 3: is a group of settings; set one of them, as hydra.run.dir=FOLDER"),
    (["tensoin=4"], "tensoin: no such key; did you mean tension?"),
    (["belt.widht=0.2"], "belt.widht: no such key; did you mean belt.width?"),
    (["rig.radius=0.2"], "rig.radius: no such key"),
    (["model=membrain"], "model = membrain: use one of beam_th1, beam_th2, by_tension, ernst_beam"),
    (["rig=mine"], "rig = mine: use one of rope_example, test_rig"),
    (["rig=null"], "rig"),
    (["tension"], "write key=value"),
    (["tension=[1,2"], "write key=value"),
    (["~tension"], "tension: is left out, and simulate needs it"),
    (["--tension=4"], "--tension=4: no such flag"),
    (["model=rope", "effects=[sag_roll]"], "model rope has no span law for sag_roll"),
    (["speed=50", "effects=[{id: speed_tension, share: 140}]"], "effects leave none"),
    (["model=ritzinger", "effects=[sag_roll]"], "reads no effects"),
]
# one value, and what the line must hold
VALUES = [
    ("tension=0", "tension = 0 N/mm2"),
    ("tension=tight", "tension = tight N/mm2: give a finite number"),
    ("tension=nan", "give a finite number"),
    ("tension=inf", "give a finite number"),
    ("tension=true", "give a finite number"),
    ("tension=null", "give a finite number"),
    ("rig.face_width=[0.2,0.3]", "rig.face_width = [0.2, 0.3] m: give one number; only a sweep takes a list"),
    ("yaw=42", "yaw = 42 deg: must be -2 to 2 deg"),
    ("yaw=left", "yaw = left degrees"),
    ("yaw=[{at: 0}]", "write {at: metres, yaw: degrees, over: metres}"),
    ("yaw=[{at: 5, yaw: 0.1},{at: 3, yaw: 0}]", "entries must follow one another"),
    ("yaw_head=3", "yaw_head = 3 deg"),
    ("travel=0", "travel = 0 m: must be 0.1 to 100000 m"),
    ("travel=far", "travel = far m"),
    (f"travel=1{'0' * 400}", "give a finite number"),
    ("direction=2", "use 1 or -1"),
    ("speed=-1", "speed = -1 m/s"),
    ("belt.width=wide", "belt.width = wide m: give a finite number"),
    ("belt.width=200", "belt.width = 200 m: must be 2 to 10000 mm; did you mean 200 mm"),
    ("belt.youngs_modulus=210", "belt.youngs_modulus = 210 Pa"),
    ("rig.centre_distance=0.2", "the pulleys overlap"),
    ("rig.head_radius=3", "rig.head_radius"),
    ("rig.gravity=-1", "rig.gravity = -1 m/s2"),
    ("model.step=0", "model.step = 0 m"),
    ("model.step=-1", "model.step = -1 m"),
    ("model.step=0.9", "model.step = 0.9 m: must be 0.0001 to 0.1 m"),
    ("model.keep=often", "model.keep = often m"),
    ("model.name=membrane", "use one of rope"),
    ("pictures=maybe", "give true or false"),
    ("watch=telly", "use null, rrd or rerun"),
    ("effects=[foo]", "effects = foo: use one of build_up, camber, cant, crown"),
    ("effects=[taper]", "it would do nothing; give numbers"),
    ("effects=[{id: taper, kappa_t: 0}]", "would do nothing"),
    ("effects=[{id: taper, kappa: 1}]", "its parameters are kappa_t, kappa_t_head"),
    ("effects=[{id: taper, kappa_t: steep}]", "effects.taper.kappa_t = steep 1/m"),
    ("effects=[{kappa_t: 1}]", "every entry needs an id"),
    ("effects=[{id: crown, c: 1e-3},{id: crown, c: 1e-3}]", "name each effect once"),
    ("effects=3", "give a list"),
    ("effects=missing.yaml", "effects = missing.yaml: no such file"),
    ("effects=[missing.py]", "effects = missing.py: no such file"),
    ("effects=[sag_roll]", "model strip has sag_roll built in already; leave it out"),
]


def is_one_line(answer) -> bool:
    """One line on standard error that names itself, a failing status, no traceback."""
    lines = answer.err.strip().splitlines()
    return (
        answer.status != 0 and len(lines) == 1 and lines[0].startswith("belt-sim: ") and "Traceback" not in answer.out
    )


@pytest.mark.parametrize(("overrides", "says"), WRONG, ids=[" ".join(o) for o, _ in WRONG])
def test_wrong_values(belt, overrides, says):
    answer = belt.simulate(*overrides)
    assert is_one_line(answer), answer.err
    assert says in answer.err


@pytest.mark.parametrize(("value", "says"), VALUES)
def test_wrong_values_of_a_configuration(tmp_path, value, says):
    assert says in refusal("simulate", tmp_path, SHORT, value)


def test_a_model_is_not_offered_instead_of_itself(tmp_path):
    assert refusal("simulate", tmp_path, SHORT, "effects=[sag_roll]").endswith("; leave it out")
    said = refusal("simulate", tmp_path, (*SHORT, "model=beam_th2"), "effects=[{id: flatness, amplitude: 1.0e+6}]")
    assert said.endswith("; leave it out or use model=strip")


def test_unknown_command(belt):
    answer = belt("simmulate")
    assert is_one_line(answer)
    assert "use one of simulate, view, scene, compare" in answer.err


def test_no_command_prints_the_usage(belt):
    answer = belt()
    assert answer.status == 2
    assert "usage: belt-sim COMMAND" in answer.out


def test_a_folder_that_cannot_be_written(belt):
    belt.folder = "/proc/no/such/place"
    assert is_one_line(belt.simulate())


@pytest.mark.parametrize("kind", ["a dangling link", "a link to itself", "a file", "below a file"])
@pytest.mark.parametrize("many", [(), ("-m", "tension=20,30")])
def test_a_folder_that_is_none(belt, tmp_path, kind, many):
    belt.folder = place = tmp_path / "place"
    if "link" in kind:
        place.symlink_to("missing" if kind == "a dangling link" else "place")
    else:
        place.write_text("", encoding="utf-8")
        belt.folder = place / "run" if kind == "below a file" else place
    answer = belt("simulate", *many, "model=rope", "travel=2", "pictures=false")
    assert is_one_line(answer)
    assert f"belt-sim: {belt.folder}" in answer.err
    assert "it is no folder; name another" in answer.err


def test_a_full_disk_is_told_with_its_folder(belt, monkeypatch):
    def fill(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("hydra.core.utils._save_config", fill)
    answer = belt.simulate("model=rope")
    assert is_one_line(answer)
    assert f"belt-sim: {belt.folder} = No space left on device" in answer.err


def test_a_campaign_that_cannot_be_read(belt, monkeypatch):
    def refuse(path, *_):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    belt.folder.mkdir()
    for name in ("iterdir", "is_file"):
        monkeypatch.setattr(Path, name, refuse)
    with pytest.raises(CampaignError, match="is not a folder that can be read"):
        bs.check(belt.folder)


BROKEN_YAML = {
    "empty": "",
    "no schema": "effects: [{id: taper, kappa_t: 1.0e-5}]\n",
    "other schema": "schema: belt-campaign/1\neffects: []\n",
    "no mapping": "- taper\n",
    "no yaml": "schema: [belt-effects/1\n",
    "text for a number": "schema: belt-effects/1\neffects: [{id: taper, parameters: {kappa_t: 2e-5x}}]\n",
    "effects a number": "schema: belt-effects/1\neffects: 3\n",
    "effects of text": "schema: belt-effects/1\neffects: [[taper]]\n",
    "parameters a list": "schema: belt-effects/1\neffects: [{id: taper, parameters: [1]}]\n",
    "id a number": "schema: belt-effects/1\neffects: [{id: 3}]\n",
}


@pytest.mark.parametrize("content", BROKEN_YAML.values(), ids=BROKEN_YAML)
def test_broken_effects_file(tmp_path, content):
    path = tmp_path / "effects.yaml"
    path.write_text(content, encoding="utf-8")
    assert "effects" in refusal("simulate", tmp_path, SHORT, f"effects={path}")


BROKEN_PYTHON = {
    "syntax": "def (:\n",
    "import": "import no_such_module\n",
    "no effect": "x = 1\n",
    "no text": b"\xff\xfe",
}


@pytest.mark.parametrize("content", BROKEN_PYTHON.values(), ids=BROKEN_PYTHON)
def test_broken_effect_of_ones_own(tmp_path, content):
    path = tmp_path / "mine.py"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert "mine.py" in refusal("simulate", tmp_path, SHORT, f"effects=[{path}]")


KEYS = ["tension", "yaw", "travel", "direction", "speed", "belt.width", "rig.gravity", "model.step", "effects", "watch"]


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(key=st.sampled_from(KEYS), value=st.text(alphabet="abz019.-+[]{}:,'\"$ =", min_size=1, max_size=6))
def test_no_value_gives_a_traceback(belt, key, value):
    # belt.thickness is wrong in any case, so that a value that happens to be good runs no march
    answer = belt.simulate("belt.thickness=-1", f"{key}={value}")
    assert is_one_line(answer), (key, value, answer.err)
