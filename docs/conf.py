"""Sphinx: how docs/ becomes a site. ``make docs`` builds it; warnings are errors, and no network is asked."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

project = "belt_sim"
author = "the belt_sim developers"
copyright = "Apache-2.0"
version = release = "0.2.0"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "studies.site.mathml",
    "studies.site.offline",
    "studies.site.notebooks",
    "studies.site.reference",
]
exclude_patterns = ["data", "maps"]
smartquotes = False
html_math_renderer = "mathml"
html_theme = "furo"
html_title = "belt_sim"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
html_use_index = False

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

nitpicky = True
#: types of other packages, whose documents lie on the network
nitpick_ignore_regex = [
    (r"py:.*", r"(numpy|np|jax|jnp|pandas|pathlib|collections|typing|os)\..*"),
    (r"py:class", r"(Path|Any|Sequence|Callable|Mapping|Iterable|optional|Numbers|Camber|MjSpec)"),
    (r"py:class", r"belt_sim\.api\.sweep\.SweepTable"),
    (r"py:class", r"belt_sim\.importing\.(columns\.LoggedTables?|build\.Proposal)"),
    (r"py:class", r"(FieldInfo|NoneType|types\.Annotated)"),
    (r"py:class", r"(dict|tuple)\[str"),  # autodoc takes generics apart
    # named, not listed
    (r"py:class", r"belt_sim\.(space|line|model|errors|linear|validity|results\.(diagnosis|estimates))\..*"),
    (r"py:class", r"(mujoco|pd)\..*|DataFrame|Result"),
]
