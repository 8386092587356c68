"""The rules of the house, by walking its source: who imports whom, names, docstrings, sizes, lists."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
PACKAGES = ("gapbeam", "meshes", "solver", "studies", "postprocess")
ABOUT = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
FILES = sorted((PROJECT / "gapbeam").rglob("*.py"))
BENCHMARKS = sorted((PROJECT / "benchmarks").rglob("*.py"))

ARROWS = {
    "gapbeam": {"studies", "solver", "meshes", "postprocess"},
    "studies": {"solver", "meshes", "postprocess"},
    "solver": {"meshes"},
    "meshes": set(),
    "postprocess": set(),
}
RECORDS = "gapbeam.solver.schema.record_table"  # the one module that postprocess reads of another package

LONGEST = 500  # lines
# DOLFINx and what it stands on come from the environment, not from PyPI.
OF_ENVIRONMENT = {"dolfinx", "ufl", "basix", "petsc4py", "slepc4py", "mpi4py"}
IMPORTED_AS = {
    "dask_jobqueue": "dask-jobqueue",
    "vtkmodules": "vtk",
    "PIL": "pillow",
    "markdown_it": "markdown-it-py",
    "mpl_toolkits": "matplotlib",
    "llvmlite": "numba",  # which comes with the release that it needs
    "pydantic_core": "pydantic",  # likewise
}
PUBLIC_NOUNS = ["BaseMotion", "Contact", "Joint", "Load"]  # of scenes, and the tables of case files that say the same
OPTIONAL = {"imageio_ffmpeg", "pyarrow", "pyyeti", "dask"}  # the last comes with distributed
BY_NAME = {"h5netcdf"}  # asked for by its name, as the engine of xarray

MODULE_NAMES = {"util", "utils", "helper", "helpers", "manager", "managers", "handler", "handlers", "common", "misc"}
BANNED_PARTS = {"util", "utils", "helper", "helpers", "manager", "managers", "disp", "vel", "master", "slave"}
HANDLERS = {"handler", "handlers"}  # what the modules logging and signal call their own; elsewhere not used
# "context manager" is a word of the language.
BANNED_WORDS = re.compile(
    r"\b(disp|vel|helpers?|(?<!context )managers?|(?<!importlib\.)utils?|masters?|slaves?)\b", re.IGNORECASE
)


def name_of(path: Path) -> str:
    """Return the dotted name of a module of ours."""
    parts = list(path.relative_to(PROJECT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def package_of(module: str) -> str:
    """Return the folder of the repository that a module of ours lies in."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in PACKAGES else parts[0]


