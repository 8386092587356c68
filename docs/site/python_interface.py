"""The page of the Python interface, from source: nothing of gapbeam is imported, so DOLFINx is not needed."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

GAPBEAM = Path(__file__).parents[2] / "gapbeam"
OPENING = """# What does each function of gapbeam take and return?

This page is made from the source of gapbeam: every name that `import gapbeam` brings.
[Use from Python](../how-to/use-from-python.md) shows how they go together.
"""
STAR = re.compile(r"\*(?=(?:[^`]*`[^`]*`)*[^`]*\Z)")
"""A star outside back quotes, which would begin an emphasis."""
Definition = ast.FunctionDef | ast.ClassDef


@cache
def named(module: str) -> tuple[dict[str, Definition], dict[str, str]]:
    """Return the functions and classes of a module of gapbeam by name, and the modules of the names that it imports."""
    path = GAPBEAM.joinpath(*module.split(".")[1:])
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return (
        {node.name: node for node in tree.body if isinstance(node, Definition)},
        {alias.name: str(node.module) for node in reversed(imports) for alias in node.names},
    )


def definition(module: str, name: str) -> Definition | None:
    """Return a function or class of a module, or of the module that it imports it from."""
    defined, imported = named(module)
    return defined.get(name) or (definition(imported[name], name) if name in imported else None)


def interface() -> dict[str, Definition]:
    """Return the functions and classes that `import gapbeam` brings, functions first."""
    stub = ast.parse((GAPBEAM / "__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    places = {alias.name: str(node.module) for node in imports for alias in node.names}
    found = {name: one for name, module in places.items() if (one := definition(module, name))}
    return dict(sorted(found.items(), key=lambda item: (isinstance(item[1], ast.ClassDef), item[0])))


def is_error(node: Definition) -> bool:
    """Return whether a class is an error of the interface."""
    return isinstance(node, ast.ClassDef) and (
        definition("gapbeam.interface.error_classes", node.name) is not None
        or any(ast.unparse(base).endswith("Error") for base in node.bases)
    )


def _made_with(node: ast.ClassDef) -> str:
    """Return the arguments of a class that makes objects, in brackets."""
    made = next((one for one in node.body if isinstance(one, ast.FunctionDef) and one.name == "__init__"), None)
    if made is None:
        fields = [one.target for one in node.body if isinstance(one, ast.AnnAssign)]
        return "" if is_error(node) else f"({', '.join(map(ast.unparse, fields))})"
    return "" if is_error(node) else f"({ast.unparse(made.args).removeprefix('self, ')})"


def described(node: Definition) -> str:
    """Return a function or class with its docstring, as a block for Sphinx."""
    from sphinx.ext.napoleon import Config, GoogleDocstring

    text = STAR.sub(r"\\*", ast.get_docstring(node) or "")
    if isinstance(node, ast.ClassDef):
        head = f".. py:{'exception' if is_error(node) else 'class'}:: {node.name}{_made_with(node)}"
    else:
        returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        head = f".. py:function:: {node.name}({ast.unparse(node.args)}){returns}"
    lines = str(GoogleDocstring(text, Config(napoleon_use_rtype=False))).splitlines()
    body = ["   " + line for line in lines]
    return "\n".join(["```{eval-rst}", ".. default-role:: code", "", head, "   :module: gapbeam", "", *body, "```"])


def interface_page() -> str:
    """Return the page."""
    functions = [one for one in interface().values() if isinstance(one, ast.FunctionDef)]
    classes = [one for one in interface().values() if isinstance(one, ast.ClassDef)]
    errors = [one for one in classes if is_error(one)]
    parts = [OPENING, "## Functions", *map(described, functions)]
    parts += ["## Classes", *(described(one) for one in classes if one not in errors)]
    parts += ["## Errors", *map(described, errors)]
    return "\n\n".join(parts) + "\n"
