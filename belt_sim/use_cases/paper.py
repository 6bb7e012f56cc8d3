"""Paper: its figures from computation, its statements judged, one page of both."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from belt_sim.errors import InputError
from belt_sim.files import write_json
from belt_sim.gallery.page import write_page
from belt_sim.gallery.plate import Plate, View
from belt_sim.gallery.plates import FIGURES, NOT_COMPUTED, chosen, module
from belt_sim.gallery.stored import stored
from belt_sim.watch.progress import progress


def paper(folder: Path, config: Mapping[str, Any], provenance: Mapping[str, Any]) -> list[str]:
    """Write what ``config`` (conf/paper.yaml) asks for into ``folder``; returns what to tell of it."""
    if not isinstance(config["fast"], bool):
        raise InputError("fast", config["fast"], "", "use true or false")
    view = View(in_space=not config["fast"])
    numbers = chosen(config["figures"], in_space=view.in_space)
    plates = _plates(folder, numbers, view)
    left_out = NOT_COMPUTED | {k: "not asked for" for k in FIGURES if k not in numbers}
    write_json(folder / "paper.json", _written(plates, left_out, provenance))
    page = write_page(folder, plates, left_out, _origin(provenance), {})
    return [f"{len(plates)} figures, {page}"]


def _plates(folder: Path, numbers: Sequence[int], view: View) -> list[Plate]:
    """Compute and draw, one figure after another."""
    plates = []
    with progress(len(numbers), "paper") as done:
        for number in numbers:
            plate = module(number).plate(view)
            plate.draw(folder / plate.file)
            plates.append(plate)
            done(note=f"figure {number}")
    return plates


def _written(plates: Sequence[Plate], left_out: Mapping[int, str], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that is drawn, as numbers."""
    figures = {
        str(p.number): {
            "title": p.title,
            "caption": p.caption,
            "file": p.file,
            "numbers": dict(p.numbers),
            "stored_runs": {name: stored(name).made for name in p.stored},
        }
        for p in plates
    }
    return {
        "schema": "belt-paper/1",
        "figures": figures,
        "left_out": {str(k): why for k, why in sorted(left_out.items())},
        "provenance": dict(provenance),
    }


def _origin(provenance: Mapping[str, Any]) -> str:
    commit = provenance["commit"]
    return f"{provenance['command']}" + (f", commit {commit[:7]}" if commit else "")