@cache
def tree(path: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of the syntax tree of a file."""
    return tuple(ast.walk(tree(path)))


@cache
def imports(path: Path) -> tuple[tuple[str, int], ...]:
    """Return what a file imports, `from a import b` as both a and a.b where that is a module; with the line."""
    return tuple(_imports(path))


def _imports(path: Path) -> Iterator[tuple[str, int]]:
    known = _names()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            yield module, node.lineno
            below = (f"{module}.{alias.name}" for alias in node.names)
            yield from ((name, node.lineno) for name in below if name in known)


@cache
def _names() -> frozenset[str]:
    """Return the names of all modules of ours."""
    return frozenset(name_of(file) for file in (*FILES, *BENCHMARKS))


def place(path: Path, line: int = 1) -> str:
    """Return file and line for a message."""
    return f"{path.relative_to(PROJECT)}:{line}"


def test_there_is_something_to_walk() -> None:
    """Every package of the house has modules; a renamed folder would make the other rules pass over nothing."""
    for package in PACKAGES:
        assert [path for path in FILES if package_of(name_of(path)) == package], package


def test_import_arrows() -> None:
    """Packages import only those that the arrows of the house point to; postprocess one module of solver."""
    wrong = []
    for path in FILES:
        package = path.relative_to(PROJECT).parts[0]
        for module, line in imports(path):
            target = package_of(module) if module.split(".")[0] == "gapbeam" else ""
            if target not in ARROWS or target == package or target in ARROWS[package]:
                continue
            if package == "postprocess" and module == RECORDS:
                continue
            wrong.append(f"{place(path, line)} imports {module}")
    assert wrong == []


# The rooms of solver/ from the bottom up: a module imports from its own room and from rooms below.
ROOMS = (
    "messages", "schema", "compilation", "sections", "supports", "system", "loads", "contact", "integrators", "case",
    "assembly", "memory", "linear_algebra", "models", "scene", "kernel", "scene_file", "seat", "diagnostics",
    "march", "periodic", "run",
)  # fmt: skip


def test_rooms_of_solver_have_an_order() -> None:
    """No module imports from a room above its own."""
    folders = {path.parent.name for path in (PROJECT / "solver").glob("*/__init__.py")}
    assert sorted(ROOMS) == sorted(folders)
    upward = []
    for path in FILES:
        parts = name_of(path).split(".")
        if parts[1:2] != ["solver"] or path.name == "__init__.py":
            continue
        own = ROOMS.index(parts[2]) if parts[2] in ROOMS else -1
        for module, line in imports(path):
            target = module.split(".")
            room = target[2] if target[:2] == ["gapbeam", "solver"] and len(target) > 2 else ""
            if room in ROOMS and ROOMS.index(room) > own:
                upward.append(f"{place(path, line)} imports {module}")
    assert upward == []


def test_no_file_lies_flat_in_solver() -> None:
    """Each module of solver/ has a room."""
    assert {path.stem for path in (PROJECT / "solver").glob("*.py")} == {"__init__"}


def test_no_basename_repeats() -> None:
    """Two modules never share a name: an error message or a search finds one file."""
    names = [path.stem for path in FILES if not path.stem.startswith("__")]
    assert sorted(name for name in set(names) if names.count(name) > 1) == []


def test_no_class_name_repeats() -> None:
    """Two classes of the package never share a name, but for those that one file keeps to itself."""
    found = [
        node.name
        for path in FILES
        for node in nodes(path)
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    ]
    assert sorted(name for name in set(found) if found.count(name) > 1) == PUBLIC_NOUNS


def test_records_stand_alone() -> None:
    """What postprocess reads of solver brings nothing of ours, and nothing but the standard library."""
    path = PROJECT / (RECORDS.removeprefix("gapbeam.").replace(".", "/") + ".py")
    assert [module for module, _ in imports(path) if module.split(".")[0] not in sys.stdlib_module_names] == []
    for parent in (path.parent / "__init__.py", path.parent.parent / "__init__.py"):
        assert list(imports(parent)) == []


def test_no_circle_of_imports() -> None:
    """No module imports itself by way of others, within functions and in benchmarks neither."""
    known = {name_of(path): path for path in (*FILES, *BENCHMARKS)}
    arrows = {
        name: sorted({module for module, _ in imports(path) if module in known and module != name})
        for name, path in known.items()
    }
    done: set[str] = set()
    circles: list[str] = []

    def follow(name: str, way: tuple[str, ...]) -> None:
        if name in way:
            circles.append(" -> ".join([*way[way.index(name) :], name]))
        elif name not in done:
            for other in arrows[name]:
                follow(other, (*way, name))
            done.add(name)

    for name in arrows:
        follow(name, ())
    assert circles == []


def test_imports_are_absolute() -> None:
    """No `from . import`, in packages and tests."""
    tests = (PROJECT / "tests").rglob("*.py")
    wrong = [
        place(path, node.lineno)
        for path in [*FILES, *tests]
        for node in nodes(path)
        if isinstance(node, ast.ImportFrom) and node.level > 0
    ]
    assert wrong == []


def test_no_star_imports() -> None:
    """Every name that is used says where it comes from."""
    wrong = [
        place(path, node.lineno)
        for path in FILES
        for node in nodes(path)
        if isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names)
    ]
    assert wrong == []


def test_everything_public_has_a_docstring() -> None:
    """Modules, classes, functions and methods whose names do not begin with an underscore."""
    lacking = []
    for path in FILES:
        if ast.get_docstring(tree(path)) is None:
            lacking.append(place(path))
        lacking += [
            f"{place(path, node.lineno)} {node.name}" for node in _public(tree(path)) if ast.get_docstring(node) is None
        ]
    assert lacking == []


def _public(body: ast.AST) -> Iterator[ast.ClassDef | ast.FunctionDef]:
    for node in ast.iter_child_nodes(body):
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from _public(node)


def test_package_files_hold_one_docstring_line() -> None:
    """`__init__.py` is one line of docstring; that of gapbeam may export besides."""
    for path in FILES:
        if path.name != "__init__.py":
            continue
        docstring = ast.get_docstring(tree(path), clean=False)
        assert docstring, place(path)
        assert "\n" not in docstring, place(path)
        if path.parent != PROJECT / "gapbeam":
            assert len(path.read_text(encoding="utf-8").splitlines()) == 1, place(path)


def test_names_say_what_things_are() -> None:
    """No module or identifier that is called a helper, manager or the like, nor disp, vel, master or slave."""
    wrong = [
        f"{place(path)} module {part}"
        for path in FILES
        for part in path.relative_to(PROJECT).with_suffix("").parts
        if set(part.lower().split("_")) & MODULE_NAMES
    ]
    for path in FILES:
        foreign = {"logging", "signal"} & {module for module, _ in imports(path)}
        banned = BANNED_PARTS if foreign else BANNED_PARTS | HANDLERS
        for name, line in _identifiers(tree(path)):
            words = {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)}
            if words & banned or words == {"common"}:
                wrong.append(f"{place(path, line)} {name}")
    assert wrong == []


def test_no_class_is_called_a_handler() -> None:
    """The logging module has handlers; nothing of ours is one."""
    wrong = [
        f"{place(path, node.lineno)} {node.name}"
        for path in FILES
        for node in nodes(path)
        if isinstance(node, ast.ClassDef) and "handler" in node.name.lower()
    ]
    assert wrong == []


def _identifiers(module: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield every name that a module defines: classes, functions, arguments, variables, attributes of self."""
    for node in ast.walk(module):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.arg):
            yield node.arg, node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.attr, node.lineno


