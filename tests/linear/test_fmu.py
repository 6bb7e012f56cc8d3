"""The FMU moves as the march does, in FMPy and in a C program without Python, and says what it refuses."""

import re
import shutil
import subprocess
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import belt_sim as bs
from belt_sim.linear.fmu import write_fmu
from belt_sim.linear.plant import state_space

YAW = np.deg2rad(-0.042)
SPEED, STEP, STEPS = 0.5, 0.1, 200  # m/s, s: 10 m of travel
#: The wraps are rational functions of order 4, and the march has a step of its own: together 2e-4 at 10 m.
MARCH = 3e-4
#: Input held over each step: both programs add the same numbers in the same order.
SAME_LIBRARY = 1e-12
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


@cache
def content(fmi: int, model: str, effect: str | None) -> bytes:
    """An FMU of a kind, compiled once."""
    effects = [{"id": effect, "beta_0": 1e-4}] if effect else []
    plant = bs.linearise(rig="test_rig", effects=effects, model=model, tension=10)
    with tempfile.TemporaryDirectory() as place:
        return write_fmu(state_space(plant, order=4, per_metre=True), Path(place) / "belt.fmu", fmi)[0].read_bytes()


def written(folder: Path, fmi: int, model: str = "strip", effect: str | None = None) -> Path:
    (folder / "belt.fmu").write_bytes(content(fmi, model, effect))
    return folder / "belt.fmu"


def run(path: Path, steps: int = STEPS, **inputs: float):
    """Outputs of FMPy after each step, with inputs held from the start."""
    fmpy = pytest.importorskip("fmpy")
    return fmpy.simulate_fmu(
        str(path), fmi_type="CoSimulation", stop_time=steps * STEP, output_interval=STEP, start_values=inputs
    )


@needs_compiler
@pytest.mark.parametrize(("fmi", "model"), [(3, "strip"), (2, "rope")])
def test_fmpy_finds_it_valid_and_it_moves_as_the_march_does(tmp_path, fmi, model):
    validation = pytest.importorskip("fmpy.validation")
    path = written(tmp_path, fmi, model)
    assert validation.validate_fmu(str(path)) == []
    made = run(path, yaw=YAW, speed=SPEED)
    curves = bs.simulate(model=model, rig="test_rig", tension=10, yaw=-0.042, travel=10).curves
    assert made["travel"][-1] == pytest.approx(10.0)
    assert made["tension"][-1] == pytest.approx(10e6)
    for k in range(4):
        assert made[f"y{k + 1}"][-1] == pytest.approx(curves.y[k][-1], rel=MARCH)


@needs_compiler
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_c_program_gets_the_same_numbers(tmp_path, fmi):
    path = written(tmp_path, fmi)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    (library,) = tmp_path.glob("binaries/*/belt.*")
    description = (tmp_path / "modelDescription.xml").read_text()
    token = re.search(r'(?:guid|instantiationToken)="(\w+)"', description)[1]
    host = tmp_path / "host"
    subprocess.run([COMPILER, "-o", host, Path(__file__).with_name("host.c"), "-ldl"], check=True)
    asked = [host, str(fmi), library, token, repr(float(YAW)), str(SPEED), str(STEP), str(STEPS)]
    y1, travel = map(float, subprocess.run(asked, capture_output=True, text=True, check=True).stdout.split())
    assert travel == pytest.approx(10.0)
    assert y1 == pytest.approx(run(path, yaw=YAW, speed=SPEED)["y1"][-1], rel=SAME_LIBRARY)
    other = subprocess.run([*asked[:3], "stranger", *asked[4:]], capture_output=True, text=True, check=False)
    assert other.returncode == 5  # a description of another plant gets no instance
    backward = subprocess.run([*asked[:5], "-0.5", *asked[6:]], capture_output=True, text=True, check=False)
    assert (backward.returncode, "step: status 3" in backward.stderr) == (4, True)
    if fmi == 3:
        assert "export one with direction=-1" in backward.stderr


@needs_compiler
def test_what_acts_with_nothing_steered_is_in_it(tmp_path):
    effects = [{"id": "yaw_offset_tail", "beta_0": 1e-4}]
    made = run(written(tmp_path, 2, effect="yaw_offset_tail"))
    curves = bs.simulate(model="strip", rig="test_rig", tension=10, yaw=0, travel=10, effects=effects).curves
    assert abs(curves.y[0][-1]) > 1e-4
    assert made["y1"][-1] == pytest.approx(curves.y[0][-1], rel=MARCH)


