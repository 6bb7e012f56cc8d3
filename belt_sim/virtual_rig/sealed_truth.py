"""The truth of a campaign, sealed: its hash is known before anybody answers, and read only afterwards."""

import base64
import binascii
import hashlib
import json
import os
import secrets
import zlib
from dataclasses import asdict, dataclass, field
from pathlib import Path

from belt_sim.campaign import Campaign, write_campaign
from belt_sim.errors import InputError

#: Fields that a truth sealed before does not have; left out where they say nothing.
_SINCE = ("plan", "place", "variable", "form", "also")
SEALED, HASH = "truth.sealed", "truth.sha256"


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What was hidden. All values in SI.

    base: the law that the campaign is meant to be diagnosed with (beam_th2 or strip); kind: stated, nothing, library,
    two, outside, below_noise or dirty; effects: [{"id", "parameters", "d"}], d the size in noise units (None when not
    measured); lookalikes: other single effects of the library that reproduce the same change up to 3 noise units (and
    half its size); distance: what the best single effect leaves over, or the best three when something outside the
    library is hidden; noise: true scale and tails, and length and smoothness of a wander that is not as stated;
    machine, settings: true minus stated; dirty: what was done to the data; plan: its kind and number; place, variable,
    form, also: what the unknown is (``UnmodelledFault``).
    """

    seed: int
    base: str
    kind: str
    effects: list[dict] = field(default_factory=list)
    lookalikes: list[str] = field(default_factory=list)
    distance: float | None = None
    noise: dict = field(default_factory=dict)
    machine: dict[str, float] = field(default_factory=dict)
    settings: dict[str, list[float]] = field(default_factory=dict)
    dirty: dict | None = None
    salt: str = ""
    plan: str = ""
    place: str = ""
    variable: str = ""
    form: str = ""
    also: list[list[str]] = field(default_factory=list)

    def text(self) -> str:
        """Canonical JSON, salt included."""
        said = {n: v for n, v in asdict(self).items() if v or n not in _SINCE}
        return json.dumps(said, sort_keys=True, allow_nan=False)

    def sha256(self) -> str:
        """SHA-256 of the canonical JSON."""
        return hashlib.sha256(self.text().encode()).hexdigest()


def seal(truth: Truth, folder: Path) -> str:
    """Write truth.sealed and truth.sha256 into a campaign folder; returns the hash. Hidden, not encrypted."""
    packed = base64.b64encode(zlib.compress(truth.text().encode(), 9)).decode()
    wrapped = "\n".join(packed[k : k + 76] for k in range(0, len(packed), 76))
    _write_text(folder / SEALED, wrapped + "\n")
    _write_text(folder / HASH, f"{truth.sha256()}  {SEALED}\n")
    return truth.sha256()


def reveal(folder: str | Path) -> Truth:
    """Open a sealed truth; raises InputError when a file is missing or the truth is not the published one."""
    folder = Path(folder)
    published, packed = (_read_text(folder / name) for name in (HASH, SEALED))
    try:
        truth = Truth(**json.loads(zlib.decompress(base64.b64decode(packed))))
        found = truth.sha256()
    except (binascii.Error, zlib.error, ValueError, TypeError, RecursionError):
        raise InputError(SEALED, folder, "", "is damaged; make the campaign anew") from None
    if published.split()[:1] != [found]:
        remedy = "the truth was changed after it was sealed (or the published hash was); do not trust it"
        raise InputError("SHA-256 of the truth", found, "", f"does not match {HASH}: {remedy}")
    return truth


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii")
    except FileNotFoundError:
        raise InputError("campaign", path.parent, "", f"has no {path.name}: nothing to reveal") from None
    except (OSError, UnicodeDecodeError):
        raise InputError("campaign", path, "", "cannot be read; make the campaign anew") from None


def _write_text(path: Path, text: str) -> None:
    fresh = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    fresh.write_text(text, encoding="ascii", newline="\n")
    os.replace(fresh, path)


def write_blind(out: str | Path, campaign: Campaign, truth: Truth, *, overwrite: bool = False) -> str:
    """Write a campaign with its sealed truth into ``out``; returns the SHA-256 to publish."""
    write_campaign(campaign, out, overwrite=overwrite)
    return seal(truth, Path(out))
