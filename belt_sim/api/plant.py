"""The linear plant that a controller sees, and its files for other tools."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from belt_sim.api.resolve import ModelSpec, effects_of, fitted_model
from belt_sim.case import Case
from belt_sim.errors import InputError, finite
from belt_sim.io import provenance, write_json
from belt_sim.linear.plant import LinearBelt, PlantSchedule, linear_belt, plant_json, state_space
from belt_sim.settings import CaseSettings, case_or_settings
from belt_sim.units import N_PER_MM2


def linearise(
    case: Case | None = None, *, model: ModelSpec = "strip", effects: Any = None, **settings: Unpack[CaseSettings]
) -> LinearBelt | PlantSchedule:
    """The linear plant of ``case`` (in SI), or of the case that ``settings`` describe as for ``simulate``.

    A sequence of tensions [N/mm2] gives a ``PlantSchedule``, a plant at any tension between them. Raises InputError,
    CannotRepresent.
    """
    chosen, acting = fitted_model(model), effects_of(effects)
    tension = settings.get("tension")
    if not isinstance(tension, Sequence) or isinstance(tension, str):
        return linear_belt(case_or_settings(case, settings), chosen, acting)  # type: ignore[no-any-return]
    if not tension:
        raise InputError("tension", tension, "N/mm2", "give one, or at least two different ones")
    first = case_or_settings(case, settings | {"tension": tension[0]})
    cases = [replace(first, settings=replace(first.settings, tension=float(t) * N_PER_MM2)) for t in tension]
    return PlantSchedule.from_plants([linear_belt(c, chosen, acting) for c in cases])


def export(
    plant: LinearBelt,
    folder: Path | str,
    *,
    order: int = 4,
    delay: str = "pade",
    highest: float = 2.0,
    fmu: str | None = "belt.fmu",
    fmi: int = 2,
    libraries: str = "here",
    mat: str | None = "belt.mat",
    config: Any = None,
) -> list[str]:
    """Write ``plant`` into ``folder`` as an FMU, a MAT file, bode.png and plant.json; return what to tell of them.

    order, delay: rational function that replaces each wrapped arc; highest [rad per metre of travel]: up to where its
    error is stated; fmi: 2 or 3; libraries: of the FMU, "here" or "all" (extra ``fmu``); fmu, mat: file names, None for
    no such file; config: for the provenance. Raises InputError before anything is written.
    """
    from belt_sim.linear.fmu import write_fmu
    from belt_sim.show.curves import bode_picture

    finite("highest", highest, "rad/m", "give a positive number", lambda x: x > 0)
    for kind, name in (("fmu", fmu), ("mat", mat)):
        bare = name is None or (isinstance(name, str) and Path(name).name == name and Path(name).suffix == f".{kind}")
        if not bare:
            remedy = f"give a file name ending in .{kind} (it is put in the run folder), or null"
            raise InputError(kind, name, "", remedy)
    if fmi not in (2, 3):
        raise InputError("fmi", fmi, "", "use 2 or 3, the version of the FMI standard")
    if libraries not in ("here", "all"):
        raise InputError("libraries", libraries, "", "use here (this system) or all (Linux, macOS and Windows)")
    folder = Path(folder)
    metres = state_space(plant, order=order, delay=delay, per_metre=True)
    lines = [
        f"wrapped arcs by {delay}, order {order}: off by at most {metres.error(highest):.1e} of each response up to "
        f"{highest:g} rad per metre of travel ({highest * plant.speed:g} rad/s)"
    ]
    if fmu:
        path, systems = write_fmu(metres, folder / fmu, fmi, libraries)
        built = f"built for {', '.join(systems)}" if systems else "without a library: no C compiler (cc) was found here"
        lines.append(f"{path}  FMI {fmi}.0, {built}; other systems: build its sources/belt.c")
    if mat:
        lines.append(str(state_space(plant, order=order, delay=delay).save_mat(folder / mat)))
    lines.append(str(bode_picture(folder / "bode.png", metres, float(highest))))
    lines.append(str(write_json(folder / "plant.json", plant_json(metres, float(highest), provenance(config)))))
    return lines
