"""Executed notebooks as sections of a page: the directive ``notebook`` (a Sphinx extension).

``python -m studies.site.notebooks [FILE ...]`` runs the notebooks of examples/ (or FILE) and stores them with results.
"""

import json
import re
import sys
import time
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.nodes import nested_parse_with_titles

from belt_sim.io import ROOT


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
            parts.append(re.sub(r"\A# .*\n*", "", source(cell)))
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


class Notebook(Directive):
    """``{notebook} FILE`` in a Markdown page: FILE, seen from the page, with the results that it holds."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The nodes of the notebook."""
        settings = self.state.document.settings
        path = Path(settings.env.srcdir) / self.arguments[0]
        settings.env.note_dependency(str(path))
        here = nodes.section()
        here.document = self.state.document
        nested_parse_with_titles(self.state, StringList(markdown(path).splitlines(), source=path.name), here)
        return here.children


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_directive("notebook", Notebook)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    import nbformat

    for file in [Path(a) for a in sys.argv[1:]] or sorted((ROOT / "examples").glob("*.ipynb")):
        began = time.perf_counter()
        nbformat.write(execute(file), file)
        print(f"{file.name}: {time.perf_counter() - began:.0f} s")
