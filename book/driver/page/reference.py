"""A Sphinx extension: the reference of the library, written from its docstrings by autodoc.

autodoc and napoleon do nearly all of it. What they cannot know of this project is here:

| in the library | on the page |
|---|---|
| a signature, with `Vector` and `Solution` | the same words, and a link where one has an entry |
| `value: float  # V_theta(s)` in a dataclass | a line of the list of its fields |
| `Eq. (7)` in a docstring | a link to the row of the page on notation |
| `# departure K` in a docstring | a link to that departure |
| `td_error` or `Nmpc.solve` as code, on any page | a link to its entry, once in a section |
| the source of `td_error`, on any page | a link to its entry, after the name of the file |
"""

import ast
import inspect
import re
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import is_dataclass
from enum import Enum
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

from driver.project import ROOT

NOTATION = "book/notation"
EQUATION = re.compile(r"(?P<word>Eqs?\. )?\((?P<number>2[a-f]|\d\d?)\)")
EQUATIONS = re.compile(r"Eqs?\. \((?:2[a-f]|\d\d?)\)(?:(?:, | and |, and )\((?:2[a-f]|\d\d?)\))*")
DEPARTURES = re.compile(r"\s*# (?P<words>departures? [A-Z](?:(?:, | and )[A-Z])*)")


def setup(app: Sphinx) -> dict[str, bool]:
    """Document the library that lies beside the book, whichever is installed."""
    sys.path.insert(0, str((ROOT / "nmpcrl").resolve().parent))
    app.connect("source-read", each_module)
    app.connect("autodoc-process-signature", as_written)
    app.connect("autodoc-skip-member", without_others)
    app.connect("autodoc-process-docstring", completed, priority=400)  # before napoleon's
    app.connect("doctree-read", number_rows)
    app.connect("missing-reference", known_or_plain)
    app.connect("doctree-resolved", link_code)
    app.connect("doctree-resolved", link_source)
    return {"parallel_read_safe": False, "parallel_write_safe": True}


def each_module(app: Sphinx, page: str, source: list[str]) -> None:
    """`.. automodules:: package` as one `automodule` for each module of a package."""
    source[0] = PACKAGE.sub(
        lambda found: "\n\n".join(
            f".. automodule:: {name}\n   :members:\n   :member-order: bysource"
            for name in modules(found[1])
        ),
        source[0],
    )


PACKAGE = re.compile(r"^\.\. automodules:: ([\w.]+)$", flags=re.M)


def modules(package: str) -> list[str]:
    """The public modules of a package."""
    folder = ROOT / package.replace(".", "/")
    return sorted(f"{package}.{path.stem}" for path in folder.glob("[a-z]*.py"))


def as_written(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, given: str | None, returned: str
) -> tuple[str, str] | None:
    """A signature in the words of the source, not in what Python makes of `Vector`."""
    getter = getattr(thing, "fget", None) or getattr(thing, "func", thing)  # of a property
    if not inspect.isroutine(getter) and not inspect.isclass(getter):
        return None
    defined(app.env)[name] = f"{getter.__module__}.{getter.__qualname__}"
    if what in ("class", "exception"):
        return (_constructor(thing), "") if given is not None else None
    definition = _definition(getter)
    if not isinstance(definition, ast.FunctionDef):
        return None
    if what == "property":  # of which autodoc shows the type that it has
        if definition.returns:
            names = inspect.unwrap(getter).__globals__ | ALIASES
            getter.__annotations__["return"] = eval(ast.unparse(definition.returns), names)
        return None
    _Named(inspect.unwrap(getter).__globals__).visit(definition)
    arguments = definition.args
    if what == "method" and arguments.args and arguments.args[0].arg in ("self", "cls"):
        del arguments.args[0]
    result = ast.unparse(definition.returns) if definition.returns else ""
    return f"({ast.unparse(arguments)})".replace("'", '"'), result


# What autodoc is to show of an alias: its name.
ALIASES = {
    name: type(name, (), {"__module__": "nmpcrl"}) for name in ("Vector", "Matrix", "Column")
}


class _Named(ast.NodeTransformer):
    """Full names for the library's classes in annotations; `~` has the page show the last part."""

    def __init__(self, names: dict[str, Any]) -> None:
        self._names = names

    def visit_arg(self, node: ast.arg) -> ast.arg:
        if node.annotation:
            node.annotation = self._annotation(node.annotation)
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.visit(node.args)
        if node.returns:
            node.returns = self._annotation(node.returns)
        return node

    def _annotation(self, node: ast.expr) -> ast.expr:
        unquoted = ast.unparse(node).replace("'", "")
        return ast.Name(re.sub(r"(?<![\w.])[A-Z]\w*", self._full, unquoted))

    def _full(self, found: re.Match[str]) -> str:
        kind = self._names.get(found[0])
        if not inspect.isclass(kind) or not kind.__module__.startswith("nmpcrl."):
            return found[0]
        return f"~{kind.__module__}.{kind.__qualname__}"


