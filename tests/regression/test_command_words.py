"""Mistyped commands and options are answered with what was meant; shells complete them."""

from __future__ import annotations

import os
import shlex
import subprocess
from pathlib import Path

import pytest
import typer

from gapbeam.command_line import app
from gapbeam.commands.command_group import EXAMPLES, SuggestingGroup
from tests.shared.command import PROJECT, alone, called_in_turn, process_environment
from tests.shared.processes import LONGEST

pytestmark = alone

MISTYPED = {
    ("rnu", "cases/demo.toml"): "No such command 'rnu'; did you mean: gapbeam run?",
    ("wacth", "results/demo"): "did you mean: gapbeam watch?",
    ("simulate", "cases/demo.toml"): "did you mean: gapbeam run?",
    ("cases/demo.toml",): "did you mean: gapbeam run cases/demo.toml?",
    ("cases",): "put a command before the folder",
    ("zzzz",): "expected one of: run, check",
    ("run", "cases/demo.toml", "--overwite"): "--overwrite",
    ("render", "x", "--sise", "640x360"): "--size",
    ("new", "x.toml", "--tempalte", "demo"): "--template",
}


def test_what_was_meant() -> None:
    """Status 2, and the word that was probably meant."""
    for done, said in zip(called_in_turn(*MISTYPED), MISTYPED.values(), strict=True):
        assert done.returncode == 2
        assert said in " ".join(done.stderr.split()), done.args
        assert done.stdout == ""


def bash(script: str, home: Path) -> subprocess.CompletedProcess[str]:
    """Run a script of bash that finds gapbeam as a user does."""
    path = f"{PROJECT / 'environment' / 'bin'}:{os.environ['PATH']}"
    environment = {**process_environment(), "PATH": path, "HOME": str(home), "PYTHONPATH": str(PROJECT)}
    return subprocess.run(
        ["bash", "--norc", "-c", script], cwd=PROJECT, env=environment, capture_output=True, text=True, timeout=LONGEST,
        check=False,
    )  # fmt: skip


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("gapbeam ru", {"run"}),
        ("gapbeam run --over", {"--overwrite"}),
        ("gapbeam new my.toml --template tube", {"tube-baffles", "tube-holes", "tube-turbulence"}),
        ("gapbeam plot results --window h", {"hann"}),
    ],
)
def test_bash_completes(words: str, completed: set[str], tmp_path: Path) -> None:
    """The function that the command prints for bash, called as bash calls it."""
    last = len(words.split()) - 1
    script = f"""
        source <(_GAPBEAM_COMPLETE=source_bash gapbeam)
        COMP_WORDS=({words}) COMP_CWORD={last}
        _gapbeam_completion gapbeam
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = bash(script, tmp_path)
    assert (set(done.stdout.split()), done.stderr) == (completed, "")


def test_completion_is_installed(tmp_path: Path) -> None:
    """What --install-completion leaves for bash completes in a new shell."""
    done = bash("gapbeam --install-completion; true", tmp_path)
    assert "completion installed" in done.stdout, done.stderr
    script = (
        "source ~/.bashrc; COMP_WORDS=(gapbeam wat) COMP_CWORD=1; _gapbeam_completion gapbeam; echo ${COMPREPLY[@]}"
    )
    assert bash(script, tmp_path).stdout.split() == ["watch"]


def test_help_ends_with_an_example_that_can_be_typed() -> None:
    """Every command has one, with options and arguments that it takes."""
    group = typer.main.get_command(app)
    assert isinstance(group, SuggestingGroup)
    assert set(EXAMPLES) == set(group.commands)
    for name, line in EXAMPLES.items():
        program, first, *words = shlex.split(line.partition(" > ")[0])
        assert (program, first) == ("gapbeam", name)
        command = group.get_command(None, name)
        assert command is not None
        assert command.epilog == f"Example: {line}"
        command.make_context(name, words)
