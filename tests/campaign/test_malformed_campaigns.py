"""No folder, however damaged, gives anything but a campaign or a CampaignError in one-line problems."""

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from sample_campaign import RUNS, SHEET, SIGNALS, STEADY, Folder

from belt_sim.campaign import Campaign, CampaignError, read_campaign, suspicions

#: Enough to meet every branch many times; about four seconds for the module.
EXAMPLES = 120
TEXTS = {"campaign.yaml": SHEET, "runs.csv": RUNS, "signals.csv": SIGNALS, "steady.csv": STEADY}
FILES = st.sampled_from(sorted(TEXTS))
#: Text that YAML, CSV and number parsers stumble over.
NASTY = st.sampled_from(
    [
        *("", ",", "\n", "\r", '"', "'", "{", "}", "[", "]", "#", "\t", "|", ">", "é", "١"),
        *(
            "&a",
            "*a",
            "<<: ",
            "? ",
            ": ",
            "- ",
            "!!python/object:x ",
            "!!float ",
            "%YAML 9",
            "---\n",
            "...\n",
        ),
        *("nan", "inf", "-1e400", "1e-400", "0x1f", "1_0", "9" * 400, "null", "~", "true"),
        *("\u2028", "\x00", "\x1b", "\ufeff", '"\\ud800"', '"\\UFFFFFFFF"'),
    ]
)
PIECES = NASTY | st.text(max_size=8) | st.floats().map(repr) | st.integers().map(str)


def assert_campaign_or_problems(files: dict[str, bytes]) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Folder(Path(place) / "c")
        for name in TEXTS:
            (folder.path / name).unlink()
        for name, content in files.items():
            folder.write(name, content)
        found = read_or_error(folder.path)
    if isinstance(found, CampaignError):
        assert found.problems
        for problem in found.problems:
            assert str(problem).isprintable()
            assert problem.remedy
    else:
        assert found.runs
        assert all(s.sentence for s in suspicions(found))


def read_or_error(path: Path) -> Campaign | CampaignError:
    try:
        return read_campaign(path)
    except CampaignError as error:
        return error


def encoded(texts: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode("utf-8", "surrogatepass") for name, text in texts.items()}


@settings(max_examples=EXAMPLES, deadline=None)
@given(edits=st.lists(st.tuples(FILES, st.floats(0, 1), st.integers(0, 30), PIECES), min_size=1, max_size=4))
def test_edited_text(edits):
    texts = dict(TEXTS)
    for name, place, removed, piece in edits:
        at = int(place * len(texts[name]))
        texts[name] = texts[name][:at] + piece + texts[name][at + removed :]
    assert_campaign_or_problems(encoded(texts))


@settings(max_examples=EXAMPLES, deadline=None)
@given(edits=st.lists(st.tuples(FILES, st.integers(0, 60), PIECES), min_size=1, max_size=4))
def test_replaced_cells_and_values(edits):
    texts = dict(TEXTS)
    for name, which, piece in edits:
        separators = ":,{}\n" if name.endswith("yaml") else ",\n"
        text = texts[name]
        cuts = [-1, *(k for k, c in enumerate(text) if c in separators), len(text)]
        k = which % (len(cuts) - 1)
        texts[name] = text[: cuts[k] + 1] + piece + text[cuts[k + 1] :]
    assert_campaign_or_problems(encoded(texts))


def test_an_escape_of_no_character_is_refused():
    sheet = SHEET.replace("title: ", 'title: "\\UFFFFFFFF" ', 1)
    assert sheet != SHEET
    assert_campaign_or_problems(encoded(TEXTS | {"campaign.yaml": sheet}))


@settings(max_examples=EXAMPLES // 2, deadline=None)
@given(name=FILES, place=st.floats(0, 1), length=st.integers(0, 40), noise=st.binary(max_size=40))
def test_mutated_bytes(name, place, length, noise):
    files = encoded(TEXTS)
    at = int(place * len(files[name]))
    files[name] = files[name][:at] + noise + files[name][at + length :]
    assert_campaign_or_problems(files)


@settings(max_examples=EXAMPLES // 6, deadline=None)
@given(kept=st.sets(FILES), swapped=st.permutations(sorted(TEXTS)), swap=st.booleans())
def test_deleted_and_exchanged_files(kept, swapped, swap):
    names = dict(zip(sorted(TEXTS), swapped, strict=True)) if swap else {name: name for name in TEXTS}
    assert_campaign_or_problems(encoded({name: TEXTS[names[name]] for name in sorted(kept)}))