@needs_compiler
def test_start_disturbance_and_standstill(tmp_path):
    path = written(tmp_path, 3)
    assert run(path, y_start=2e-3)["y4"] == pytest.approx(2e-3, rel=1e-6)  # a belt that lies straight stays there
    pushed = run(path, 3, drift=1e-3, speed=0.01)
    assert pushed["y1"][-1] == pytest.approx(1e-3 * pushed["travel"][-1], rel=1e-3)  # before the belt answers
    assert run(path, yaw=YAW, speed=0.0)["y1"][-1] == 0.0


def slave_of(path: Path, folder: Path):
    """An instance of an FMI 2 unit, initialised with the yaw, and the value references by name."""
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi2 import FMU2Slave

    description = fmpy.read_model_description(str(path))
    unit = FMU2Slave(
        guid=description.guid, unzipDirectory=fmpy.extract(str(path), str(folder)), instanceName="belt",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    names = {v.name: v.valueReference for v in description.modelVariables}
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.setReal([names["yaw"]], [YAW])
    unit.exitInitializationMode()
    return unit, [names[n] for n in ("time", "travel", "y1", "y3")]


@needs_compiler
def test_a_state_is_kept_restored_and_serialised(tmp_path):
    unit, seen = slave_of(written(tmp_path, 2), tmp_path / "unit")
    for k in range(5):
        unit.doStep(float(k), 1.0)
    state = unit.getFMUstate()
    bytes_of_state = unit.serializeFMUstate(state)
    first = []
    for k in range(5, 8):
        unit.doStep(float(k), 1.0)
        first.append(unit.getReal(seen))
    for again in (state, unit.deSerializeFMUstate(bytes_of_state)):
        unit.setFMUstate(again)
        assert unit.getReal(seen)[:2] == [5.0, 2.5]
        second = []
        for k in range(5, 8):
            unit.doStep(float(k), 1.0)
            second.append(unit.getReal(seen))
        assert second == first
        unit.freeFMUstate(again)


@needs_compiler
@pytest.mark.parametrize("at", [1.0, 3.5])
def test_a_step_back_in_time_or_a_gap_is_refused(tmp_path, at):
    unit, seen = slave_of(written(tmp_path, 2), tmp_path / "unit")
    for k in range(3):
        unit.doStep(float(k), 1.0)
    before = unit.getReal(seen)
    with pytest.raises(Exception, match="status 3"):
        unit.doStep(at, 1.0)
    assert unit.getReal(seen) == before


def test_a_cross_compiler_that_is_missing_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("belt_sim.linear.fmu.importlib.util.find_spec", lambda name: None)
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    with pytest.raises(bs.InputError, match=r"belt-sim\[fmu\]"):
        bs.export(plant, tmp_path / "out", libraries="all")
    with pytest.raises(bs.InputError, match="libraries = elsewhere"):
        bs.export(plant, tmp_path / "out", libraries="elsewhere")


@pytest.mark.long
def test_libraries_of_all_systems_are_built(tmp_path):
    pytest.importorskip("ziglang")
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    bs.export(plant, tmp_path, mat=None, libraries="all")
    with zipfile.ZipFile(tmp_path / "belt.fmu") as archive:
        marks = {name.split("/")[1]: archive.read(name)[:4] for name in archive.namelist() if "binaries" in name}
    assert {k: v[:2] for k, v in marks.items()} == {"linux64": b"\x7fE", "win64": b"MZ", "darwin64": b"\xcf\xfa"}


def test_without_a_compiler_the_sources_are_there(tmp_path, monkeypatch):
    monkeypatch.setattr("belt_sim.linear.fmu.shutil.which", lambda name: None)
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    lines = bs.export(plant, tmp_path, mat=None)
    assert any("no C compiler" in line for line in lines)
    with zipfile.ZipFile(tmp_path / "belt.fmu") as archive:
        assert set(archive.namelist()) == {"modelDescription.xml", "sources/belt.c", "sources/buildDescription.xml"}


@needs_compiler
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_source_agrees_with_the_standard(tmp_path, fmi):
    """The functions that the source defines are those that the standard's headers (FMPy has them) declare."""
    fmpy = pytest.importorskip("fmpy")
    header = next(Path(fmpy.__file__).parent.rglob(f"fmi{fmi}Functions.h"))
    declared = set(re.findall(rf"FMI{fmi}_Export\s+\w+\s+(fmi{fmi}\w+)", header.read_text()))
    with zipfile.ZipFile(written(tmp_path, fmi)) as archive:
        defined = set(re.findall(rf"^API .*?\b(fmi{fmi}\w+)\(", archive.read("sources/belt.c").decode(), re.MULTILINE))
    model_exchange = {"EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep"}
    model_exchange |= {"SetTime", "SetContinuousStates", "GetDerivatives", "GetEventIndicators"}
    model_exchange |= {"GetContinuousStates", "GetNominalsOfContinuousStates"}
    assert len(declared) > 30
    assert declared - defined - {f"fmi2{name}" for name in model_exchange} == set()
