"""What environment/run passes on and refuses; the lists of what gapbeam needs agree with one another."""

import importlib.metadata
import os
import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

project = Path(__file__).resolve().parents[1]
run = project / "environment" / "run"
about = tomllib.loads((project / "pyproject.toml").read_text())["project"]


def call(*arguments, cwd=project, **variables):
    """environment/run in the environment that is there already: setting one up is not for a test."""
    return subprocess.run(
        [run, *arguments],
        env={**os.environ, "GAPBEAM_ENVIRONMENT": "none", **variables},
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=240,
    )


def names(file):
    """The lines of a list, without comments."""
    lines = (project / "environment" / file).read_text().splitlines()
    return [name for line in lines if (name := line.partition("#")[0].strip())]


def test_exit_status_passes_through():
    assert call("sh", "-c", "exit 7").returncode == 7


def test_arguments_pass_through_as_they_are():
    words = ["two words", "", "*", "'quoted' \"twice\""]
    assert call("printf", "<%s>", *words).stdout == "".join(f"<{word}>" for word in words)


def test_variables_and_folder_pass_through(tmp_path):
    told = call("sh", "-c", 'echo "$COLOR"; pwd', cwd=tmp_path, COLOR="green")
    assert told.stdout.split() == ["green", str(tmp_path)]


def test_help_names_every_variable():
    told = call("--help")
    assert told.returncode == 0
    assert {"GAPBEAM_ENVIRONMENT", "GAPBEAM_SUITE", "XDG_CACHE_HOME"} <= set(told.stdout.split())


def test_no_command_is_an_error():
    told = call()
    assert told.returncode == 2
    assert "Usage" in told.stderr


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"GAPBEAM_ENVIRONMENT": "docker"}, "expected auto, host, apt, root or none"),
        ({"GAPBEAM_ENVIRONMENT": "apt", "GAPBEAM_SUITE": "sid"}, "sid needs the root file system"),
    ],
)
def test_nonsense_is_refused_with_what_was_expected(variables, message):
    told = call("true", GAPBEAM_INSIDE="", **variables)
    assert told.returncode == 1
    assert message in told.stderr


@pytest.mark.parametrize("file", ["packages.txt", "packages-development.txt"])
def test_package_lists_hold_one_debian_name_a_line(file):
    listed = names(file)
    assert len(listed) == len(set(listed))
    assert [name for name in listed if not re.fullmatch(r"[a-z0-9][a-z0-9+.-]+", name)] == []


@pytest.mark.parametrize("file", ["requirements.txt", "requirements-development.txt"])
def test_python_parts_are_pinned(file):
    assert [line for line in names(file) if not re.fullmatch(r"[\w-]+==[\w.]+", line)] == []


def test_everything_that_gapbeam_needs_is_here():
    lacking = []
    for need in map(Requirement, about["dependencies"]):
        try:
            found = importlib.metadata.version(need.name)
        except importlib.metadata.PackageNotFoundError:
            found = "nothing"
        if found == "nothing" or not need.specifier.contains(found, prereleases=True):
            lacking.append(f"{need}: found {found}")
    assert lacking == []


def test_gapbeam_knows_its_version():
    assert importlib.metadata.version("gapbeam") == about["version"]


def test_conda_list_holds_everything_that_gapbeam_needs():
    text = (project / "environment" / "conda.yml").read_text()
    listed = set(re.findall(r"^  - ([\w-]+)", text, re.MULTILINE))
    other_names = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}
    needed = {Requirement(need).name for need in about["dependencies"]}
    assert {other_names.get(name, name) for name in needed} - listed == set()


def test_one_thread_a_rank():
    assert os.environ.get("OMP_NUM_THREADS"), "run the tests through environment/run (make test)"
