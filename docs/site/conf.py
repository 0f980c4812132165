# SPDX-License-Identifier: MIT
"""Sphinx reads this for scripts/docs. The pages are plain Markdown, as a forge shows them."""

project = "compbox"
author = "the compbox authors"
root_doc = "README"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 6  # anchors as a forge makes them
nitpicky = True

html_theme = "furo"
html_title = "compbox"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {  # Debian's furo has no dark colours of its own
    "dark_css_variables": {
        "color-foreground-primary": "#e6e8eb",
        "color-foreground-secondary": "#b3bac2",
        "color-foreground-muted": "#8e979f",
        "color-foreground-border": "#5c646c",
        "color-background-primary": "#15181b",
        "color-background-secondary": "#1b1f23",
        "color-background-hover": "#262b30",
        "color-background-hover--transparent": "#262b3000",
        "color-background-border": "#343a40",
        "color-background-item": "#3a4046",
        "color-brand-primary": "#7db4ff",
        "color-brand-content": "#7db4ff",
        "color-highlight-on-target": "#33332a",
    }
}
