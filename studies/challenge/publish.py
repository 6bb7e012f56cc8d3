"""What is published of challenges: a small file of facts each, and one document with pictures made of all of them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from belt_sim.files import write_text
from studies.challenge.document import write_document
from studies.challenge.published import as_text, read_published


def publish(results: Sequence[Mapping[str, Any]], top: Path, stored: Path, drawn: Sequence[int] = ()) -> Path:
    """Write ``stored``/NAME.json from results, and ``top``/how_often_right.md with pictures from all such files.

    NAME is the source, its first seed and who answered: new results take the place of those of the same campaigns, and
    stand beside others, which are deleted by hand. drawn: seeds of all campaigns that were sealed, so that those
    without an answer are told. Returns the document's path.
    """
    if results:
        first = min([r["seed"] for r in results] + list(drawn))
        name = f"{results[0]['source']}_{first}_{results[0]['ablation']}".replace(":", "_")
        write_text(stored / f"{name}.json", as_text(results, drawn))
    return write_document(top, read_published(stored))
