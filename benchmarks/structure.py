"""Layout of the source at several commits side by side: where files lie, what repeats, who imports whom.

environment/run python3 -m benchmarks.structure [COMMIT ...]; of the files as they are where no commit is given
"""

from __future__ import annotations

import argparse
import ast
import io
import statistics
import subprocess
import tarfile
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.table import RESULTS, Table

PROJECT = Path(__file__).parents[1]
PACKAGES = ("gapbeam", "studies", "solver", "meshes", "postprocess")
BELOW = {
    "gapbeam": {"studies", "solver", "meshes", "postprocess"},
    "studies": {"solver", "meshes", "postprocess"},
    "solver": {"meshes"},
    "meshes": set[str](),
    "postprocess": set[str](),
}
"""Packages that each package may import; postprocess also reads the names of records from solver."""
RECORDS = "solver.record_table"
EXTENDED = ("load", "law", "damper", "scheme", "formulation", "effective")
SHAPING = ("model", "support", "joint")
"""Names of variables that hold a choice of the case: asking for their class is asking which one was chosen."""

MEASURES = (
    "files directly in solver/",
    "folders in solver/",
    "files",
    "lines",
    "lines of solver/",
    "median lines of a file",
    "lines of the longest file",
    "file names that repeat",
    "class names that repeat",
    "imports of a package above",
    "questions for the class of a load, law, scheme or formulation",
    "questions for the class of a model, support or joint",
)


def main() -> int:
    """Measure the commits, write the table, and return 0."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("commits", nargs="*", help="commits to measure; none: the files as they are")
    parser.add_argument("--output", type=Path, default=RESULTS, help=f"folder of the tables (default {RESULTS})")
    chosen = parser.parse_args()
    found = {}
    for commit in chosen.commits:
        with tree_of(commit) as folder:
            found[commit] = measured(folder)
    found = found or {"now": measured(PROJECT)}
    rows = tuple[tuple[str | int, ...], ...](
        (measure, *(one[measure] for one in found.values())) for measure in MEASURES
    )
    Table("structure", "Layout of the source", ("measure", *found), rows).write(chosen.output)
    return 0


@contextmanager
def tree_of(commit: str) -> Iterator[Path]:
    """Yield a folder with the files of a commit.

    Args:
        commit: Of this repository.
    """
    there = subprocess.run(
        ["git", "ls-tree", "--name-only", commit], cwd=PROJECT, check=True, capture_output=True, text=True
    ).stdout.split()
    command = ["git", "archive", commit, *(package for package in PACKAGES if package in there)]
    packed = subprocess.run(command, cwd=PROJECT, check=True, capture_output=True).stdout
    with tempfile.TemporaryDirectory() as folder, tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(folder, filter="tar")
        yield Path(folder)


def measured(folder: Path) -> dict[str, int]:
    """Return the measures of the source in a folder.

    Args:
        folder: With the packages side by side.
    """
    files = {package: files_of(folder, package) for package in PACKAGES}
    every = [file for some in files.values() for file in some]
    trees = {file: ast.parse(file.read_text(encoding="utf-8")) for file in every}
    lines = {file: len(file.read_text(encoding="utf-8").splitlines()) for file in every}
    solver = [file for file in files["solver"] if file.name != "__init__.py"]
    return dict(
        zip(
            MEASURES,
            (
                sum(file.parent.name == "solver" for file in solver),
                len({file.parent for file in solver if file.parent.name != "solver"}),
                len(every),
                sum(lines.values()),
                sum(lines[file] for file in files["solver"]),
                round(statistics.median(lines[file] for file in every if file.name != "__init__.py")),
                max(lines.values()),
                repeated([file.stem for file in every if not file.stem.startswith("__")]),
                repeated([name for tree in trees.values() for name in classes(tree)]),
                sum(upward(package, trees[file]) for package, some in files.items() for file in some),
                sum(questions(tree, EXTENDED) for tree in trees.values()),
                sum(questions(tree, SHAPING) for tree in trees.values()),
            ),
            strict=True,
        )
    )


def files_of(folder: Path, package: str) -> list[Path]:
    """Return the modules of a package, in gapbeam or, as in earlier commits, beside it; links are not followed."""
    place = folder / "gapbeam" / package
    if package == "gapbeam" or place.is_symlink() or not place.is_dir():
        place = folder / package
    others = [folder / "gapbeam" / other for other in PACKAGES] if package == "gapbeam" else []
    found = sorted(place.rglob("*.py"))
    return [
        file
        for file in found
        if not any(parent.is_symlink() or parent in others for parent in file.parents if parent != folder)
    ]


def repeated(names: Sequence[str]) -> int:
    """Return the number of names that occur more than once."""
    return sum(count > 1 for count in Counter(names).values())


def classes(tree: ast.Module) -> list[str]:
    """Return the names of the public classes of a module."""
    return [node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef) and not node.name.startswith("_")]


def upward(package: str, tree: ast.Module) -> int:
    """Return the number of imports by which a module names a package above its own."""
    count = 0
    for node in ast.walk(tree):
        modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        modules += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        for module in modules:
            name = module.removeprefix("gapbeam.")
            target = name.partition(".")[0] if name.partition(".")[0] in PACKAGES else module.partition(".")[0]
            if target in PACKAGES and target not in {package, *BELOW[package]} and name != RECORDS:
                count += 1
    return count


def questions(tree: ast.Module, choices: Sequence[str]) -> int:
    """Return the number of times that a module asks for the class of some choices: isinstance(load, ...)."""
    count = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance":
            asked = node.args[0]
            last = asked.attr if isinstance(asked, ast.Attribute) else getattr(asked, "id", "")
            count += last in choices
    return count


if __name__ == "__main__":
    raise SystemExit(main())
