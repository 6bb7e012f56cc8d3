"""Executed notebooks as sections of a page of the site (a Sphinx extension).

``python -m studies.site.notebooks [FILE ...]`` runs the notebooks of examples/ (or FILE), stores them with results, and
writes what they show into docs/notebooks.md.
"""

import json
import re
import sys
import time
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from belt_sim.io import ROOT
from studies.application import show_help

PAGE = ROOT / "docs" / "notebooks.md"
_WRITTEN = re.compile(r"(<!-- written: (\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def cells(path: Path) -> list[dict[str, Any]]:
    """The cells of a notebook file."""
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def source(cell: dict[str, Any]) -> str:
    """The text of a cell."""
    return "".join(cell["source"])


def markdown(path: Path) -> str:
    """A notebook as Markdown, code and printed text in fences, pictures inside; its title is that of the page."""
    parts = []
    for cell in cells(path):
        if cell["cell_type"] == "markdown":
            parts.append(re.sub(r"^#", "##", re.sub(r"\A# .*\n*", "", source(cell)), flags=re.MULTILINE))
        else:
            parts.append(f"```python\n{source(cell)}\n```")
            for output in cell["outputs"]:
                data = output.get("data", {})
                if "image/png" in data:
                    png = "".join(data["image/png"]).replace("\n", "")
                    picture = f'<img alt="picture of the cell above" src="data:image/png;base64,{png}">'
                    parts.append(f"```{{raw}} html\n{picture}\n```")
                elif text := "".join(data.get("text/plain", output.get("text", ""))).rstrip():
                    parts.append(f"```text\n{text}\n```")
    return "\n\n".join(parts) + "\n"


def execute(path: Path) -> Any:
    """The notebook of a file with fresh results; raises CellExecutionError where a cell does."""
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(path, as_version=4)
    book.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    NotebookClient(book, timeout=600, resources={"metadata": {"path": str(path.parent)}}).execute()
    for cell in book.cells:
        cell.metadata.pop("execution", None)  # when it ran, which changes each time
        if cell.cell_type == "code":  # progress is for who waits
            cell.outputs = [
                o for o in cell.outputs if not (o.output_type == "display_data" and "image/png" not in o.data)
            ]
    return book


def written() -> str:
    """The page with what each notebook shows, and where it is."""
    lines = {}
    for path in (ROOT / "examples").glob("*.ipynb"):
        about = " ".join(source(cells(path)[0]).split("\n\n")[1].split())
        lines[path.stem] = f"{about} [{path.name}](../examples/{path.name}) has the results."
    return _WRITTEN.sub(lambda found: f"{found[1]}{lines[found[2]]}\n{found[4]}", PAGE.read_text(encoding="utf-8"))


def _put_in(app: Sphinx, docname: str, text: list[str]) -> None:
    """On the site, the notebooks stand in the page."""
    if docname == PAGE.stem:
        for path in (ROOT / "examples").glob("*.ipynb"):
            app.env.note_dependency(str(path))
        whole = lambda found: markdown(ROOT / "examples" / f"{found[2]}.ipynb")  # noqa: E731
        text[0] = _WRITTEN.sub(whole, text[0])


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("source-read", _put_in)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    show_help(__doc__)
    import nbformat

    for file in [Path(a) for a in sys.argv[1:]] or sorted((ROOT / "examples").glob("*.ipynb")):
        began = time.perf_counter()
        nbformat.write(execute(file), file)
        print(f"{file.name}: {time.perf_counter() - began:.0f} s")
    PAGE.write_text(written(), encoding="utf-8")
