"""Execute what pages show, each page in a folder of its own that holds the shipped cases and nothing else."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from docs.execution.page_steps import Step, page_steps

PROJECT = Path(__file__).parents[2]
LIMIT = 900.0
"""Seconds after which a step is taken to hang."""


NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?![\w])")


class StepError(AssertionError):
    """A command or program of a page did not end, or print, as the page says."""


def refuse_other_output(step: Step, printed: str) -> None:
    """Compare what a page shows as output with what was printed: the same words, and numbers within a tolerance.

    Raises:
        StepError: Words that were not printed in this order, or a number that is off.
    """
    shown = [line for line in step.text.splitlines() if line.strip()]
    numbers = [float(found) for line in shown for found in NUMBER.findall(line)]
    lines = [r"\s+".join(map(_pattern, NUMBER.sub("\0", line).split())) for line in shown]
    found = re.search(r"\s*(?:\n.*)*?\s*".join(lines), printed)
    if found is None:
        raise StepError(f"line {step.line}: the page shows\n{step.text}\nbut this was printed:\n{printed[-3000:]}")
    for said, now in zip(numbers, map(float, found.groups()), strict=True):
        if abs(now - said) > step.within * abs(said):
            raise StepError(f"line {step.line}: the page shows {said:g}, {now:g} was printed (within {step.within:g})")


def _pattern(word: str) -> str:
    """Return the pattern of a word whose numbers are zero bytes."""
    return re.escape(word).replace("\x00", f"({NUMBER.pattern})").replace(re.escape("..."), r".*?")


def prepared(folder: Path) -> None:
    """Copy into a folder what the commands of pages find in a checkout."""
    shutil.copytree(PROJECT / "cases", folder / "cases", ignore=shutil.ignore_patterns("__pycache__"))


def environment(folder: Path) -> Mapping[str, str]:
    """Return the variables of a step: `gapbeam` is the one of this checkout; errors are estimated where a page asks."""
    starter = folder / ".bin" / "gapbeam"
    if not starter.exists():
        starter.parent.mkdir(exist_ok=True)
        starter.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m gapbeam "$@"\n', encoding="utf-8")
        starter.chmod(0o755)
    paths = os.pathsep.join([str(PROJECT), *filter(None, [os.environ.get("PYTHONPATH")])])
    path = os.pathsep.join([str(starter.parent), os.environ.get("PATH", "")])
    return {**os.environ, "GAPBEAM_ERRORS": "none", "PATH": path, "PYTHONPATH": paths}


def run_step(step: Step, folder: Path) -> str:
    """Execute one step in a folder and return what it wrote to the terminal.

    Raises:
        StepError: Another exit status than the page says, or no end within `LIMIT`.
    """
    if step.kind == "file":
        (folder / step.file).write_text(step.text, encoding="utf-8")
        return ""
    assert step.kind != "output", "compared with what the step before printed"
    command = [sys.executable, "-c", step.text] if step.kind == "python" else ["sh", "-c", step.text]
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=dict(environment(folder)),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            timeout=LIMIT,
        )
    except subprocess.TimeoutExpired as late:
        raise StepError(f"line {step.line}: no end after {LIMIT:.0f} s: {step.text}") from late
    if done.returncode != step.status:
        raise StepError(
            f"line {step.line}: exit status {done.returncode}, expected {step.status}: {step.text}\n"
            f"{done.stdout[-3000:]}"
        )
    return done.stdout


def run_page(page: Path, folder: Path, report: Callable[[Step, float], None] = lambda *_: None) -> int:
    """Execute what a page shows in an empty folder, and return how many steps that were.

    Args:
        page: A page of the documentation.
        folder: An empty folder, to be removed by the caller.
        report: Called after each step with the seconds that it took.

    Raises:
        StepError: The first step that did not end, or print, as the page says.
    """
    prepared(folder)
    steps, printed = page_steps(page), ""
    for step in steps:
        begin = time.perf_counter()
        if step.kind == "output":
            refuse_other_output(step, printed)
        else:
            printed = run_step(step, folder)
        report(step, time.perf_counter() - begin)
    return len(steps)
