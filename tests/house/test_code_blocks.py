"""Every code block of the pages: cases are read, commands parsed and their cases read, Python compiles and imports."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest
import typer

from docs.site.code_blocks import Block, blocks, kind_of
from gapbeam.command_line import app
from gapbeam.process.usage_errors import ClickException, UsageError
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import is_scene, read_case, read_case_text
from gapbeam.solver.case.reading.known_keys import check_types
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.scene_reader import read_scene
from gapbeam.studies.identification.identification_tables import Identification
from gapbeam.studies.trials.axes import read_axis

PROJECT = Path(__file__).parents[2]
PAGES = [*(PROJECT / name for name in ("README.md", "CONTRIBUTING.md")), *sorted((PROJECT / "docs").rglob("*.md"))]
BLOCKS = [block for page in PAGES for block in blocks(page)]
DEMO, PERIODIC, BAFFLES, IDENTIFY = (
    tomllib.loads((PROJECT / f"cases/{name}.toml").read_text(encoding="utf-8"))
    for name in ("demo", "periodic", "baffles", "studies/identify-li2013")
)
BASES = (DEMO, {**DEMO, "analysis": {"type": "transient"}}, PERIODIC)
"""Where a part of a case may stand: parts of an analysis leave out its type."""
TARGETS = set(re.findall(r"^([a-z-]+):", (PROJECT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
GROUP: Any = typer.main.get_command(app)
COMMANDS: Mapping[str, Any] = GROUP.commands
TAPLO = {"include", "exclude", "schema"}
"""The settings of taplo, which pages show beside case files."""
WHOLE = {name for name, field in Case.model_fields.items() if field.is_required()}


def of_kind(kind: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that asks a test for every block of a kind."""
    chosen = [
        pytest.param(block, id=f"{block.page.relative_to(PROJECT)}:{block.line}")
        for block in BLOCKS
        if block.kind == kind
    ]
    return pytest.mark.parametrize("block", chosen)


def test_blocks_of_all_kinds_are_found() -> None:
    """A reader of pages that finds nothing would let everything pass."""
    counts = {kind: sum(block.kind == kind for block in BLOCKS) for kind in ("toml", "sh", "python", "text")}
    assert counts["toml"] > 20
    assert counts["sh"] > 80
    assert counts["python"] >= 8


def test_a_block_is_what_its_first_line_says() -> None:
    """Case files, commands and Python are distinguished from equations and output."""
    assert kind_of("# a comment\n[[load]]   # another\n") == "toml"
    assert kind_of('region = { type = "stop" }') == "toml"
    assert kind_of("OMP_NUM_THREADS=2 environment/run mpirun -n 2 gapbeam run a.toml") == "sh"
    assert kind_of("from pathlib import Path\n") == "python"
    assert kind_of('history = gapbeam.open_results("a").history') == "python"
    assert kind_of("M a + C v + K u = f(t)") == "text"
    assert kind_of("s(t) = r(t) (scale)") == "text"


@of_kind("text")
def test_text_hides_no_code(block: Block) -> None:
    """Output and equations hold no table of a case file, no command and no import, which no test would read."""
    hidden = re.compile(r"\[{1,2}[a-z_.]+\]{1,2}\s*$|(environment/run |gapbeam )[a-z]|from [\w.]+ import |import \w+$")
    assert [line for line in block.text.splitlines() if hidden.match(line)] == []


# --- case files


RACK = tomllib.loads((PROJECT / "cases" / "scenes" / "rack.toml").read_text(encoding="utf-8"))


