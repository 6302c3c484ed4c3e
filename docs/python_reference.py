"""A Sphinx extension: the directive `python NAME` shows a class or function of the Python module.

Signatures, types and docstrings are read from the module's sources and type stubs, so that nothing of
the module runs. The docstrings are Markdown. A public name that no page shows is a warning.
"""

import ast
import inspect
import os
from pathlib import Path

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

PACKAGE = Path(os.environ["PALPATE_PYTHON_PACKAGE"])
# Later files override earlier ones.
FILES = {
    "palpate": ["_palpate.pyi", "_error.py", "_recording.py", "results.py", "recognition.py", "many.py",
                "_bag.py", "commands.py", "show.py", "streams.py"],
    "palpate.reference": ["reference.pyi"],
}


def definitions(module):
    """Classes and functions by name, each with the file that defines it."""
    found = {}
    for name in FILES[module]:
        for node in ast.parse((PACKAGE / name).read_text()).body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                found[node.name] = (node, PACKAGE / name)
    return found


def public_names():
    """Full names of all that the module offers."""
    names = [
        alias.asname
        for node in ast.parse((PACKAGE / "__init__.py").read_text()).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname
    ]
    functions = [name for name in definitions("palpate.reference") if name[0] != "_"]
    return [f"palpate.{name}" for name in names] + [
        f"palpate.reference.{name}" for name in functions
    ]


class Simpler(ast.NodeTransformer):
    """Types as a reader says them: NDArray[float64] without modules and stub-only annotations."""

    names = {
        "_Path": "str | PathLike[str]",
        "_Pair": "tuple[float, float]",
        "_Recordings": "Recording | str | PathLike[str] | Iterable[Recording | str | PathLike[str]]",
        "_Maps": "OccupancyGrid | Hypothesis | str | Iterable[OccupancyGrid | Hypothesis | str]",
    }

    def visit_Attribute(self, node):
        return ast.Name(node.attr)

    def visit_Name(self, node):
        return ast.parse(self.names.get(node.id, node.id), mode="eval").body

    def visit_Subscript(self, node):
        if getattr(node.value, "id", getattr(node.value, "attr", "")) == "Annotated":
            return self.visit(node.slice.elts[0])
        return self.generic_visit(node)


def simple(node):
    return ast.unparse(Simpler().visit(node))


def signature(function, bound):
    """(arguments) -> result, less the object that a method is called on."""
    arguments = function.args
    if bound:
        (arguments.posonlyargs or arguments.args).pop(0)
    for argument in ast.walk(arguments):
        if isinstance(argument, ast.arg) and argument.annotation is not None:
            argument.annotation = Simpler().visit(argument.annotation)
    result = "" if function.returns is None else f" -> {simple(function.returns)}"
    return f"({ast.unparse(arguments)}){'' if result == ' -> None' else result}"


def decorators(function):
    return {ast.unparse(decorator).split(".")[-1] for decorator in function.decorator_list}


def directive(kind, head, options, text, fence="```"):
    return [f"{fence}{{py:{kind}}} {head}", *options, "", *text.splitlines(), fence, ""]


def doc_of(node):
    return ast.get_docstring(node) or ""


def members(body):
    """The public methods, properties and attributes of a class, in the order of its source."""
    lines = []
    seen = set()
    for node, after in zip(body, [*body[1:], None]):
        if isinstance(node, ast.FunctionDef) and node.name[0] != "_":
            marks = decorators(node)
            again = [":noindex:"] if node.name in seen else []
            seen.add(node.name)
            if "property" in marks:
                kind = [f":type: {simple(node.returns)}"]
                lines += directive("property", node.name, kind, doc_of(node))
            elif "setter" not in marks:
                static = [":staticmethod:"] if "staticmethod" in marks else []
                head = node.name + signature(node, bound=not static)
                lines += directive("method", head, static + again, doc_of(node))
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
            if target.id[0] == "_":
                continue
            kind = [f":type: {simple(node.annotation)}"] if isinstance(node, ast.AnnAssign) else []
            text = ""
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                text = inspect.cleandoc(after.value.value)
            lines += directive("attribute", target.id, kind, text)
    return lines


def class_lines(node, options):
    """A class with what its constructor takes, and its members."""
    constructors = [
        part for part in node.body if isinstance(part, ast.FunctionDef) and part.name == "__init__"
    ]
    head = node.name
    text = doc_of(node)
    if constructors:  # the first of overloads; the docstring names the others
        head += signature(constructors[0], bound=True)
        text += "\n\n" + doc_of(constructors[0])
    bases = [simple(base) for base in node.bases if simple(base) not in ("object", "Enum")]
    if bases:
        text = f"Base: `{', '.join(bases)}`\n\n{text}"
    return directive("class", head, options, "\n".join([text, "", *members(node.body)]), "````")


class PythonDirective(SphinxDirective):
    required_arguments = 1

    def run(self):
        module, _, name = f"palpate.{self.arguments[0]}".rpartition(".")
        found = definitions(module).get(name)
        if found is None:
            raise self.error(f"{module} has no {name}")
        node, file = found
        self.env.note_dependency(str(file))
        options = [f":module: {module}"]
        if isinstance(node, ast.ClassDef):
            lines = class_lines(node, options)
        else:
            lines = directive("function", name + signature(node, False), options, doc_of(node))
        container = nodes.Element()
        self.state.nested_parse(StringList(lines, str(file)), self.content_offset, container)
        return container.children


def check_that_all_is_shown(app, env):
    shown = env.get_domain("py").objects
    for name in public_names():
        if name not in shown:
            logging.getLogger(__name__).warning("%s is on no page of docs/python_api", name)


def setup(app):
    app.add_directive("python", PythonDirective)
    app.connect("env-check-consistency", check_that_all_is_shown)
    return {"parallel_read_safe": True}
