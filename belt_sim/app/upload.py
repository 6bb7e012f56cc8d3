"""Sort uploaded files into campaigns, effects and logger files; anything else is refused in one line.

A file is known by its last name only, so that no path in a name or in a zip leads anywhere else; nothing is unpacked
but the files of a campaign, and no more of them than ``MAX_UPLOAD``.
"""

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import Any

from belt_sim.campaign.folder import FILES
from belt_sim.campaign.marked_yaml import parse
from belt_sim.campaign.problems import CampaignError, Problem, quote
from belt_sim.campaign.sheet import FILE as SHEET
from belt_sim.effects.generic_law import ID as LAW
from belt_sim.effects.library import library
from belt_sim.effects.load import entries_of, load_effects, split_entry
from belt_sim.errors import BeltError, InputError
from belt_sim.importing.mapping import FILE as MAPPING
from belt_sim.si import plain_minus

MEBI = 2**20
MAX_UPLOAD = 256 * MEBI  # bytes of one request
TOO_LARGE = (
    f"at most {MAX_UPLOAD // MEBI} MB at a time; drop fewer at once, or give them to belt-sim import in a terminal"
)
MOST_MEMBERS = 2000  # of a zip
LOGGERS = (".csv", ".tsv", ".txt", ".dat", ".asc", ".xlsx")
LONGEST_NAME = 120  # characters


@dataclass
class Tray:
    """Dropped files sorted: of a campaign, of a logger, effects and a mapping (name, bytes); messages: what not."""

    campaign: dict[str, bytes] = field(default_factory=dict)
    loggers: dict[str, bytes] = field(default_factory=dict)
    effects: tuple[str, bytes] | None = None
    mapping: tuple[str, bytes] | None = None
    messages: list[str] = field(default_factory=list)


def sort_files(dropped: Sequence[tuple[str, bytes]]) -> Tray:
    """Sort files by their names; every one that cannot be used has its line."""
    tray = Tray()
    for name, data in dropped:
        last = last_name(name)
        known = last.lower()
        try:
            if known in FILES or known.endswith(".zip"):
                found = {known: data} if known in FILES else unpack(last, data)
                for file in found.keys() & tray.campaign.keys():
                    remedy = f"{file} was dropped twice, the first is kept; drop one campaign at a time"
                    raise InputError("file", quote(name), "", remedy)
                tray.campaign |= found
            elif known == MAPPING or known.endswith((".yaml", ".yml")):
                kind = "mapping" if known == MAPPING else "effects"
                if (before := getattr(tray, kind)) is not None:
                    remedy = f"a second file of {kind} beside {quote(before[0])}, which is kept; drop one of them"
                    raise InputError("file", quote(name), "", remedy)
                setattr(tray, kind, (last, data))
            elif known.endswith(LOGGERS):
                kept = safe(last)
                stem, _, end = kept.rpartition(".")
                taken = {file.lower() for file in tray.loggers}
                kept = next(n for k in count(1) if (n := kept if k == 1 else f"{stem}_{k}.{end}").lower() not in taken)
                if kept != safe(last):
                    tray.messages.append(f"{quote(name)}: another file has this name; this one is kept as {kept}")
                tray.loggers[kept] = data
            elif known.endswith(".py"):
                raise InputError("file", quote(last), "", NO_CODE)
            else:
                wanted = f"{', '.join(FILES)}, a zip of them, a logger's CSV or xlsx, or an effects.yaml"
                raise InputError("file", quote(last), "", f"drop {wanted}")
        except BeltError as error:
            tray.messages.append(str(error))
    return tray


def last_name(name: str) -> str:
    """The last part of a name, whatever system it came from."""
    return name.replace("\\", "/").rstrip("/").rsplit("/", 1)[-1]


def safe(name: str) -> str:
    """A last name as a file can bear it: what it says of a run stays, what is no letter, digit or mark goes."""
    kept = "".join(c if c.isalnum() or c in " _-+.,()" else "_" for c in plain_minus(name)).lstrip(".")
    stem, _, end = kept.rpartition(".")
    return f"{stem[-LONGEST_NAME:] or '_'}.{end}"


def unpack(name: str, data: bytes) -> dict[str, bytes]:
    """The files of the one campaign in a zip: those that lie beside its campaign.yaml."""
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            members = [m for m in archive.infolist() if not m.is_dir()]
            if len(members) > MOST_MEMBERS:
                raise InputError("zip", quote(name), "", f"holds more than {MOST_MEMBERS} files; zip one campaign")
            sheets = [m for m in members if last_name(m.filename) == SHEET and "__MACOSX" not in m.filename]
            if len(sheets) != 1:
                many = f"holds {len(sheets)} campaigns" if sheets else f"holds no {SHEET}"
                raise InputError("zip", quote(name), "", f"{many}; zip the folder of one campaign")
            beside = sheets[0].filename.removesuffix(SHEET)
            return dict(_members(archive, name, {f"{beside}{file}": file for file in FILES}))
    except (zipfile.BadZipFile, RuntimeError, NotImplementedError, OSError, EOFError) as error:
        raise InputError("zip", quote(name), "", f"cannot be unpacked ({error}); zip it again") from error


def _members(archive: zipfile.ZipFile, name: str, wanted: Mapping[str, str]) -> Iterator[tuple[str, bytes]]:
    """Wanted members and their bytes, up to ``MAX_UPLOAD`` in all, whatever the zip says of itself."""
    room = MAX_UPLOAD
    for member in archive.namelist():
        if member not in wanted:
            continue
        pieces = []
        with archive.open(member) as stream:
            while piece := stream.read(MEBI):
                room -= len(piece)
                if room < 0:
                    remedy = f"unpacks to more than {MAX_UPLOAD // MEBI} MB; thin the signals out"
                    raise InputError("zip", quote(name), "", remedy)
                pieces.append(piece)
        yield wanted[member], b"".join(pieces)


def write_files(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write files into ``folder``, by their last names."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (folder / safe(last_name(name))).write_bytes(data)
    return folder


LARGEST_EFFECTS = 64 * 1024  # bytes; all effects at once have a tenth of it
NO_CODE = "code is not run from this page; name it on the command line: belt-sim diagnose effects=[my_effect.py]"


def read_effects(name: str, data: bytes) -> list[dict[str, Any]]:
    """Effects as [{id: taper, kappa_t: 2e-5}]; raises InputError, CampaignError for what is not of the library."""
    if len(data) > LARGEST_EFFECTS:
        raise InputError("effects", name, "", f"must be at most {LARGEST_EFFECTS // 1024} kB; is this an effects.yaml?")
    problems: list[Problem] = []
    parse(data.decode("utf-8-sig", errors="replace"), name, problems)  # syntax, anchors, aliases
    if problems:
        raise CampaignError(problems[:1])
    found = []
    for entry in entries_of(data, name):
        effect, numbers = split_entry(entry)
        if effect != LAW and effect not in library():
            remedy = NO_CODE if effect.endswith(".py") else f"use one of {', '.join(library())}"
            raise InputError("effects", quote(effect), "", remedy)
        found.append({"id": effect} | numbers)
    load_effects(found)  # names and numbers
    return found
