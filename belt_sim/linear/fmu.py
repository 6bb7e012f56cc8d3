"""Export as an FMU for co-simulation (FMI 2.0 or 3.0): the linear plant as C source, compiled where a compiler is."""

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.errors import InputError
from belt_sim.io import code_origin, write_with
from belt_sim.linear.plant import StateSpace, lying_at
from belt_sim.units import N_PER_MM2

#: System of a library: its target for zig, folder in an FMU of FMI 2 and of FMI 3 (None: the standard has none), ending
_SYSTEMS = {
    ("Linux", "x86_64"): ("x86_64-linux-gnu.2.17", "linux64", "x86_64-linux", "so"),
    ("Linux", "aarch64"): ("aarch64-linux-gnu.2.17", None, "aarch64-linux", "so"),
    ("Darwin", "x86_64"): ("x86_64-macos", "darwin64", "x86_64-darwin", "dylib"),
    ("Darwin", "arm64"): ("aarch64-macos", None, "aarch64-darwin", "dylib"),
    ("Windows", "AMD64"): ("x86_64-windows-gnu", "win64", "x86_64-windows", "dll"),
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
DRIFT_MEANING = "disturbance: lateral drift per belt travel, added where the belt runs up the tail pulley"
Y_START = "lateral position of the whole belt at the start"
Y_AT = "lateral position of the belt at point"
TENSION_MEANING = "belt tension at which the plant holds"
#: DefaultExperiment: travel in all and of each step [m]
_TRAVEL, _STEP = 60.0, 0.05


@dataclass(frozen=True)
class FmuVariable:
    """A variable of the FMU as modelDescription.xml has it; shown: its display unit."""

    name: str
    causality: str
    unit: str
    description: str
    variability: str = "continuous"
    shown: str = ""
    initial: str = ""
    start: float | None = None


def write_fmu(space: StateSpace, path: Path, fmi: int = 2, libraries: str = "here") -> tuple[Path, tuple[str, ...]]:
    """Write ``space`` (per metre of travel) as an FMU of ``fmi`` 2 or 3; return its path and its libraries' platforms.

    Inputs yaw, yaw_head [rad], drift [m/m], speed [m/s], parameter y_start [m], outputs y1..y4, travel [m], tension
    [Pa]. libraries: "here" compiles for this system, where a C compiler is; "all" cross-compiles for Linux, macOS and
    Windows by the package ziglang. The C source is always in it. Raises InputError, also where the compiler fails.
    """
    import jinja2

    engine = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent), undefined=jinja2.StrictUndefined)
    engine.filters["numeral"] = lambda number: repr(float(number))
    content, templates = _content(space, fmi), ("belt.c.j2", "modelDescription.xml.j2")
    source, description = (engine.get_template(name).render(content) + "\n" for name in templates)
    files: dict[str, str | bytes] = {
        "modelDescription.xml": description,
        "sources/belt.c": source,
        "sources/buildDescription.xml": _BUILD,
    }
    everywhere, here, built = libraries == "all", (platform.system(), platform.machine()), []
    for system, (target, *folders, ending) in _SYSTEMS.items():
        folder = folders[fmi - 2]
        if not folder or not (everywhere or system == here):
            continue
        if everywhere:
            if importlib.util.find_spec("ziglang") is None:
                remedy = "pip install belt-sim[fmu] brings the cross-compiler, or use here"
                raise InputError("libraries", "all", "", remedy)
            compiler = [sys.executable, "-m", "ziglang", "cc", "-target", target]
        else:
            found = shutil.which(os.environ.get("CC") or "cc") or shutil.which("gcc") or shutil.which("clang")
            if found is None:
                continue
            compiler = [found]

        # the source compiled as a shared library
        with tempfile.TemporaryDirectory() as place:
            (Path(place) / "belt.c").write_text(source, encoding="utf-8")
            shared = {"dylib": ["-dynamiclib"], "dll": ["-shared"], "so": ["-shared", "-fPIC"]}[ending]
            hidden = [] if ending == "dll" else ["-fvisibility=hidden"]
            command = [*compiler, "-std=c99", "-O2", *shared, *hidden, "-o", f"belt.{ending}", "belt.c"]
            done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
            if done.returncode:
                said = (done.stderr.strip() or f"status {done.returncode}").splitlines()[0]
                raise InputError("CC", compiler[0], "", f"the C compiler fails: {said}; set CC to another, or fmu=null")
            files[f"binaries/{folder}/belt.{ending}"] = (Path(place) / f"belt.{ending}").read_bytes()
        built.append(str(folder))

    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return write_with(path, lambda temporary: temporary.write_bytes(packed.getvalue())), tuple(built)


def _content(space: StateSpace, fmi: int) -> dict[str, Any]:
    """Everything that the templates name."""
    plant, states = space.plant, len(space.plant.states)
    drift = np.zeros((len(space.a), 1))
    drift[0, 0] = 1.0  # of y where the belt runs up the tail pulley
    constant = np.zeros(len(space.a))
    constant[:states] = plant.constant
    points = ("upper end, tail pulley", "lower end, tail pulley", "lower end, head pulley", "upper end, head pulley")
    variables = [  # in the order of the value references; yaw, yaw_head, drift stand together
        FmuVariable("time", "independent", "s", "time"),
        FmuVariable("yaw", "input", "rad", "yaw of the tail pulley", shown="deg", start=0.0),
        FmuVariable("yaw_head", "input", "rad", "yaw of the head pulley", shown="deg", start=0.0),
        FmuVariable("drift", "input", "m/m", DRIFT_MEANING, shown="mm/m", start=0.0),
        FmuVariable("speed", "input", "m/s", "belt speed, not negative", start=plant.speed),
        FmuVariable("y_start", "parameter", "m", Y_START, variability="fixed", initial="exact", shown="mm", start=0.0),
        *(
            FmuVariable(f"y{k}", "output", "m", f"{Y_AT} {k} ({point})", initial="calculated", shown="mm")
            for k, point in enumerate(points, 1)
        ),
        FmuVariable("travel", "output", "m", "belt travel since the start", initial="calculated"),
        FmuVariable(
            "tension", "output", "Pa", TENSION_MEANING, "constant", initial="exact", shown="N/mm2", start=plant.tension
        ),
    ]
    outputs = [k for k, v in enumerate(variables) if v.causality == "output"]
    tension = f"{plant.tension / N_PER_MM2:g} N/mm2"
    content = {
        "fmi": fmi,
        "a": space.a.tolist(),
        "b": np.hstack([space.b, drift]).tolist(),
        "c": space.c.tolist(),
        "k": constant.tolist(),
        "shifted": lying_at(space, 1.0).tolist(),
        "inputs": ["yaw", "yaw_head", "drift"],
        "variables": variables,
        "outputs": outputs,
        "calculated": [k for k in outputs if variables[k].variability == "continuous"],
        "direction": plant.direction,
        "description": f"Steel belt on two pulleys: model {plant.model}, {tension}, direction {plant.direction:+d}, "
        f"wrapped arcs by {space.delay} of order {space.order}",
        "stop": f"{_TRAVEL / plant.speed:.6g}",
        "step": f"{_STEP / plant.speed:.6g}",
        "version": code_origin()["versions"]["belt-sim"] or "0",
    }
    token = hashlib.sha256(repr(content).encode()).hexdigest()[:32]
    return content | {"token": token, "now": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")}