def merged(base: Mapping[str, Any], part: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables with those of a part in them; arrays and scalars are replaced."""
    both = dict(base)
    for key, value in part.items():
        old = base.get(key)
        fits = isinstance(old, Mapping) and isinstance(value, Mapping) and "type" not in value
        both[key] = merged(old, value) if fits else value  # type: ignore[arg-type]
    return both


def faults_of_part(part: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with the keys of a part in the first of `BASES` that leaves fewest faults.

    Keys of no table of their own are looked for in `[[support]]`.
    """
    if {"structure", "member", "pair", "point", "feedback"} & set(part):
        return [str(fault) for fault in check_types({**RACK, **part}, SceneCase)[1]]
    if not set(part) <= set(Case.model_fields) and set(part) <= set(Identification.model_fields):
        return [str(fault) for fault in check_types({**IDENTIFY, **part}, Identification)[1]]
    if not set(part) <= set(Case.model_fields):
        [support, *_] = BAFFLES["support"]
        part = {"support": [{**support, **part}]}
    found = [check_types(merged(base, part))[1] for base in BASES]
    return min(([str(fault) for fault in faults if fault.key[0] in part] for faults in found), key=len)


@of_kind("toml")
def test_cases_are_read(block: Block) -> None:
    """A whole case is read with all checks; the keys of a part are checked as if they stood in another case."""
    tables = tomllib.loads(block.text)
    if set(tables) >= WHOLE:
        assert read_case_text(block.text).time.end > 0.0
        return
    if set(tables) != TAPLO:
        assert faults_of_part(tables) == []


def test_parts_with_faults_are_refused() -> None:
    """Misspelled keys, unknown types and values out of range are found in parts, too."""
    for text in ('[[load]]\ntype = "gravitation"', "[contact]\nstifness = 1e9", "[support]\nfriction = -1.0", "x = 1"):
        assert faults_of_part(tomllib.loads(text)), text


# --- commands


def commands() -> Iterator[Any]:
    """Yield page and words of every command; what stands before the program is left out."""
    for block in BLOCKS:
        for number, words in enumerate(block.commands() if block.kind == "sh" else ()):
            name = f"{block.page.relative_to(PROJECT)}:{block.line}-{number}"
            yield pytest.param(block.page, program(words), id=name)


def program(words: list[str]) -> list[str]:
    """Return a command without what stands before it (variables, `environment/run`, `mpirun`) and takes its output."""
    words = list(takewhile(lambda word: word not in (">", "|"), words))
    while re.match(r"[A-Z_]+=", words[0]) or words[0] == "environment/run":
        words = words[1:]
    if words[0] == "mpirun":
        return words[words.index("gapbeam") if "gapbeam" in words else words.index("python3") :]
    return words


def parsed(words: list[str]) -> dict[str, Any]:
    """Return the parameters of a gapbeam command, parsed as the command line would, without running it.

    Raises:
        ClickException: No such command, an unknown option, or a value that is none.
    """
    if words[0].startswith("-"):
        known = {option for parameter in GROUP.params for option in parameter.opts} | {"--help"}
        return {} if words[0] in known else pytest.fail(f"no option {words[0]}")
    if words[0] not in COMMANDS:
        raise UsageError(f"no command {words[0]}")
    if "--help" in words:
        return {}
    return dict(COMMANDS[words[0]].make_context(words[0], words[1:]).params)


def case_of(page: Path, named: str) -> Path | str | None:
    """Return the case that a command names: a file, or the text of the first whole one that its page shows, if any."""
    if (PROJECT / named).exists():
        return PROJECT / named
    assert not named.startswith("cases/"), f"{named}: no such file"
    whole = [b.text for b in blocks(page) if b.kind == "toml" and set(tomllib.loads(b.text)) >= WHOLE]
    return next(iter(whole), None)


def read_with(case: Path | str | None, overrides: Iterable[str]) -> None:
    """Read a case with overrides; without a case there is nothing to read."""
    if isinstance(case, Path):
        read_case(case, list(overrides))
    elif case is not None:
        read_case_text(case, list(overrides))


@pytest.mark.parametrize(("page", "words"), commands())
def test_commands_are_known(page: Path, words: list[str]) -> None:
    """Programs, commands, options and values are there; the case of a command is read with its overrides."""
    name, *rest = words
    if name == "make":
        assert [word for word in rest if "=" not in word and word not in TARGETS] == []
    elif name == "python3" and "-m" in rest:
        module = rest[rest.index("-m") + 1]
        assert importlib.util.find_spec(module) is not None, module
    elif name == "gapbeam":
        given = parsed(rest)
        if "case" not in given:
            return
        if is_scene(PROJECT / str(given["case"])):
            read_scene(PROJECT / str(given["case"]), dict(one.split("=", 1) for one in given.get("override") or ()))
            return
        writes = rest[0] == "new"
        case, overrides = None if writes else case_of(page, str(given["case"])), list(given.get("override") or ())
        read_with(case, overrides)
        for text in given.get("vary") or given.get("axes") or ():
            axis = read_axis(text)
            read_with(case, [*overrides, f"{axis.key}={axis.values[0]}"])


@pytest.mark.parametrize(
    "words", [["rum", "a.toml"], ["run", "--tolerence", "2%", "a"], ["plot", "a", "--points", "x"], ["run"]]
)
def test_wrong_commands_are_refused(words: list[str]) -> None:
    """Unknown commands and options, values of the wrong type and missing arguments are faults."""
    with pytest.raises(ClickException):
        parsed(words)


# --- Python


def is_there(module: str, name: str) -> bool:
    """Return whether `from module import name` works."""
    if hasattr(importlib.import_module(module), name):
        return True
    try:
        importlib.import_module(f"{module}.{name}")
    except ModuleNotFoundError:
        return False
    return True


@of_kind("python")
def test_python_compiles_and_imports(block: Block) -> None:
    """Python is Python, and every name that it imports is there, as is every attribute of `gapbeam`."""
    import gapbeam

    tree = ast.parse(block.text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            assert [alias.name for alias in node.names if not is_there(str(node.module), alias.name)] == []
        elif isinstance(node, ast.Import):
            assert [alias.name for alias in node.names if importlib.util.find_spec(alias.name) is None] == []
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "gapbeam":
            assert hasattr(gapbeam, node.attr), node.attr
