"""The settings of the documentation: ``sphinx-build -c .sphinx src/pymoo_psi/guide site``."""

import os
import re
from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml
from pygments.lexers.special import TextLexer

import pymoo_psi

project = "pymoo-psi"
author = "The pymoo-psi developers"
version = release = pymoo_psi.__version__
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "sphinx_copybutton",
]
copybutton_exclude = ".gp, .go"  # prompts and what is printed

# Guides are Markdown; the code of notebooks and of the gallery runs in the build.
myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
# Notebooks import what is beside this file.
paths = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, paths))

# Docstrings are in Google's style.
default_role = "code"
smartquotes = False  # two hyphens are those of an option
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"exclude-members": "set"}  # a figure's repeats all of matplotlib
napoleon_attr_annotations = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "pydata_sphinx_theme"
html_static_path = ["style.css"]
html_css_files = ["style.css"]
html_sidebars = {"index": [], "method": []}
html_title = "pymoo-psi"
html_theme_options = {
    "footer_end": [],
    "footer_start": ["copyright"],
    "header_links_before_dropdown": 7,
    "navbar_end": ["theme-switcher"],
    "show_nav_level": 2,
}
html_context = {"default_mode": "auto"}
html_show_copyright = False
html_show_search_summary = False  # it would fetch pages, which browsers refuse for files
html_show_sourcelink = False
html_math_renderer = "mathml"


def add_formula(translator, node):
    """Write a formula as MathML, which browsers show without a script."""
    is_block = node.tagname == "math_block"
    translator.body.append(tex2mathml(node.astext(), as_block=is_block))
    raise SkipNode


def find_by_last_part(app, env, node, text):
    """Find the target of ``:class:`pymoo_psi.PSI```, described as ``algorithms.PSI``."""
    if node.get("refdomain") != "py" or node.get("refspecific"):
        return None
    node["refspecific"] = True  # as with a dot in front
    name = node["reftarget"].removeprefix("pymoo_psi.")
    kind = node["reftype"]
    return env.get_domain("py").resolve_xref(
        env, node["refdoc"], app.builder, kind, name, node, text
    )


def name_files(app, name, source):
    """Set the name of a file, which guides have as a comment, as the caption of its block."""
    named = r"^<!-- (\S+) -->\n```(\w+)$"
    source[0] = re.sub(named, r"```{code-block} \2\n:caption: \1\n", source[0], flags=re.M)


def set_as_code(app, context, lines):
    """Set the examples of a command as code."""
    heading, *examples = [line.removeprefix("| ") for line in lines if line.startswith("| ")]
    rest = [line for line in lines if not line.startswith("| ")]
    lines[:] = [f"{heading}:", "", *(f"    {line.strip()}" for line in examples), "", *rest]


def setup(app):
    """Add what the extensions do not have."""
    app.add_html_math_renderer("mathml", (add_formula, None), (add_formula, None))
    app.add_lexer("csv", TextLexer)
    app.connect("missing-reference", find_by_last_part)
    app.connect("source-read", name_files)
    app.connect("sphinx-click-process-epilog", set_as_code)