def completed(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """A docstring with links to equations and departures, and with the fields of a dataclass."""
    if lines and lines[0].startswith("Create new instance of"):  # so says every named tuple
        lines.clear()
        return
    if what == "module":  # its further paragraphs are for who reads the source
        lines[:] = lines[: lines.index("")] if "" in lines else lines
    if what == "class":
        if not _ours(thing.__init__):
            lines[:] = inspect.cleandoc(thing.__doc__ or "").splitlines()
        fields = [f"    {field}" for field in _fields(thing)]
        lines += ["", "Fields:", *fields, ""] if fields else []
        members = [f"    {member}" for member in _members(thing)]
        lines += ["", "Members:", *members, ""] if members else []
    lines[:] = linked("\n".join(lines)).split("\n")


def without_others(
    app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any
) -> bool | None:
    """Leave out what other libraries put into a class of ours.

    That includes the properties by which a named tuple gives its fields: they are in the list.
    """
    return True if type(thing).__name__ == "_tuplegetter" or not _ours(thing) else None


def _ours(thing: Any) -> bool:
    """Whether the library defines it, or nothing says where it comes from."""
    return (getattr(thing, "__module__", None) or "nmpcrl").startswith("nmpcrl")


def linked(docstring: str) -> str:
    """Its equations and departures as links, in reStructuredText."""
    docstring = DEPARTURES.sub(_departures, docstring.replace("|", r"\|"))  # |speed| is no macro
    return EQUATIONS.sub(lambda found: EQUATION.sub(_row, found[0]), docstring)


def _row(found: re.Match[str]) -> str:
    return f":ref:`{found['word'] or ''}({found['number']}) <paper-{found['number']}>`"


def _departures(found: re.Match[str]) -> str:
    """The first link has the word, too: "departures A and M" are two."""
    words = re.sub(r"(departures? )?\b([A-Z])\b", r":ref:`\1\2 <departure-\2>`", found["words"])
    return f" ({words})"


def number_rows(app: Sphinx, doctree: nodes.document) -> None:
    """Make the rows of the paper's equations on the page on notation places to link to."""
    if app.env.docname != NOTATION:
        return
    labels = app.env.get_domain("std").anonlabels  # type: ignore[attr-defined]
    for row in doctree.findall(nodes.row):
        if found := re.match(r"\((\d+[a-f]?)\)$", row[0].astext()):
            label = f"paper-{found[1]}"
            row[0]["ids"].append(label)
            labels[label] = (NOTATION, label)


def known_or_plain(
    app: Sphinx, env: BuildEnvironment, node: Any, content: nodes.Element
) -> nodes.Node | None:
    """The type of a signature: a link if it has an entry under another name, else plain text."""
    if node["refdomain"] != "py" or node["reftype"] not in ("class", "exc", "obj"):
        return None
    return _reference(app, node["refdoc"], node["reftarget"], content) or content


def link_code(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Link code that names an entry to it, the first time in each section or table cell."""
    seen = set()
    for code in list(doctree.findall(nodes.literal)):
        above = list(_above(code))
        if any(isinstance(one, nodes.reference | nodes.title | nodes.caption) for one in above):
            continue
        place = next(one for one in above if isinstance(one, PLACES))
        name = code.astext().removesuffix("()")
        if (id(place), name) in seen:
            continue
        if link := _reference(app, page, name, code.deepcopy()):
            seen.add((id(place), name))
            code.replace_self(link)


def link_source(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Say after the name of a file, above what it defines, where the reference has that."""
    for path in list(doctree.findall(nodes.literal)):
        block = path.parent.next_node(nodes.literal_block, descend=False, siblings=True)
        if not FILE.fullmatch(path.astext()) or path.parent.astext() != path.astext():
            continue
        if (
            block is None
            or path.parent.parent.index(block) != path.parent.parent.index(path.parent) + 1
        ):
            continue
        module = path.astext().removesuffix(".py").replace("/", ".")
        for name in DEFINED.findall(block.astext()):
            places = {at for at in defined(app.env).values() if _defines(at, module, name)}
            code = nodes.literal("", name)
            if len(places) == 1 and (link := _reference(app, page, places.pop(), code)):
                path.parent.append(nodes.Text(", in the reference: "))
                path.parent.append(link)


def _defines(place: str, module: str, name: str) -> bool:
    """Whether a place is that name, or that member of a class, in a module."""
    return place.startswith(f"{module}.") and place.endswith(f".{name}")


FILE = re.compile(r"nmpcrl/[\w/]+\.py")
DEFINED = re.compile(r"^(?:def|class) ([A-Za-z]\w*)", flags=re.M)
PLACES = (nodes.entry, nodes.section, nodes.document)


def _above(node: nodes.Node) -> Iterator[nodes.Node]:
    while node.parent is not None:
        node = node.parent
        yield node


def defined(env: BuildEnvironment) -> dict[str, str]:
    """Where what has an entry is defined, by the name of the entry."""
    names: dict[str, str] = vars(env).setdefault("nmpcrl_defined", {})
    return names


def _reference(app: Sphinx, page: str, name: str, content: nodes.Node) -> nodes.reference | None:
    """A link from a page to the one entry that code names, if it is about this library."""
    entries = _entries(app.env).get(name, set())
    if len(entries) != 1:
        return None
    (entry,) = entries
    at = app.env.get_domain("py").objects[entry]  # type: ignore[attr-defined]
    address = f"{app.builder.get_relative_uri(page, at.docname)}#{at.node_id}"
    if at.docname == page:
        address = f"#{at.node_id}"
    return nodes.reference("", "", content, internal=True, refuri=address, reftitle=entry)


def _entries(env: BuildEnvironment) -> dict[str, set[str]]:
    """What code may call each entry: its path, or the end of it, from a word that tells."""
    names: dict[str, set[str]] = vars(env).setdefault("nmpcrl_entries", {})
    if names:
        return names
    for entry, at in env.get_domain("py").objects.items():  # type: ignore[attr-defined]
        if at.objtype == "module" or at.aliased:
            continue
        for path in {entry, defined(env).get(entry, entry)}:
            parts = path.split(".")
            for start in range(len(parts)):
                name = ".".join(parts[start:])
                if "." in name or re.search(r"[A-Z_]", name):  # `run` is a word like others
                    names.setdefault(name, set()).add(entry)
    return names


def _definition(thing: Any) -> ast.stmt | None:
    """Where a function is written, decorators taken off."""
    try:
        text = inspect.getsource(inspect.unwrap(thing))
    except (OSError, TypeError):
        return None
    return ast.parse(textwrap.dedent(text)).body[0]


def _constructor(kind: type) -> str:
    """The names of what a class is made of, with defaults; types are in the list below."""
    if issubclass(kind, Enum) or getattr(kind, "_is_protocol", False):
        return ""
    if not (is_dataclass(kind) or hasattr(kind, "_fields")):
        definition = _definition(vars(kind).get("__init__"))
        if not isinstance(definition, ast.FunctionDef):
            return ""
        del definition.args.args[0]
        return f"({ast.unparse(definition.args)})".replace("'", '"')
    shown = []
    for parameter in inspect.signature(kind).parameters.values():
        default = parameter.default
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in shown:
            shown.append("*")
        if default is parameter.empty:
            shown.append(parameter.name)
        else:
            plain = isinstance(default, bool | int | float | str | tuple | None)
            shown.append(f"{parameter.name}={default!r}" if plain else f"{parameter.name}=...")
    return f"({', '.join(shown)})"


def _fields(kind: type) -> Iterator[str]:
    """The fields of a dataclass, each with its type and the comment beside it."""
    for one in reversed(kind.__mro__):
        if not (is_dataclass(one) or hasattr(one, "_fields")):
            continue
        text = textwrap.dedent(inspect.getsource(one))
        (tree,) = ast.parse(text).body
        lines = text.splitlines()
        assert isinstance(tree, ast.ClassDef)
        for node in tree.body:
            if not isinstance(node, ast.AnnAssign) or not isinstance(node.target, ast.Name):
                continue
            kind_of = ast.unparse(node.annotation).strip("'")
            if node.target.id.startswith("_") or kind_of.startswith("ClassVar"):
                continue
            comment = lines[node.end_lineno - 1].partition("  # ")[2] if node.end_lineno else ""
            if comment.startswith("departure"):
                comment = f"# {comment}"
            about = _help(one, node.target.id) or comment
            yield f"{node.target.id} ({kind_of}): {about}"


def _members(kind: type) -> Iterator[str]:
    """The members of an enumeration, each with its value and the comment beside it."""
    if not issubclass(kind, Enum):
        return
    lines = textwrap.dedent(inspect.getsource(kind)).splitlines()
    for member in kind:
        (line,) = (line for line in lines if re.match(rf"    {member.name} = ", line))
        comment = line.partition("  # ")[2]
        yield f"{member.name}: `{member.value!r}`{', ' * bool(comment)}{comment}"


def _help(kind: Any, name: str) -> str:
    """What an `Experiment` says of its own field."""
    metadata = getattr(kind, "__dataclass_fields__", {}).get(name)
    return str(metadata.metadata.get("help", "")) if metadata else ""
