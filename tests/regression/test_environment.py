"""What environment/run passes on and refuses; the lists of what gapbeam needs agree with one another."""

import importlib.metadata
import os
import re
import shutil
import signal
import subprocess
import tomllib
from itertools import chain
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

from tests.shared.command import alone
from tests.shared.processes import LONGEST

project = Path(__file__).resolve().parents[2]
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
        timeout=LONGEST,
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
    shown = call("sh", "-c", 'echo "$COLOR"; pwd', cwd=tmp_path, COLOR="green")
    assert shown.stdout.split() == ["green", str(tmp_path)]


# Where there is no bubblewrap: something else that waits for what it starts in mounts of its own.
BWRAP = """#!/bin/sh
while [ "$1" != -- ]; do shift; done; shift
unshare --mount -- "$@" &
wait $!
"""
# proot ignores signals, and waits for what it starts.
PROOT = """#!/bin/sh
trap '' TERM HUP USR1 INT
"$@" &
wait $!
"""
# Says its number once it listens, and the signals that it hears, each of them, before it ends with 7.
LISTENS = """
hear() { echo "$1"; status=7; }
for name in TERM HUP USR1 INT; do trap "hear $name" $name; done
echo $$
for _ in $(seq 60000); do sleep 0.02; [ -z "$status" ] || break; done
sleep 0.2
exit $status
"""
STEPS = project / "environment" / "steps"


def stand_in(folder, name, text):
    """A program instead of another one, and where to look for it first."""
    if shutil.which(name) is None:
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    return f"{folder}:{os.environ['PATH']}"


def signalled(words, path, name, to_all):
    """What a shell that was started by some words heard: its number, the signals, its status, the number we know."""
    started = subprocess.Popen(
        [*words, "env", "--default-signal=TERM,HUP,USR1,INT", "sh", "-c", LISTENS],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PATH": path},
    )
    first = started.stdout.readline()
    assert first, f"ended with {started.wait()} before it said its number"
    number = int(first)
    (os.killpg if to_all else os.kill)(started.pid, getattr(signal, f"SIG{name}"))
    heard, _ = started.communicate(timeout=LONGEST)
    return number, heard.split(), started.returncode, started.pid


@alone
@pytest.mark.parametrize("to_all", [False, True])
@pytest.mark.parametrize("name", ["TERM", "HUP", "USR1", "INT"])
def test_signals_reach_the_command_once(name, to_all, tmp_path):
    """Nothing stands in front of a command in a root file system: its process is the one that was started."""
    if subprocess.run(["unshare", "--user", "--map-root-user", "--mount", "true"], capture_output=True).returncode:
        pytest.skip("no namespaces here")
    user, group = os.getuid(), os.getgid()
    words = [STEPS / "become.sh", str(user), str(group), "--dev-bind", "/", "/", "--"]
    number, heard, status, started = signalled(words, stand_in(tmp_path, "bwrap", BWRAP), name, to_all)
    assert (number, heard, status) == (started, [name], 7)


@alone
@pytest.mark.parametrize("to_all", [False, True])
def test_signals_pass_proot(to_all, tmp_path):
    """A program that ignores signals: they reach the command through the script before it, and once."""
    words = [STEPS / "forward.sh", tmp_path / "tracer", "--"]
    (tmp_path / "tracer").write_text(PROOT)
    (tmp_path / "tracer").chmod(0o755)
    _, heard, status, _ = signalled(words, os.environ["PATH"], "TERM", to_all)
    assert (heard, status) == (["TERM"], 7)


def test_help_names_every_variable():
    shown = call("--help")
    assert shown.returncode == 0
    assert {"GAPBEAM_ENVIRONMENT", "GAPBEAM_SUITE", "XDG_CACHE_HOME"} <= set(shown.stdout.split())


def test_no_command_is_an_error():
    shown = call()
    assert shown.returncode == 2
    assert "Usage" in shown.stderr


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"GAPBEAM_ENVIRONMENT": "docker"}, "expected auto, host, wheel, apt, root or none"),
        ({"GAPBEAM_ENVIRONMENT": "apt", "GAPBEAM_SUITE": "sid"}, "sid needs the root file system"),
    ],
)
def test_nonsense_is_refused_with_what_was_expected(variables, message):
    shown = call("true", GAPBEAM_INSIDE="", **variables)
    assert shown.returncode == 1
    assert message in shown.stderr


CHOICE = """
here=$1 project=${1%/*} wish=$2 suite=trixie works=$3
source "$here/steps/common.sh" && source "$here/steps/setup.sh"
use_host() { reason="no DOLFINx"; return 1; }
use_wheel() { way=wheel reason="pip failed"; $works; }
use_apt() { reason="no Debian 13"; return 1; }
use_root() { way=root; }
choose_way && echo "$way"
"""


def bash(program, *arguments, **variables):
    """What a program of bash says."""
    words = ["bash", "-euc", program, "bash", *map(str, arguments)]
    done = subprocess.run(words, env={**os.environ, **variables}, capture_output=True, text=True, timeout=LONGEST)
    return done.stdout.strip() or done.stderr


@pytest.mark.parametrize(
    ("wish", "works", "said"),
    [
        ("gapbeam", "true", "wheel"),
        ("gapbeam", "false", "root"),
        ("auto", "true", "root"),
        ("wheel", "true", "wheel"),
        ("wheel", "false", "gapbeam: error: GAPBEAM_ENVIRONMENT=wheel: pip failed\n"),
    ],
)
def test_commands_of_gapbeam_take_the_wheel_and_tests_debian(wish, works, said):
    """Debian's packages come after the wheel, and by themselves where it cannot be had."""
    assert bash(CHOICE, STEPS.parent, wish, works) == said


