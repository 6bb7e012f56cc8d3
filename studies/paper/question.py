"""The open question, why a slack belt runs faster for good, answered as far as what was computed carries."""

import json
from collections.abc import Mapping
from typing import Any

from studies.paper.models import LOOKS
from studies.paper.statements.judgement import REPRODUCED, Judgement
from studies.paper.stored import PLACE

DECIDES = PLACE / "what_decides.json"  # by studies/what_decides.py
SHOWN = 3  # further runs that are told


def what_decides() -> dict[str, Any]:
    """The stored answer of the diagnosis's next-run search."""
    found: dict[str, Any] = json.loads(DECIDES.read_text(encoding="utf-8"))
    return found


def answer(judgements: Mapping[str, Mapping[str, Judgement]]) -> list[str]:
    """Paragraphs."""
    return [*_what_models_say(judgements), *_what_would_decide(what_decides())]


def _what_models_say(judgements: Mapping[str, Mapping[str, Judgement]]) -> list[str]:
    slow, fast, read = (_reproducing(judgements[name]) for name in ("M2", "M3", "M3, read early"))
    both = [m for m in slow if m in fast]
    early = [m for m in slow if m in read]
    m4 = judgements["M4"]["strip"]
    strip = judgements["M3"]["strip"].number, judgements["M3, read early"]["strip"].number
    return [
        "A slow start (M2) together with a steady rate that is a lot higher at low tension (M3): "
        + (f"{_names(both)}." if both else "no model here has both.")
        + f" With the slow start: {_names(slow)}. With the higher steady rate: {_names(fast)}"
        + "".join(f" (start at 7 and 10 N/mm2: {judgements['M2'][m].number})" for m in fast if m not in slow)
        + ".",
        f"A slow start together with a higher rate as a record of 10 to 15 m shows it: {_names(early)}. Of the "
        f"hanging strip the rates at 7 and 10 N/mm2 are {strip[0]} in the long run, but {strip[1]} over 10 to 15 m.",
        "So M2 and M3 agree with the strip law if the measured rates were read within the first swing of the belt, and "
        "M3 does not if they were steady. Which of the two it was is not in the paper's text, and computation cannot "
        "tell. "
        f"Of M4 the hanging strip says: {m4.verdict} ({m4.number}).",
    ]


def _what_would_decide(d: Mapping[str, Any]) -> list[str]:
    one, four, noise = d["one_run"], d["four_tensions"], d["noise"]
    best = "; ".join(f"{a['words']}: {a['least']:.0f} sigma" for a in one["actions"][:SHOWN])
    return [
        f"Compared were: {'; '.join(d['explanations'])}. Each has the size at which 10 N/mm2 is as fast as 40 (from "
        "docs/open_question.md, which has further candidates).",
        f"The single measurement that decides among these is the record at {d['slack_N_per_mm2']:g} N/mm2 itself, in "
        f"numbers: points 1 and 4 over {d['length_m']:g} m tell every pair apart by at least "
        f"{one['least_measured']:.0f} sigma (all four tensions: {four['least_measured']:.0f}), the other explanation's "
        "size, the sensors' zero, and tension and yaw within their errors refitted; noise "
        f"{noise['white_mm']:g} mm, wander {noise['wander_mm']:g} mm, zero "
        f"{noise['zero_mm']:g} mm, tension {100 * noise['tension_relative']:g} %, yaw {noise['yaw_urad']:g} urad.",
        f"One further run adds most as: {best}.",
        f"This says nothing of explanations that are not among these. ({d['command']}, commit {d['commit'][:7]}.)",
    ]


def _reproducing(of: Mapping[str, Judgement]) -> list[str]:
    return [name for name, j in of.items() if j.verdict == REPRODUCED]


def _names(models: list[str]) -> str:
    return ", ".join(LOOKS[m].words for m in models) or "no model"
