"""The site's own machinery: nothing is loaded from elsewhere, formulas can be drawn, all names are there."""

import re

import pytest

import belt_sim as bs
from belt_sim.effects.base import library
from belt_sim.io import ROOT
from studies.site import effect_pages, notebooks, reference, settings_page
from studies.site.effect_pages import text
from studies.site.mathml import mathml
from studies.site.offline import loads, loads_of_site

DOCS = ROOT / "docs"


@pytest.mark.parametrize(
    "html",
    [
        '<script src="https://cdn.example/mathjax.js"></script>',
        '<link rel="stylesheet" href="//fonts.example/a.css">',
        '<img src="http://example/a.png">',
        "<style>@import 'https://fonts.example/a.css';</style>",
        '<p style="background: url(https://example/a.png)">',
        '<iframe src="HTTPS://example"></iframe>',
    ],
)
def test_a_load_from_elsewhere_is_seen(html):
    assert len(loads(html)) == 1


def test_links_that_a_reader_may_click_are_no_loads():
    html = '<a href="https://rerun.io">Rerun</a><link rel="canonical" href="https://a.example"><img src="a.png">'
    assert loads(html) == []


def test_a_site_names_the_page_that_loads(tmp_path):
    (tmp_path / "a.html").write_text('<img src="https://example/a.png">', encoding="utf-8")
    (tmp_path / "a.css").write_text("p { background: url(//example/b.png) }", encoding="utf-8")
    (tmp_path / "b.html").write_text("<p>", encoding="utf-8")
    assert set(loads_of_site(tmp_path)) == {"a.html", "a.css"}


def test_every_formula_can_be_drawn():
    formulas = [f for p in DOCS.glob("*.md") for f in re.findall(r"\$\$(.+?)\$\$", p.read_text("utf-8"), re.DOTALL)]
    assert formulas
    for formula in formulas:
        assert mathml(formula, block=True).startswith("<math")
    assert "\u2033" in mathml("y'' + y'^2", block=False)


def test_every_public_name_stands_in_the_reference():
    listed = reference.blocks(reference.PAGE.read_text(encoding="utf-8"))
    there = {name for module, names in listed for name in names if reference.kind(module, name)}
    assert not set(bs.__all__) - there - {"__version__", "mjx"}  # a module, whose names stand there


def test_every_effect_has_its_section_with_source_and_numbers():
    for name, effect in library().items():
        said = text(effect)
        assert said.startswith(f"## {name}\n")
        assert effect.reference in said
        assert f"| `{next(iter(effect.parameters))}` |" in said


def test_every_page_is_reached_from_the_first():
    start = (DOCS / "index.md").read_text(encoding="utf-8")
    trees = "\n".join(re.findall(r"```\{toctree\}\n(.*?)```", start, re.DOTALL)).splitlines()
    assert {p.stem for p in DOCS.glob("*.md")} - {"index"} == {t for t in trees if t and not t.startswith(":")}


@pytest.mark.parametrize("page", ["README.md", "studies/README.md", "models/README.md", "models/campaigns/README.md"])
def test_what_a_readme_links_to_is_there(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    assert not [link for link in links if not ((ROOT / page).parent / link).exists()]


def test_the_reference_lists_the_functions_as_their_docstrings_begin():
    assert reference.PAGE.read_text(encoding="utf-8") == reference.written(), "run: python -m studies.site.reference"


@pytest.mark.parametrize("page", [notebooks, settings_page])
def test_settings_and_notebooks_are_read_without_a_build(page):
    text = page.PAGE.read_text(encoding="utf-8")
    assert text == page.written(), f"run: python -m {page.__name__}"
    assert "```{" not in text


def test_the_catalogue_is_what_the_effects_say():
    page = effect_pages.PAGE.read_text(encoding="utf-8")
    assert page == effect_pages.written(), "run: python -m studies.site.effect_pages"
