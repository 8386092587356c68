"""What is installed: one package, gapbeam, that runs the demo from an empty folder with nothing of a checkout."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.shared.command import PROJECT, alone
from tests.shared.processes import LONGEST

pytestmark = alone
# What .dockerignore lets into an image, and sdists hold.
SOURCES = ("gapbeam", "LICENSE", "MANIFEST.in", "README.md", "pyproject.toml")
FOLDERS = ("benchmarks", "cases", "docs", "environment", "meshes", "postprocess", "solver", "studies", "tests")
PROGRAM = """
import importlib.util, json, sys
from importlib.resources import files
import gapbeam
found = [name for name in sys.argv[1:] if importlib.util.find_spec(name) is not None]
case = files("gapbeam.cases") / "demo.toml"
outcome = gapbeam.run(case, {"time.end": 0.01, "model": {"type": "beam"}})
figures = gapbeam.plot(outcome)
print(json.dumps([gapbeam.__file__, found, outcome.exit_status, len(figures), gapbeam.__version__]))
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the folder of sdist and wheel, and what building them said."""
    folder = tmp_path_factory.mktemp("build")
    source = folder / "source"
    source.mkdir()
    for name in SOURCES:
        if (PROJECT / name).is_dir():
            shutil.copytree(
                PROJECT / name, source / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__")
            )  # fmt: skip
        else:
            shutil.copy(PROJECT / name, source / name)
    said = done([sys.executable, "-m", "build", "--no-isolation", "--outdir", folder / "dist", source], folder)
    return folder / "dist", said.stdout + said.stderr


@pytest.fixture(scope="module")
def python(built: tuple[Path, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the interpreter of a fresh environment with DOLFINx into which the wheel is installed."""
    place = tmp_path_factory.mktemp("fresh") / "venv"
    done([sys.executable, "-m", "venv", "--system-site-packages", place], place.parent)
    python = place / "bin" / "python"
    if sys.prefix != sys.base_prefix:  # a venv of a venv sees only what lies below it
        (site,) = place.glob("lib/python*/site-packages")
        (site / "parent.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    (wheel,) = built[0].glob("*.whl")
    done([python, "-m", "pip", "install", "--no-index", "--no-deps", "--force-reinstall", wheel], place.parent)
    return python


def done(command: list[str | Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command that sees nothing of the checkout; it must succeed."""
    hidden = ("PYTHONPATH", "PYTHONDONTWRITEBYTECODE")
    variables: Mapping[str, str] = {name: value for name, value in os.environ.items() if name not in hidden}
    said = subprocess.run(
        list(map(str, command)), cwd=folder, env=variables, capture_output=True, text=True, timeout=LONGEST, check=False
    )
    assert said.returncode == 0, said.stdout[-4000:] + said.stderr[-4000:]
    return said


@pytest.mark.slow(minutes=0.1)
def test_build_says_no_warning(built: tuple[Path, str]) -> None:
    """Neither deprecated metadata nor files that belong to no package."""
    assert len(list(built[0].iterdir())) == 2
    assert re.findall(r".*(?:warning:|Warning\b|deprecated).*", built[1]) == []


def test_the_wheel_holds_one_package_with_its_data(built: tuple[Path, str]) -> None:
    """Every module and data file of the checkout, once, below gapbeam/; nothing beside it."""
    (wheel,) = built[0].glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (metadata,) = [archive.read(name).decode() for name in names if name.endswith("METADATA")]
    installed = {name for name in names if ".dist-info/" not in name}
    here = {
        str(path.relative_to(PROJECT))
        for path in (PROJECT / "gapbeam").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert installed == here
    assert "License-Expression: MIT" in metadata
    assert "Classifier: Typing :: Typed" in metadata


@pytest.mark.slow
def test_the_wheel_runs_the_demo_from_an_empty_folder(python: Path, tmp_path: Path) -> None:
    """The package comes from the wheel; `import solver` and the like find nothing; schema and figures are there."""
    said = done([python, "-c", PROGRAM, *FOLDERS], tmp_path)
    place, found, status, figures, version = json.loads(said.stdout.splitlines()[-1])
    assert Path(place).is_relative_to(python.parents[1])
    assert (found, status, version) == ([], 0, "1.0.0")
    assert figures > 1
    assert (tmp_path / "results" / "demo" / "summary.json").is_file()
    schema = json.loads(done([python.with_name("gapbeam"), "schema"], tmp_path).stdout)
    assert schema["title"] == "gapbeam case file"
