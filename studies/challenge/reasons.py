"""Why an answer is not right, as far as the answer itself shows it."""

from collections.abc import Mapping
from typing import Any

CROWD = 3  # so many reasons are told


def reason(facts: Any, answer: Mapping[str, Any]) -> str:
    """Which hidden effect was held back by what, which false name got in with what, or the words of a crash.

    facts: studies.challenge.facts.Facts, outcome included.
    """
    if facts.outcome == "crash":
        return facts.sentence
    tried = {t["id"]: t for t in answer.get("ranking", [])}
    said = [held_back(name, tried.get(name)) for name in facts.hidden if name not in facts.named]
    said += [f"{name} at probability {sure:.2f}" for name, sure in facts.false_names.items()]
    if facts.kind in ("nothing", "below_noise") and not facts.named:
        said.append("what is left fails " + ", ".join(_failed(answer)) if _failed(answer) else facts.verdict)
    if facts.verdict == "cannot_say":
        said = [f"suspects {', '.join(facts.suspected) or 'damage'}"]
    return "; ".join(said[:CROWD])


def held_back(name: str, tried: Mapping[str, Any] | None) -> str:
    """What the ranking says of an effect that is hidden and was not named."""
    if tried is None:
        return f"{name} is no candidate"
    threshold = tried["threshold"]
    if threshold is None:
        return f"the readings cannot show {name}"
    if tried["gain"] <= threshold:
        return f"{name}: gain {tried['gain']:.1f} under its threshold {threshold:.1f}"
    return f"{name}: gain {tried['gain']:.1f} over {threshold:.1f}, {tried['note']}"


def _failed(answer: Mapping[str, Any]) -> list[str]:
    return [str(name) for name in (answer.get("open_set") or {}).get("failed", [])]
