"""In which encoding a file is written, and whether it is a text at all."""

import codecs
from pathlib import Path

from belt_sim.campaign.problems import CampaignError, Problem

#: Bytes looked at to tell what a file is.
HEAD = 1 << 16
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: first bytes -> what the file is, and what to do
_KNOWN = (
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls); save it as .xlsx or CSV"),
    (b"\x1f\x8b", "compressed (gzip); unpack it first"),
    (b"7z\xbc\xaf", "compressed (7z); unpack it first"),
    (b"%PDF", "a PDF; export the table as CSV"),
    (b"\x89PNG", "a picture; digitise its curves and give their table"),
    (b"\xff\xd8\xff", "a picture; digitise its curves and give their table"),
    (b"PAR1", "a Parquet file; export it as CSV"),
    (b"\x89HDF", "an HDF5 file; export the table as CSV"),
    (b"MATLAB 5.0", "a MATLAB file; export the table as CSV"),
    (b"TDSm", "a TDMS file; export the table as CSV or xlsx"),
)


def refuse(file: Path, remedy: str, **more) -> CampaignError:
    """The error of one thing that is wrong with a file."""
    return CampaignError([Problem(file=str(file), remedy=remedy, **more)])


def head_of(file: Path) -> bytes:
    """The first bytes of a file that is there and not empty; raises CampaignError otherwise."""
    try:
        if not file.is_file():
            what = "is a folder; name the files in it" if file.is_dir() else "there is no such file; check its path"
            raise refuse(file, what)
        with file.open("rb") as stream:
            head = stream.read(HEAD)
    except (OSError, ValueError) as error:
        cause = getattr(error, "strerror", None) or error
        raise refuse(file, f"cannot be read ({cause}); give a file that can") from None
    if not head.strip(b"\0\xef\xbb\xbf\xff\xfe \t\r\n"):
        raise refuse(file, "is empty; export the log again")
    return head


def is_workbook(head: bytes) -> bool:
    """Whether the bytes begin a zip archive, as xlsx files are."""
    return head.startswith(b"PK\x03\x04")


def encoding_of(file: Path, head: bytes) -> str:
    """The encoding of a text file by its mark or its first bytes; raises CampaignError for what is no text.

    utf-8 is a guess that the whole file must confirm; where it does not, it is cp1252, what Windows writes.
    """
    for magic, what in _KNOWN:
        if head.startswith(magic):
            raise refuse(file, f"is {what}")
    for mark, name in _MARKS:
        if head.startswith(mark):
            return name
    even, odd = head[0::2].count(0), head[1::2].count(0)
    if even + odd:
        half = len(head) / 2.0
        if odd > 0.6 * half and even < 0.05 * half:
            return "utf-16-le"
        if even > 0.6 * half and odd < 0.05 * half:
            return "utf-16-be"
        line = head[: head.index(0)].count(b"\n") + 1
        raise refuse(file, "holds binary data; export the log as CSV, TSV or xlsx", line=line)
    control = sum(head.count(bytes([k])) for k in range(32) if k not in (7, 9, 10, 11, 12, 13, 26, 27))
    if control > 0.01 * len(head):
        raise refuse(file, "holds binary data; export the log as CSV, TSV or xlsx")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"