def test_words_that_are_not_used() -> None:
    """Nor do docstrings, comments, messages and case files use them."""
    cases = sorted((PROJECT / "cases").glob("*.toml"))
    wrong = [
        f"{place(path, number)} {found[0]}"
        for path in [*FILES, *cases]
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if (found := BANNED_WORDS.search(line))
    ]
    assert wrong == []


def test_no_file_is_long() -> None:
    """At most 500 lines in a module."""
    lengths = {place(path): len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}


def test_models_are_asked_for_their_case_in_the_set_up_alone() -> None:
    """At five places; others ask a model for its end, scheme, profile and length, or have the case from a caller."""
    asked = [
        f"{place(path)}: {line.strip()}"
        for path in (*FILES, *BENCHMARKS)
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"\bmodel\.case\b", line)
    ]
    assert len(asked) <= 5, asked


def test_folders_are_packages_of_gapbeam() -> None:
    """Every folder with modules has an `__init__.py`; links at the top level lead to what users look for there."""
    folders = {path.parent for path in FILES}
    assert [str(folder) for folder in folders if not (folder / "__init__.py").is_file()] == []
    assert not any(folder.is_symlink() for folder in (PROJECT / "gapbeam").rglob("*"))
    for name in ("solver", "meshes", "cases", "postprocess"):
        assert (PROJECT / name).readlink() == Path("gapbeam") / name


def test_commands_need_no_click_beside_typer() -> None:
    """No click is loaded but that of typer, which has its own from 0.29 on and takes no types of another."""
    wrong = []
    for path in FILES:
        typed = [
            inner
            for node in nodes(path)
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            for inner in ast.walk(ast.Module(node.body, []))
        ]
        for node in nodes(path):
            loads = isinstance(node, ast.Import) and any(one.name.split(".")[0] == "click" for one in node.names)
            loads |= isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "click"
            if (loads and node not in typed) or (isinstance(node, ast.keyword) and node.arg == "click_type"):
                wrong.append(place(path, node.lineno))
    assert wrong == []


def test_third_party_imports_are_declared() -> None:
    """Whatever is imported is a dependency in pyproject.toml, comes with one, or is DOLFINx's company."""
    needs = [*ABOUT["project"]["dependencies"], *chain(*ABOUT["project"]["optional-dependencies"].values())]
    declared = {re.split(r"[^\w-]", need)[0] for need in needs} - {"dolfinx-solver-real", "gapbeam"}
    ours = {*PACKAGES, *sys.stdlib_module_names}
    used: dict[str, str] = {}
    for path in FILES:
        for module, line in imports(path):
            top = module.split(".")[0]
            if top not in ours | OF_ENVIRONMENT | OPTIONAL:
                used.setdefault(IMPORTED_AS.get(top, top), place(path, line))
    assert {name: where for name, where in used.items() if name not in declared} == {}
    assert declared - set(used) == BY_NAME, "declared but never imported"
    sources = "".join(path.read_text(encoding="utf-8") for path in FILES)
    assert [name for name in BY_NAME if f'"{name}"' not in sources] == []


def test_cases_are_toml_that_introduces_itself() -> None:
    """All in cases/ but signals, matrices and modes is TOML that opens with a comment, which says how to run it."""
    signals = PROJECT / "cases" / "signals"
    assert all(path.suffix == ".csv" and path.read_text(encoding="utf-8")[0] == "#" for path in signals.iterdir())
    matrices = (".sti", ".mas", ".dof", ".inp", ".csv", ".mtx")
    files = [path for path in (PROJECT / "cases").rglob("*") if path.is_file() and path.parent != signals]
    files = [path for path in files if path.suffix not in matrices]
    assert files
    for path in files:
        assert path.suffix == ".toml", path
        text = path.read_text(encoding="utf-8")
        assert tomllib.loads(text)["title"]
        header = text.split("\n\n")[0].splitlines()
        assert len(header) >= 4, path
        assert all(line.startswith("#") for line in header), path
        kinds = {"measurement": "identify", "recorded": "library", "variable": "uncertain", "least": "optimize"}
        command = next((kinds[key] for key in kinds if key in tomllib.loads(text)), "run")
        assert f"gapbeam {command} {path.relative_to(PROJECT)}" in "\n".join(header)


@pytest.mark.parametrize("path", sorted((PROJECT / "tests").rglob("test_*.py")), ids=lambda path: path.stem)
def test_test_files_say_what_they_check(path: Path) -> None:
    """A test file opens with a docstring, and its names are free of the unused words as well."""
    assert ast.get_docstring(tree(path))
    assert not set(path.stem.split("_")) & MODULE_NAMES
