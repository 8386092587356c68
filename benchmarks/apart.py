"""Measurements in processes of their own, so that each has its own peak of memory, and fits of what they cost."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

Figures = dict[str, float]


def measured_apart(module: str, *arguments: str, timeout: float = 3600.0) -> Figures:
    """Run a module with arguments in a process of its own and return the figures that it printed last.

    Raises:
        RuntimeError: It failed; the message holds the end of what it said.
    """
    found: Figures = json_of([sys.executable, "-m", module, *arguments], timeout)
    return found


def json_of(command: Sequence[str], timeout: float = 3600.0) -> Any:
    """Run a command and return what it printed last, in JSON; errors as in `output_of`."""
    return json.loads(output_of(command, timeout).strip().splitlines()[-1])


def output_of(command: Sequence[str], timeout: float = 3600.0) -> str:
    """Run a command and return its standard output.

    Raises:
        RuntimeError: It failed; the message holds the end of what it said.
    """
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed:\n{(done.stdout + done.stderr)[-2000:]}")
    return done.stdout


def print_figures(figures: Figures) -> None:
    """Print figures, with the peak of resident memory of this process, for `measured_apart`."""
    print(json.dumps(figures | {"memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0}))


def exponents(found: Sequence[Figures], names: Sequence[str]) -> dict[str, float]:
    """Return b of the fit cost = a DOFs^b for some figures of processes that also printed their DOFs."""
    dofs = [one["dofs"] for one in found]
    return {name: exponent(dofs, [one[name] for one in found]) for name in names}


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return b of the least-squares fit cost = a size^b."""
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])
