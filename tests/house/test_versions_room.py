"""Only one room asks which release of DOLFINx, PETSc, SLEPc or MPI there is; its tests are run with every release."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from tests.house.test_house_rules import FILES, OF_ENVIRONMENT, PROJECT, imports, name_of, nodes, place

ROOM = PROJECT / "gapbeam" / "meshes" / "versions"
INSIDE = "gapbeam.meshes.versions."
OUTSIDE = [path for path in FILES if not path.is_relative_to(ROOM)]
OUTSIDE += sorted((PROJECT / "benchmarks").rglob("*.py"))
TESTS = sorted((PROJECT / "tests").rglob("test_*.py"))
ASKS = {"__version__", "Get_library_version", "Get_version", "getVersion", "getVersionInfo"}
INDIFFERENT = "gapbeam.meshes.versions.installed_versions"  # reports the releases; nothing else follows from them


def names_in(node: ast.AST | None) -> set[str]:
    """Return the names that an expression or a statement holds."""
    return {part.id for part in ast.walk(node) if isinstance(part, ast.Name)} if node else set()


def of_environment(parts: Iterable[ast.AST]) -> set[str]:
    """Return the names under which a file, or a part of it, imports DOLFINx and its company."""
    bound: set[str] = set()
    for part in parts:
        if isinstance(part, ast.Import):
            from_there = [alias for alias in part.names if alias.name.split(".")[0] in OF_ENVIRONMENT]
        elif isinstance(part, ast.ImportFrom) and (part.module or "").split(".")[0] in OF_ENVIRONMENT:
            from_there = part.names
        else:
            continue
        bound |= {alias.asname or alias.name.split(".")[0] for alias in from_there}
    return bound


def guesses(path: Path) -> Iterator[str]:
    """Yield where a file finds out which release there is, or takes whatever there is."""
    bound = of_environment(nodes(path))
    for node in nodes(path):
        if isinstance(node, ast.Attribute) and node.attr in ASKS:
            yield f"{place(path, node.lineno)} asks {node.attr}"
        elif isinstance(node, ast.Try) and _falls_back(node, bound):
            yield f"{place(path, node.lineno)} tries what a release may not have"
        elif bound and isinstance(node, ast.Call) and _looks(node):
            yield f"{place(path, node.lineno)} looks with {ast.unparse(node.func)}"
    for module, line in imports(path):
        if module.startswith(("dolfinx.cpp", "basix._", "petsc4py.lib")):
            yield f"{place(path, line)} imports {module}, a name that is not promised to stay"
        if bound and module == "ctypes":
            yield f"{place(path, line)} calls a library past its Python names"


def _looks(node: ast.Call) -> bool:
    """Return whether a call asks for a name that may not be there, in anything but the standard library."""
    called = getattr(node.func, "id", getattr(node.func, "attr", ""))
    return called in ("hasattr", "import_module") and not names_in(node.args[0]) & sys.stdlib_module_names


def _falls_back(node: ast.Try, bound: set[str]) -> bool:
    """Return whether the absence of an import or of a name of these libraries is caught."""
    caught: set[str] = set().union(*(names_in(one.type) for one in node.handlers))
    tried = ast.Module(node.body, [])
    absent = caught & {"ImportError", "ModuleNotFoundError"} and (
        of_environment(ast.walk(tried)) or "importlib" in names_in(tried)
    )
    unknown = caught & {"AttributeError", "TypeError"} and names_in(tried) & bound
    return bool(absent or unknown)


def test_only_the_room_asks_for_releases() -> None:
    """No other file looks at a version, tries an import or a name of these libraries, or uses their private names."""
    assert [guess for path in OUTSIDE for guess in guesses(path)] == []


def test_the_room_is_what_asks() -> None:
    """The rule sees what it looks for: the room itself breaks it, for each of the reasons."""
    found = " ".join(guess for path in ROOM.glob("*.py") for guess in guesses(path))
    for reason in ("asks __version__", "tries what", "hasattr", "imports dolfinx.cpp", "past its Python names"):
        assert reason in found


@cache
def touches() -> set[str]:
    """Return the modules of the room, and those that import one."""
    direct = {
        name_of(path)
        for path in FILES
        if any(module.startswith(INSIDE) and module != INDIFFERENT for module, _ in imports(path))
    }
    return direct | {INSIDE + path.stem for path in ROOM.glob("*.py")} - {INDIFFERENT}


def test_tests_of_the_room_are_run_with_every_release() -> None:
    """A test file that imports the room, or a module that does, is marked `versions`; CI runs it on Debian sid, too."""
    for path in TESTS:
        met = {module for module, _ in imports(path)} & touches()
        marked = "pytest.mark.versions" in path.read_text(encoding="utf-8")
        assert marked or not met, f"{place(path)} imports {sorted(met)}; mark it: pytestmark = pytest.mark.versions"
