"""A command that is shown to be copied is made word by word, so that a shell takes every path as it is."""

from __future__ import annotations

import ast
import re
import subprocess
from pathlib import Path

import pytest

from gapbeam.postprocess.shell_command import shell_command

PROJECT = Path(__file__).parents[2]
FILES = sorted(path for path in (PROJECT / "gapbeam").glob("**/*.py"))
COMMAND = re.compile(
    r"\bgapbeam (new|view|watch|run|check|"
    r"render|plot|film|export|report|compare|sweep|modes|stability|life|identify|tradeoff|atlas)\b"
)


def unquoted(text: str) -> list[int]:
    """Return the lines where a value is put behind the name of a command."""
    lines = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.JoinedStr):
            pieces = [piece.value if isinstance(piece, ast.Constant) else "\0" for piece in node.values]
            whole = "".join(map(str, pieces))
            lines += [
                node.lineno for found in COMMAND.finditer(whole) if re.match(r"[^;:,.)]*\0", whole[found.end() :])
            ]
        elif isinstance(node, ast.List):
            words = [item.value for item in node.elts if isinstance(item, ast.Constant)]
            lines += [node.lineno for word in words if isinstance(word, str) and COMMAND.fullmatch(word)]
    return lines


def test_the_rule_sees_what_it_forbids() -> None:
    assert unquoted('x = f"gapbeam render {folder}"') == [1]
    assert unquoted('x = f"run gapbeam tradeoff {case} first"') == [1]
    assert unquoted('x = " ".join(["gapbeam report", *map(str, results)])') == [1]
    assert unquoted('x = f"run gapbeam check first; {case} has faults"') == []


@pytest.mark.parametrize("path", [pytest.param(path, id=str(path.relative_to(PROJECT))) for path in FILES])
def test_commands_are_quoted(path: Path) -> None:
    assert unquoted(path.read_text()) == [], "use gapbeam.postprocess.shell_command"


@pytest.mark.parametrize("name", ["x; touch PWNED", "$(touch PWNED)", "it's", "two words", "-rf", "a\nb", "`id`", "*"])
def test_a_shell_takes_every_path_as_it_is(name: str) -> None:
    """The shell itself is asked what it makes of the command."""
    made = shell_command("printf", "%s\\0", Path(name) / "case.toml")
    done = subprocess.run(["sh", "-c", made], capture_output=True, text=True, check=True)
    assert Path(done.stdout.removesuffix("\0")) == Path(name) / "case.toml"
