"""The paper's figures computed, its statements judged, one page of both: python -m studies.paper (make paper).

Leaves index.html, a picture a figure and paper.json in ``folder``.
"""

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from belt_sim.errors import InputError
from belt_sim.io import provenance, write_json, write_text
from belt_sim.show.terminal import progress
from studies.application import application
from studies.paper.drawing import FIGURES, NOT_COMPUTED, compute, select_figures
from studies.paper.report import answer, criteria, document, lay_pictures, verdicts, what_decides, write_page
from studies.paper.statements import judge_models
from studies.paper.stored_runs import stored_run


def paper(config: Mapping[str, Any]) -> None:
    """Write what ``config`` (studies/conf/paper.yaml) asks for into its folder, and print where."""
    folder, origin, target, fast = Path(config["folder"]), provenance(config), config["document"], config["fast"]
    if not isinstance(fast, bool):
        raise InputError("fast", fast, "", "use true or false")
    if target is not None and (not isinstance(target, str) or Path(target).suffix != ".md"):
        raise InputError("document", target, "", "give a file name ending in .md, or null")
    numbers = select_figures(config["figures"])
    plates = []
    with progress(len(numbers), "paper") as done:
        for number in numbers:
            plates.append(compute(number, in_space=not fast))
            plates[-1].save(folder)
            done(note=f"figure {number}")
    left_out = NOT_COMPUTED | {k: "not asked for" for k in FIGURES if k not in numbers}
    judgements = judge_models(in_space=not fast)
    told, question = verdicts(judgements), answer(judgements)
    figures: dict[str, dict[str, Any]] = {}
    for p in plates:
        figures[str(p.number)] = {"title": p.title, "caption": p.caption, "file": p.file, "numbers": dict(p.numbers)}
        figures[str(p.number)]["stored_runs"] = {name: stored_run(name).made for name in p.stored}
    content = {
        "schema": "belt-paper/1",
        "figures": figures,
        "statements": {name: {m: vars(j) for m, j in of.items()} for name, of in judgements.items()},
        "open_question": {"answer": question, "what_decides": what_decides()},
        "left_out": {str(k): why for k, why in sorted(left_out.items())},
        "provenance": dict(origin),
    }
    write_json(folder / "paper.json", content)
    source = origin["command"] + (f", commit {origin['commit'][:7]}" if origin["commit"] else "")
    said = "".join(f"<p>{escape(p)}</p>" for p in question)
    made = [write_page(folder, plates, left_out, source, told.html() + criteria().html(), said)]
    if target is not None:
        command = "python -m studies.paper" + (" fast=true" if fast else "")
        command += f" figures={config['figures']}".replace(", ", ",") if config["figures"] is not None else ""
        text = document(plates, left_out, f"{command} document={target}", told, question)
        made.append(write_text(Path(target), text))
        lay_pictures(Path(target), folder, plates)
    print(f"{len(plates)} figures, {', '.join(str(p) for p in made)}")


if __name__ == "__main__":
    application("paper", paper)
