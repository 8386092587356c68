"""Execute what pages show, each page in a folder of its own that holds the shipped cases and nothing else."""

from __future__ import annotations

import os
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


class StepError(AssertionError):
    """A command or program of a page did not end as the page says."""


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
        StepError: The first step that did not end as the page says.
    """
    prepared(folder)
    steps = page_steps(page)
    for step in steps:
        begin = time.perf_counter()
        run_step(step, folder)
        report(step, time.perf_counter() - begin)
    return len(steps)
