"""How Sphinx builds this documentation: `python -m sphinx -W -q docs build/site`."""

from importlib.metadata import version as version_of

project = "exudyn-flexlink"
author = "The exudyn_flexlink developers"
project_copyright = f"2026, {author}"
release = version_of("exudyn-flexlink")

extensions = ["myst_parser"]
myst_heading_anchors = 3

highlight_language = "none"  # of blocks that name no language: commands

html_theme = "furo"
html_title = "exudyn-flexlink"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
