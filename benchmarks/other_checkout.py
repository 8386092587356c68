"""Runs of a case by a checkout of the project, in a process of its own with the packages of this environment."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.table import RESULTS

HERE = Path(__file__).parents[1]


def run_by(checkout: Path, case: Path, overrides: Sequence[str], results: Path) -> None:
    """Run a case by a checkout, without error estimates, which earlier ones do not have.

    Args:
        checkout: Folder of the checkout.
        case: The case file.
        overrides: Of its keys, KEY=VALUE.
        results: Folder of the results, which is not there yet.

    Raises:
        RuntimeError: The run did not end with status 0.
    """
    sets = [word for key in overrides for word in ("--set", key)]
    command = [sys.executable, "-m", "gapbeam", "run", str(case), *sets, "--output", str(results)]
    there = os.environ | {"PYTHONPATH": str(checkout), "GAPBEAM_ERRORS": "none"}
    done = subprocess.run(command, cwd=checkout, env=there, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: status {done.returncode}\n{done.stderr}")


def options_with_other(description: str | None) -> argparse.ArgumentParser:
    """Return the options that all comparisons with another checkout have."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--other", type=Path, required=True, help="folder of the other checkout")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the table")
    return parser
