"""How Sphinx builds this documentation: `python -m sphinx -W -q docs build/site`."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "scripts"))

# A script of this repository, found by the line above.
from reference import write  # noqa: E402

import exudyn_flexlink  # noqa: E402

write(HERE / "_generated")  # pages that the program itself knows
for name in exudyn_flexlink.__all__:  # imported when first used: autodoc looks without using
    setattr(exudyn_flexlink, name, getattr(exudyn_flexlink, name))

project = "exudyn-flexlink"
author = "The exudyn_flexlink developers"
project_copyright = f"2026, {author}"
release = version_of("exudyn-flexlink")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_generated", "tables"]  # included by pages
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3

highlight_language = "none"  # of blocks that name no language: commands
default_role = "code"  # docstrings write `name` as Markdown does
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings give shapes and units

html_theme = "furo"
html_title = "exudyn-flexlink"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
