"""The paper's figures computed, its statements judged, one page of both: python -m studies.paper (make paper).

Leaves index.html, a picture a figure and paper.json in ``folder``.
"""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from belt_sim.errors import InputError
from belt_sim.files import write_json, write_text
from belt_sim.provenance import provenance
from belt_sim.show.observers import progress
from studies.application import application
from studies.paper.plate import FIGURES, IN_SPACE, NOT_COMPUTED, Plate, compute, select_figures
from studies.paper.report import answer, criteria, document, lay_pictures, verdicts, what_decides, write_page
from studies.paper.statements import Judgement, judge_models
from studies.paper.stored_runs import stored_run


def paper(config: Mapping[str, Any]) -> None:
    """Write what ``config`` (studies/conf/paper.yaml) asks for into its folder, and print where."""
    folder, origin = Path(config["folder"]), provenance(config)
    if not isinstance(config["fast"], bool):
        raise InputError("fast", config["fast"], "", "use true or false")
    target = _document(config["document"])
    in_space = not config["fast"]
    numbers = select_figures(config["figures"], in_space=in_space)
    plates = _plates(folder, numbers, in_space)
    left_out = NOT_COMPUTED | {k: _why_not(k, in_space) for k in FIGURES if k not in numbers}
    judgements = judge_models(in_space=in_space)
    told, question = verdicts(judgements), answer(judgements)
    write_json(folder / "paper.json", _paper_json(plates, left_out, judgements, question, origin))
    parts = {"table": told.html() + criteria().html(), "question": "".join(f"<p>{escape(p)}</p>" for p in question)}
    made = [write_page(folder, plates, left_out, _origin(origin), parts)]
    if target is not None:
        made.append(write_text(target, document(plates, left_out, _command(config), told, question)))
        lay_pictures(target, folder, plates)
    print(f"{len(plates)} figures, {', '.join(str(p) for p in made)}")


def _document(asked: Any) -> Path | None:
    if asked is None:
        return None
    if not isinstance(asked, str) or Path(asked).suffix != ".md":
        raise InputError("document", asked, "", "give a file name ending in .md, or null")
    return Path(asked)


def _why_not(number: int, in_space: bool) -> str:
    three_dimensional = number in IN_SPACE and not in_space
    return "a belt in three dimensions, left out by fast=true" if three_dimensional else "not asked for"


def _command(config: Mapping[str, Any]) -> str:
    """What writes the document again."""
    words = ["python -m studies.paper"]
    words += ["fast=true"] if config["fast"] else []
    words += [f"figures={config['figures']}".replace(" ", "")] if config["figures"] is not None else []
    return " ".join([*words, f"document={config['document']}"])


def _plates(folder: Path, numbers: Sequence[int], in_space: bool) -> list[Plate]:
    """Compute and draw, one figure after another."""
    plates = []
    with progress(len(numbers), "paper") as done:
        for number in numbers:
            plate = compute(number, in_space=in_space)
            plate.draw(folder / plate.file)
            plates.append(plate)
            done(note=f"figure {number}")
    return plates


def _paper_json(
    plates: Sequence[Plate],
    left_out: Mapping[int, str],
    judgements: Mapping[str, Mapping[str, Judgement]],
    question: Sequence[str],
    origin: Mapping[str, Any],
) -> dict[str, Any]:
    """Everything that is drawn, as numbers."""
    figures = {
        str(p.number): {
            "title": p.title,
            "caption": p.caption,
            "file": p.file,
            "numbers": dict(p.numbers),
            "stored_runs": {name: stored_run(name).made for name in p.stored},
        }
        for p in plates
    }
    return {
        "schema": "belt-paper/1",
        "figures": figures,
        "statements": {name: {m: vars(j) for m, j in of.items()} for name, of in judgements.items()},
        "open_question": {"answer": list(question), "what_decides": what_decides()},
        "left_out": {str(k): why for k, why in sorted(left_out.items())},
        "provenance": dict(origin),
    }


def _origin(origin: Mapping[str, Any]) -> str:
    commit = origin["commit"]
    return f"{origin['command']}" + (f", commit {commit[:7]}" if commit else "")


if __name__ == "__main__":
    application("paper", paper)
