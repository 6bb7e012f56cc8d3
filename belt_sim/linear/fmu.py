"""Export as an FMU for co-simulation (FMI 2.0 or 3.0): the linear plant as C source, compiled where a compiler is."""

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.errors import InputError
from belt_sim.files import write_with
from belt_sim.linear.plant import StateSpace
from belt_sim.provenance import version_of
from belt_sim.si import N_PER_MM2

_HERE = Path(__file__).parent
#: (system, machine) -> folder of its library in an FMU of FMI 2 and of FMI 3 (None: the standard has none), ending
_FOLDERS = {
    ("Linux", "x86_64"): ("linux64", "x86_64-linux", "so"),
    ("Linux", "aarch64"): (None, "aarch64-linux", "so"),
    ("Darwin", "x86_64"): ("darwin64", "x86_64-darwin", "dylib"),
    ("Darwin", "arm64"): (None, "aarch64-darwin", "dylib"),
}
_BUILD = """\
<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="belt">
    <SourceFileSet language="C99"><SourceFile name="belt.c"/></SourceFileSet>
  </BuildConfiguration>
</fmiBuildDescription>
"""
#: descriptions of variables
DRIFT = "disturbance: lateral drift per belt travel, added where the belt runs up the tail pulley"
Y_START = "lateral position of the whole belt at the start"
Y_AT = "lateral position of the belt at point"
TENSION = "belt tension at which the plant holds"
#: DefaultExperiment: travel in all and of each step [m]
_TRAVEL, _STEP = 60.0, 0.05


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU as modelDescription.xml has it; shown: its display unit."""

    name: str
    causality: str
    unit: str
    description: str
    variability: str = "continuous"
    shown: str = ""
    initial: str = ""
    start: float | None = None


def write_fmu(space: StateSpace, path: Path, fmi: int = 2) -> tuple[Path, str | None]:
    """Write ``space`` (per metre of travel) as an FMU of ``fmi`` 2 or 3; return its path and its library's platform.

    Inputs yaw, yaw_head [rad], drift [m/m], speed [m/s], parameter y_start [m], outputs y1..y4, travel [m], tension
    [Pa]. The C source is always in it; the platform is None where no C compiler was found.
    """
    content = _content(space, fmi)
    source = _render("belt.c.j2", content)
    files: dict[str, str | bytes] = {
        "modelDescription.xml": _render("modelDescription.xml.j2", content),
        "sources/belt.c": source,
        "sources/buildDescription.xml": _BUILD,
    }
    *folders, ending = _FOLDERS.get((platform.system(), platform.machine()), (None, None, ""))
    folder = folders[fmi - 2]
    library = _library(source, ending) if folder else None
    if library:
        files[f"binaries/{folder}/belt.{ending}"] = library

    def write(temporary: Path) -> None:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in files.items():
                archive.writestr(name, data)

    return write_with(path, write), folder if library else None


def _content(space: StateSpace, fmi: int) -> dict[str, Any]:
    """Everything that the templates name."""
    plant, states = space.plant, len(space.plant.states)
    drift = np.zeros((len(space.a), 1))
    drift[0, 0] = 1.0  # of y where the belt runs up the tail pulley
    constant, shifted = np.zeros(len(space.a)), np.zeros(len(space.a))
    constant[:states] = plant.constant
    shifted[:states] = [name.startswith("y_") for name in plant.states]
    late = slice(states, None)  # the wraps, filled with a belt that lies there for long
    shifted[late] = np.linalg.solve(space.a[late, late], -space.a[late, :states] @ shifted[:states])
    variables = _variables(plant.speed, plant.tension)
    outputs = [k for k, v in enumerate(variables) if v.causality == "output"]
    tension = f"{plant.tension / N_PER_MM2:g} N/mm2"
    content = {
        "fmi": fmi,
        "a": space.a.tolist(),
        "b": np.hstack([space.b, drift]).tolist(),
        "c": space.c.tolist(),
        "k": constant.tolist(),
        "shifted": shifted.tolist(),
        "inputs": ["yaw", "yaw_head", "drift"],
        "variables": variables,
        "outputs": outputs,
        "calculated": [k for k in outputs if variables[k].variability == "continuous"],
        "direction": plant.direction,
        "description": f"Steel belt on two pulleys: model {plant.model}, {tension}, direction {plant.direction:+d}, "
        f"wrapped arcs by {space.delay} of order {space.order}",
        "stop": f"{_TRAVEL / plant.speed:.6g}",
        "step": f"{_STEP / plant.speed:.6g}",
        "version": version_of("belt-sim") or "0",
    }
    token = hashlib.sha256(repr(content).encode()).hexdigest()[:32]
    return content | {"token": token, "now": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")}


def _variables(speed: float, tension: float) -> list[Variable]:
    """All variables; their order is that of the value references, and yaw, yaw_head, drift stand together."""
    points = ("upper end, tail pulley", "lower end, tail pulley", "lower end, head pulley", "upper end, head pulley")
    return [
        Variable("time", "independent", "s", "time"),
        Variable("yaw", "input", "rad", "yaw of the tail pulley", shown="deg", start=0.0),
        Variable("yaw_head", "input", "rad", "yaw of the head pulley", shown="deg", start=0.0),
        Variable("drift", "input", "m/m", DRIFT, shown="mm/m", start=0.0),
        Variable("speed", "input", "m/s", "belt speed, not negative", start=speed),
        Variable("y_start", "parameter", "m", Y_START, variability="fixed", initial="exact", shown="mm", start=0.0),
        *(
            Variable(f"y{k}", "output", "m", f"{Y_AT} {k} ({point})", initial="calculated", shown="mm")
            for k, point in enumerate(points, 1)
        ),
        Variable("travel", "output", "m", "belt travel since the start", initial="calculated"),
        Variable(
            "tension", "output", "Pa", TENSION, variability="constant", initial="exact", shown="N/mm2", start=tension
        ),
    ]


def _render(template: str, content: Mapping[str, Any]) -> str:
    import jinja2

    engine = jinja2.Environment(loader=jinja2.FileSystemLoader(_HERE), undefined=jinja2.StrictUndefined)
    engine.filters["numeral"] = lambda number: repr(float(number))
    return engine.get_template(template).render(content) + "\n"


def _library(source: str, ending: str) -> bytes | None:
    """The source compiled as a shared library; None where there is no C compiler. Raises InputError if it fails."""
    compiler = shutil.which(os.environ.get("CC") or "cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "belt.c").write_text(source, encoding="utf-8")
        shared = ["-dynamiclib"] if ending == "dylib" else ["-shared", "-fPIC"]
        command = [compiler, "-std=c99", "-O2", *shared, "-fvisibility=hidden", "-o", f"belt.{ending}", "belt.c"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            said = (done.stderr.strip() or f"status {done.returncode}").splitlines()[0]
            raise InputError("CC", compiler, "", f"the C compiler fails: {said}; set CC to another, or fmu=null")
        return (Path(folder) / f"belt.{ending}").read_bytes()
