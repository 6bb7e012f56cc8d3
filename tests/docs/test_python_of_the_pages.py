"""The Python of the pages: lines with prompts say what the page says that they say, marked blocks run, all compile."""

import doctest

import pytest
from pages import PAGES, missing, name, python

from belt_sim.io import ROOT

BLOCKS = [b for page in PAGES for b in python(page)]


class Said(doctest.OutputChecker):
    """What is printed, line by line, but for a unit in the last place of a number."""

    def check_output(self, want: str, got: str, optionflags: int) -> bool:
        """Whether ``got`` is what the page has."""
        return super().check_output(want, got, optionflags) or bool(want and not missing(want, got))


@pytest.mark.parametrize("block", BLOCKS, ids=str)
def test_it_is_python(block):
    if block.prompted:
        assert doctest.DocTestParser().get_examples(block.code)
    else:
        compile(block.code, str(block), "exec")


def run_page(page, marks, place, monkeypatch) -> None:
    """Run the blocks of a page one after another, with common names, in a folder that looks like the checkout."""
    for there in ("models", "docs", "conf"):
        (place / there).symlink_to(ROOT / there)
    monkeypatch.chdir(place)
    names: dict = {"__name__": "__page__"}
    runner = doctest.DocTestRunner(checker=Said(), verbose=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    for block in python(page):
        if block.prompted and (block.marked or "run") in marks:
            test = doctest.DocTestParser().get_doctest(block.code, names, str(block), name(page), 0)
            runner.run(test, out=said.append, clear_globs=False)
            names = test.globs
        elif block.marked in marks:
            exec(compile(block.code, str(block), "exec"), names)
    assert not said, "".join(said)


def with_mark(mark: str):
    """Pages that have a block marked so; blocks with prompts are quick unless marked."""
    there = [p for p in PAGES if any((b.marked or ("run" if b.prompted else "")) == mark for b in python(p))]
    return [pytest.param(p, id=name(p)) for p in there]


@pytest.mark.parametrize("page", with_mark("run"))
def test_lines_say_what_the_page_says(page, tmp_path, monkeypatch):
    run_page(page, ("run",), tmp_path, monkeypatch)


@pytest.mark.long
@pytest.mark.parametrize("page", with_mark("run: long"))
def test_long_lines_say_what_the_page_says(page, tmp_path, monkeypatch):
    run_page(page, ("run", "run: long"), tmp_path, monkeypatch)
