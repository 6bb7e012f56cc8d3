"""belt-sim new-effect NAME: a file with a whole effect, to be changed into one of your own."""

import re
from pathlib import Path

from belt_sim.errors import InputError
from belt_sim.files import write_text
from belt_sim.paths import MODELS


def new_effect(name: str, folder: Path = Path()) -> Path:
    """Write NAME.py, the side wind of models/effects under another name, and return its path."""
    from belt_sim.effects.library import library

    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError("NAME", name, "", "use lower-case letters, digits and _, as in side_wind")
    path = folder / f"{name}.py"
    if name in library() or path.exists():
        raise InputError("NAME", name, "", "there is an effect or a file of that name; choose another")
    text = (MODELS / "effects" / "wind.py").read_text(encoding="utf-8")
    text = text.replace("class Wind(", f"class {name.title().replace('_', '')}(").replace(
        'id = "wind"', f'id = "{name}"'
    )
    return write_text(path, text.replace("An effect of one's own: a steady side wind", "A steady side wind"))
