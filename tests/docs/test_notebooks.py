"""The notebooks of examples/ run from top to bottom, and print what they hold."""

import pytest
from pages import missing

from belt_sim.io import ROOT
from studies.site.notebooks import cells, execute, markdown, source

BOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


def printed(cell) -> str:
    """The text that a cell has given."""
    shown = [o for o in cell["outputs"] if o.get("name") != "stderr"]
    return "".join("".join(o.get("text", o.get("data", {}).get("text/plain", ""))) + "\n" for o in shown)


@pytest.mark.parametrize("book", BOOKS, ids=lambda b: b.stem)
def test_a_notebook_is_stored_with_its_results(book):
    code = [c for c in cells(book) if c["cell_type"] == "code"]
    assert all(o["output_type"] != "error" for c in code for o in c["outputs"])
    assert any(printed(c).strip() for c in code)
    for cell in code:
        compile(source(cell), book.name, "exec")
    title = source(cells(book)[0]).splitlines()[0]
    assert title.startswith("# ")
    assert not markdown(book).startswith("# ")
    page = (ROOT / "docs" / "notebooks.md").read_text(encoding="utf-8")
    assert f"\n#{title}\n" in page, "the page has the title, so that other pages can link to it"


@pytest.mark.long
@pytest.mark.parametrize("book", BOOKS, ids=lambda b: b.stem)
def test_a_notebook_runs_and_prints_what_it_holds(book):
    pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    fresh = execute(book)
    for stored, new in zip(cells(book), fresh["cells"], strict=True):
        if stored["cell_type"] == "code" and "KiB of PNG" not in printed(stored):
            assert not missing(printed(stored), printed(new)), source(stored)
