"""The settings of the commands on docs/command_line.md, out of conf/: ``python -m studies.site.settings_page``."""

import re

from belt_sim.io import ROOT
from studies.application import show_help

PAGE = ROOT / "docs" / "command_line.md"


def written() -> str:
    """The page with each file of conf that it names, without what Hydra alone reads."""

    def fenced(found: re.Match[str]) -> str:
        text = (ROOT / found[1]).read_text(encoding="utf-8").split("  - _self_\n")[-1].split("\nhydra:\n")[0]
        return f"<!-- written: {found[1]} -->\n```yaml\n{text.strip()}\n```\n<!-- end -->"

    pattern = r"<!-- written: (\S+) -->\n.*?<!-- end -->"
    return re.sub(pattern, fenced, PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)


if __name__ == "__main__":
    show_help(__doc__)
    PAGE.write_text(written(), encoding="utf-8")
