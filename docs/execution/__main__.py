"""Execute the commands and the Python of pages: `make docs-run`, or `python3 -m docs.execution PAGE ...`."""

from __future__ import annotations

import sys
import tempfile
from argparse import ArgumentParser
from pathlib import Path

from docs.execution.page_steps import Step
from docs.execution.pages_to_run import pages_to_run
from docs.execution.step_runner import PROJECT, StepError, run_page


def shown(step: Step, seconds: float) -> None:
    """Print a step and its wall time."""
    first = step.file or next(line for line in step.text.splitlines() if line.strip())
    print(f"  {seconds:6.1f} s  line {step.line}: {first}", flush=True)


def main(pages: list[Path]) -> int:
    """Execute pages, go on after one that fails, and return the exit status."""
    failed = []
    for page in pages:
        print(page.relative_to(PROJECT), flush=True)
        with tempfile.TemporaryDirectory() as folder:
            try:
                run_page(page, Path(folder), shown)
            except StepError as error:
                failed.append(page)
                print(error, flush=True)
    print(f"{len(pages) - len(failed)} of {len(pages)} pages ran as they stand")
    return 1 if failed else 0


if __name__ == "__main__":
    parser = ArgumentParser(prog="python3 -m docs.execution", description=(__doc__ or "").partition(":")[0])
    parser.add_argument("pages", metavar="PAGE", nargs="*", type=Path, help="a page; by default all")
    chosen = [page.resolve() for page in parser.parse_args().pages]
    if lacking := next((page for page in chosen if not (page.is_file() and page.is_relative_to(PROJECT))), None):
        parser.error(f"{lacking}: no such page here; give one such as docs/tutorials/first-case.md")
    sys.exit(main(chosen or pages_to_run()))
