"""Files that swell, nest or repeat are one line, soon and in little memory, whichever command reads them."""

import re
import zipfile

import openpyxl
import pytest

from belt_sim.effects.load import load_effects
from belt_sim.errors import BeltError, InputError
from belt_sim.importing import read
from belt_sim.io import careful_yaml

HEAD = "schema: belt-effects/1\neffects:\n"
DEEP = 20_000
ALIASES = "a: &a [x, x]\n" + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in zip("abcdefg", "bcdefgh", strict=True))
EFFECTS = {
    "nested": ("[" * DEEP + "]" * DEEP, "nest deeper"),
    "twice": (HEAD + "  - {id: taper, kappa_t: 2e-5, kappa_t: 3e-5}\n", ":3: kappa_t is stated twice"),
    "twice_at_the_top": (HEAD + "  - taper\neffects: []\n", "effects is stated twice"),
    "date": (HEAD + "  - {id: taper, kappa_t: 2001-99-99}\n", "effects.taper.kappa_t = 2001-99-99"),
    "aliases": (ALIASES, ":2: write the value out; anchors and aliases"),
    "no_text": ("\x00", "not readable as YAML"),
}


@pytest.mark.parametrize("name", EFFECTS)
def test_a_file_of_effects_is_read_with_care(name, tmp_path):
    text, says = EFFECTS[name]
    path = tmp_path / "effects.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(says)) as caught:
        load_effects(str(path))
    assert "\n" not in str(caught.value)


def test_numbers_and_words_stay_as_yaml_has_them():
    assert careful_yaml(b"a: [1, 2.5, true, null, 2024-05-12, x]", "f") == {
        "a": [1, 2.5, True, None, "2024-05-12", "x"]
    }


@pytest.fixture
def workbook(tmp_path):
    """Writes a workbook of 40 rows whose sheet was changed."""
    book = openpyxl.Workbook()
    for row in (["travel [m]", "edge 1 [mm]"], *([k, 0.1 * k] for k in range(40))):
        book.active.append(row)
    book.save(tmp_path / "good.xlsx")

    def write(change):
        with (
            zipfile.ZipFile(tmp_path / "good.xlsx") as good,
            zipfile.ZipFile(tmp_path / "bad.xlsx", "w", zipfile.ZIP_DEFLATED) as bad,
        ):
            for member in good.infolist():
                data = good.read(member)
                bad.writestr(member.filename, change(data) if member.filename.endswith("sheet1.xml") else data)
        return tmp_path / "bad.xlsx"

    return write


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(
    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
)
ROWS = b'<row r="1"><c r="A1"><v>1</v></c></row>'
SHEETS = {
    "cut": lambda data: data[: len(data) // 2],
    "overflow": lambda data: data.replace(b"<v>3.9</v>", b"<v>1e400</v>"),
    "entities": lambda data: (BOMB + "]>" + data.decode().replace("<v>1</v>", "<v>&j;</v>", 1)).encode(),
    "swollen": lambda data: data.replace(b"</sheetData>", ROWS * 6_000_000 + b"</sheetData>"),
}


@pytest.mark.parametrize("name", SHEETS)
def test_a_workbook_that_is_cut_or_swollen_is_refused_in_a_line(name, workbook):
    with pytest.raises(BeltError, match=r"is no Excel workbook|unpacks to") as caught:
        read([workbook(SHEETS[name])])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("header", ["[" * 40_000, "(" * 40_000 + "travel [m]"])
def test_a_header_of_forty_thousand_brackets_is_refused_at_once(header, tmp_path):
    (tmp_path / "a.csv").write_text(header + ";y1 [mm]\n" + "".join(f"{k};{0.1 * k}\n" for k in range(31)))
    with pytest.raises(BeltError, match="a column's name has 400"):
        read([tmp_path / "a.csv"])
