"""What people call columns, in English and German, and which places the words name."""

import re
import unicodedata

#: role -> words that name it, longest first in effect; matched against a name in lower case without marks
WORDS: dict[str, tuple[str, ...]] = {
    "yaw_head": ("yaw head", "head yaw", "yaw_head", "antriebstrommel winkel", "winkel antrieb", "winkel kopf"),
    "yaw": (
        "yaw",
        "steer",
        "steering",
        "schwenkwinkel",
        "schwenk",
        "lenkwinkel",
        "gierwinkel",
        "gier",
        "stellwinkel",
        "schraegstellung",
        "skew angle",
        "schraenkung",
        "tail angle",
        "winkel",
        "angle",
        "verstellung",
    ),
    "u_rate": ("u_rate", "u rate", "rate u", "unsicherheit", "uncertainty"),
    "direction": ("direction", "richtung", "drehrichtung", "laufrichtung", "fahrtrichtung"),
    "run": ("run", "lauf nr", "laufnummer", "lauf", "versuch", "messung", "fahrt", "test", "trial", "experiment"),
    "speed": ("speed", "velocity", "geschwindigkeit", "bandgeschwindigkeit", "v band", "v belt", "geschw", "v"),
    "travel": (
        "travel",
        "belt travel",
        "bandweg",
        "laufweg",
        "weg",
        "distance",
        "strecke",
        "fahrweg",
        "laufstrecke",
        "encoder",
        "drehgeber",
        "s",
        "x",
    ),
    "time": ("time", "zeit", "timestamp", "zeitstempel", "uhrzeit", "datum", "date", "t", "clock", "sekunden"),
    "tension": (
        "tension",
        "bandzug",
        "bandspannung",
        "zugspannung",
        "zugkraft",
        "spannung",
        "bandkraft",
        "stress",
        "sigma",
        "kraft",
        "force",
        "zug",
        "load cell",
    ),
    "signal": (
        "kante",
        "bandkante",
        "edge",
        "lateral",
        "querlage",
        "querablage",
        "bandlage",
        "ablage",
        "versatz",
        "auswanderung",
        "wander",
        "displacement",
        "position",
        "quer",
        "tilt",
        "roll",
        "neigung",
        "kippwinkel",
        "rollwinkel",
        "verkippung",
        "laser",
        "sensor",
        "y",
    ),
}
TILT = ("tilt", "roll", "neigung", "kipp", "verkippung")
TAIL = ("tail", "umlenk", "heck", "spann", "hinten", "return", "unwind")
HEAD = ("head", "antrieb", "kopf", "drive", "vorn")
UPPER = ("upper", "top", "ober", "oben", "carry")
LOWER = ("lower", "bottom", "unter", "unten", "return strand")
_NUMBERED = re.compile(
    r"^(?:y|kante|edge|bandkante|lateral|pos|position|point|punkt|ablage|sensor|laser|p)[ _]*([1-4])\b"
)
_RATE = re.compile(r"^(?:rate|drift|driftrate|laufrate)[ _]*([1-4])?$")


def plain(name: str) -> str:
    """A name in lower case, umlauts written out, everything but letters and digits as blanks."""
    name = name.lower()
    for mark, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss")):
        name = name.replace(mark, letters)
    name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return " ".join(re.sub(r"[^a-z0-9]+", " ", name).split())


def role_named(name: str) -> str:
    """The role that a column's name speaks of; "" where it says nothing."""
    words = plain(name)
    rate = _RATE.match(words)
    if rate:
        return f"rate{rate.group(1) or 1}"
    if _NUMBERED.match(words) or re.fullmatch(r"y[ _]?\w?", words):
        return "signal"
    best = ("", 0)
    for role, names in WORDS.items():
        for known in names:
            known = plain(known)
            whole = re.search(rf"(?:^| ){re.escape(known)}(?: |\d|$)", words)
            within = len(known) > 4 and known in words
            if (whole or within) and len(known) > best[1]:
                best = (role, len(known))
    return best[0]


def place_named(name: str) -> str:
    """The place that a signal's name speaks of; "" where it says none, or not enough."""
    words = plain(name)
    upper, lower = (any(w in words for w in names) for names in (UPPER, LOWER))
    if any(w in words for w in TILT):
        return "lower_mid_span" if lower else "upper_mid_span"
    numbered = _NUMBERED.match(words)
    if numbered:
        return f"point_{numbered.group(1)}"
    tail, head = (any(w in words for w in names) for names in (TAIL, HEAD))
    if tail != head and upper != lower:
        return {(True, True): "point_1", (True, False): "point_2", (False, False): "point_3", (False, True): "point_4"}[
            (tail, upper)
        ]
    return ""


_STATED = {
    "tension": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(?:N_?(?:/|p|per)?_?mm-?[2²]|MPa)", re.IGNORECASE),
    "yaw": re.compile(r"([+-]?(?<![\d.,])\d+(?:[.,]\d+)?) ?_?(mrad|urad|deg|grad|°)", re.IGNORECASE),
    "speed": re.compile(r"(\d+(?:[.,]\d+)?) ?_?(m_?(?:/|p|per)_?s|m_?(?:/|p|per)_?min)(?![a-z0-9])", re.IGNORECASE),
}


def settings_in(name: str) -> dict[str, str]:
    """Settings that the name of a file or run states: ``lauf3_10Nmm2_-0,042grad`` -> tension and yaw, with units."""
    found = {}
    for key, pattern in _STATED.items():
        seen = pattern.search(name)
        if seen:
            number = seen.group(1).replace(",", ".")
            units = {"tension": "N/mm2", "yaw": "deg", "speed": "m/s"}
            unit = units[key]
            if key == "yaw" and seen.group(2).lower() in ("mrad", "urad"):
                unit = seen.group(2).lower()
            if key == "speed" and "min" in seen.group(2).lower():
                unit = "m/min"
            found[key] = f"{number} {unit}"
    return found