@pytest.mark.parametrize(("works", "found"), [(("python3.13",), "python3.13"), (("python3", "python3.12"), "python3")])
def test_the_wheel_takes_the_first_python_that_is_new_enough(works, found, tmp_path):
    """Of those on the path; one that does not start, as a stand-in of pyenv does, is passed over."""
    for name in ("python3", "python3.14", "python3.13", "python3.12"):
        (tmp_path / name).write_text(f"#!/bin/sh\nexit {0 if name in works else 1}\n")
        (tmp_path / name).chmod(0o755)
    program = 'source "$1/wheel.sh" && python_of_wheel'
    assert bash(program, STEPS, PATH=f"{tmp_path}:{os.environ['PATH']}") == str(tmp_path / found)


def test_a_wheel_that_is_set_up_serves_commands_of_gapbeam(tmp_path):
    """As long as no whole environment is ready; its venv comes first on the path, before it what the checkout has."""
    venv, checkout, ready = tmp_path / "venv", tmp_path / "checkout", tmp_path / "gapbeam" / "ready"
    for folder in (venv, checkout, ready):
        folder.mkdir(parents=True)
    (venv / "complete").touch()
    variables = {"XDG_CACHE_HOME": str(tmp_path), "GAPBEAM_ENVIRONMENT": "auto", "GAPBEAM_INSIDE": ""}
    program = 'here=$1 project=${1%/*} wish=gapbeam suite=trixie; source "$here/steps/common.sh"; fingerprint'
    stamp = ready / bash(program, STEPS.parent, **variables)
    stamp.write_text(f"wheel\n\n{venv}\n{checkout}\n\n")
    shown = call("sh", "-c", 'echo "$VIRTUAL_ENV $PATH"', "gapbeam", "run", **variables)
    assert shown.stderr == ""
    assert shown.stdout.startswith(f"{venv} {STEPS.parent / 'bin'}:{venv / 'bin'}:")


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


CONDA_NAMES = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}
"""What conda-forge calls packages that PyPI calls otherwise."""


def conda_pins(lines):
    """The limits of each package in lines of a conda list: name, limits without order; builds are left out."""
    found = {}
    for line in lines:
        name, _, limits = line.partition(" ")
        found[name] = set(limits.split(",")) - {""} if "real" not in limits else set()
    return found


def needed_pins():
    """The same of what pyproject.toml asks for with all extras, DOLFINx's wheel left out."""
    needs = [Requirement(need) for need in (*about["dependencies"], *chain(*about["optional-dependencies"].values()))]
    listed = (need for need in needs if need.name not in ("dolfinx-solver-real", "gapbeam"))
    return {CONDA_NAMES.get(need.name, need.name): {str(limit) for limit in need.specifier} for need in listed}


def test_every_dependency_has_an_oldest_release():
    assert [name for name, limits in needed_pins().items() if not any(limit.startswith(">=") for limit in limits)] == []


def environment_pins():
    listed = yaml.safe_load((project / "environment" / "conda.yml").read_text())["dependencies"]
    return conda_pins(line for line in listed if isinstance(line, str))


def recipe():
    return yaml.safe_load((project / "environment" / "recipe" / "recipe.yaml").read_text())


def recipe_pins():
    asked = recipe()["requirements"]
    return conda_pins([*asked["run"], *asked["run_constraints"]])


@pytest.mark.parametrize("listed", [environment_pins, recipe_pins])
def test_conda_lists_hold_everything_that_gapbeam_needs(listed):
    """No name is missing, and no limit is wider than that of pyproject.toml."""
    found = listed()
    wrong = {name: limits for name, limits in needed_pins().items() if not limits <= found.get(name, {"missing"})}
    assert {name: found.get(name, "missing") for name in wrong} == {}


def test_the_recipe_agrees_with_the_project_and_the_environment():
    """Name, version, oldest Python, license, command, build tools; its limits are those of environment/conda.yml."""
    made = recipe()
    values = made["context"]
    command, target = next(iter(about["scripts"].items()))
    assert (values["name"], values["version"]) == (about["name"], about["version"])
    assert f">={values['python_min']}" == about["requires-python"]
    assert (made["about"]["license"], made["about"]["summary"]) == (about["license"], about["description"])
    assert (project / "environment" / "recipe" / made["source"]["path"] / made["about"]["license_file"]).is_file()
    assert made["build"]["python"]["entry_points"] == [f"{command} = {target}"]
    tools = tomllib.loads((project / "pyproject.toml").read_text())["build-system"]["requires"]
    assert {f"{need.name} {need.specifier}" for need in map(Requirement, tools)} <= set(made["requirements"]["host"])
    environment = environment_pins()
    runs = {name: limits for name, limits in recipe_pins().items() if name not in ("__linux", "python")}
    assert runs == {name: environment[name] for name in runs}


def test_one_thread_a_rank():
    assert os.environ.get("OMP_NUM_THREADS"), "run the tests through environment/run (make test)"


def test_bytecode_is_kept_outside_of_the_sources():
    assert "PYTHONPYCACHEPREFIX" in os.environ, "run the tests through environment/run (make test)"
    assert not Path(os.environ["PYTHONPYCACHEPREFIX"]).is_relative_to(project)
    assert "PYTHONDONTWRITEBYTECODE" not in os.environ
