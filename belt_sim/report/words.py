"""What a diagnosis says, in plain sentences and rounded numbers."""

import math
from collections.abc import Mapping, Sequence

HEADLINES = {
    "adequate": "Nothing is missing",
    "explained": "Explained",
    "partly": "Explained in part",
    "none_known": "Something unknown is missing",
    "cannot_say": "This campaign cannot say",
}
#: Verdicts after which the final model still fails, so that its fitted values are no physical constants.
REJECTED = ("partly", "none_known", "cannot_say")


def number(value: float | None, digits: int = 3) -> str:
    """A number to ``digits`` significant digits; a dash when there is none."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{decimals}f}".replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·{_power(int(exponent))}".replace("-", "−")


def millimetres(value: float | None) -> str:
    """A length in mm as a rig's people read it: hundredths, and below 0.1 mm two digits."""
    if not isinstance(value, int | float) or not math.isfinite(value):
        return "–"
    return f"{value:.2f}".replace("-", "−") if abs(value) >= 0.1 or value == 0.0 else number(value, 2)


def plain(value: float | None) -> str:
    """A number as somebody set it, without digits that say nothing."""
    return f"{value:g}".replace("-", "−") if isinstance(value, int | float) and math.isfinite(value) else "–"


def _power(exponent: int) -> str:
    """10 to this power."""
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def with_u(value: float | None, u: float | None, unit: str = "") -> str:
    """value ± u (one sigma) to two digits of u, with the unit; both share a power of ten."""
    unit = "" if unit in ("", "1") else f" {unit}"
    if not isinstance(value, int | float) or not math.isfinite(value):
        return "–"
    if not isinstance(u, int | float) or not math.isfinite(u) or u <= 0.0:
        return number(value) + unit
    top = max(abs(value), u)
    power = 0 if 1e-3 <= top < 1e5 else math.floor(math.log10(top))
    decimals = max(0, 1 - math.floor(math.log10(u / 10.0**power)))
    core = f"{value / 10.0**power:.{decimals}f} ± {u / 10.0**power:.{decimals}f}"
    core = f"({core})·{_power(power)}" if power else core
    return core.replace("-", "−") + unit


def listed(names: Sequence[str]) -> str:
    """a, b and c."""
    names = list(names)
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1] if names else "nothing"


def error_sentence(error: Mapping) -> str:
    """How the error fell, and how far down it can go; empty when the diagnosis does not say."""
    where = "held_out" if error.get("held_out") else "fit"
    pair = error.get(where) or {}
    if pair.get("before_mm") is None or pair.get("after_mm") is None:
        return ""
    name = "on conditions held out" if where == "held_out" else "on the runs fitted"
    floor = error.get("noise_floor_mm")
    tail = f"; the noise floor is {millimetres(floor)} mm" if floor is not None else ""
    before, after = millimetres(pair["before_mm"]), millimetres(pair["after_mm"])
    return f"The error {name} falls from {before} mm to {after} mm{tail}."


def verdict_sentence(diagnosis: Mapping) -> str:
    """The verdict as a person would say it; the diagnosis' own ``sentence`` if it brings one."""
    if diagnosis.get("sentence"):
        return str(diagnosis["sentence"])
    base, error = diagnosis.get("base_model", "the model"), error_sentence(diagnosis.get("error") or {})
    effects = listed([e["id"] for e in diagnosis.get("effects") or []])
    unknown = diagnosis.get("unknown") or {}
    nearest = f" The nearest known effect is {unknown['nearest']}." if unknown.get("nearest") else ""
    said = {
        "adequate": f"{base} agrees with this campaign to within its noise: no effect needs to be added.",
        "explained": f"{base} lacks {effects}. {error}",
        "partly": f"{base} lacks {effects}, and something that no known effect explains. {error}{nearest}",
        "none_known": f"{base} disagrees with this campaign, and no known effect explains how.{nearest}",
        "cannot_say": "The data do not single out one cause; see which run would.",
    }
    verdict = str(diagnosis.get("verdict", "cannot_say"))
    return said.get(verdict, f"Verdict: {verdict}.").strip()


def rows(table: Mapping | None, prefix: str = "") -> list[tuple[str, str]]:
    """A nested dictionary as (name, text) rows, for what has no layout of its own."""
    out: list[tuple[str, str]] = []
    for key, value in (table or {}).items():
        name = f"{prefix}{str(key).replace('_', ' ')}"
        if isinstance(value, Mapping):
            out += rows(value, f"{name} · ")
        elif isinstance(value, float):
            out.append((name, number(value, 4)))
        elif isinstance(value, list | tuple):
            out.append((name, ", ".join(number(v, 4) if isinstance(v, float) else str(v) for v in value)))
        else:
            out.append((name, str(value)))
    return out
