"""Sphinx's configuration of the documentation; docs/build runs it."""

import os
import re
import sys
from pathlib import Path

from breathe.renderer.sphinxrenderer import SphinxRenderer, WithContext
from docutils.nodes import SkipNode
from docutils.utils.math import latex2mathml

ROOT = Path(__file__).resolve().parent.parent

project = "Palpate"
version = re.search(r"project\(palpate VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
release = version
html_title = f"Palpate {version}"
html_theme = "furo"
html_show_copyright = False
html_copy_source = False

sys.path.insert(0, str(ROOT / "docs"))
extensions = ["myst_parser", "breathe", "python_reference"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
highlight_language = "none"  # of blocks that name no language: what the commands print
primary_domain = "cpp"

breathe_projects = {"palpate": os.environ["PALPATE_API_XML"]}
breathe_default_project = "palpate"
breathe_show_include = False


html_math_renderer = "mathml"


def math_visitor(inline):
    """Equations become MathML, which browsers show without a script, a network or LaTeX."""

    def visit(self, node):
        self.body.append(latex2mathml.tex2mathml(node.astext(), inline=inline))
        raise SkipNode

    return visit


def namespace_content(self, node):
    """Renders what a header adds to the namespace, which Breathe would declare anew for every header."""
    file = self.compound_parser.parse(node.refid)
    parent = self.context.create_child_context(file)
    with WithContext(self, parent.create_child_context(file.compounddef)):
        return self.render(file, parent)


def lead_to_site(app, page, source):
    """Links to a page of bench, as readers of the repository follow them, lead to its place on the site."""
    source[0] = re.sub(r"\(\.\./bench/(\w+)\.md", lambda of: f"(benchmarks/{of[1].lower()}.md", source[0])


def setup(app):
    app.connect("source-read", lead_to_site)
    app.add_html_math_renderer("mathml", (math_visitor(True), None), (math_visitor(False), None))
    SphinxRenderer.visit_namespace = namespace_content
