"""The command line where it is used wrongly, and the commands that draw."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gapbeam
from tests.shared.command import DEMO, RATTLE, alone, called, called_in_turn

pytestmark = alone

COMMANDS = ("new", "view", "run", "watch", "check", "schema", "plot", "render")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four periods of a rattling beam."""
    outcome = gapbeam.run(DEMO, (*RATTLE, "time.end=0.04"), tmp_path_factory.mktemp("drawn") / "rattle")
    assert outcome.exit_status == 0
    return outcome.folder


def assert_refused(done: subprocess.CompletedProcess[str], *message: str) -> None:
    """Check that a call ended with the status of a faulty input, a message, and no trace."""
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.strip()
    assert not done.stderr.startswith("\n")
    assert done.stdout == ""
    for words in message:
        assert words in done.stderr


def test_without_arguments_it_reports_its_commands() -> None:
    """The help, with every command; click 8.1 ends with 0 then, click 8.2 with 2."""
    done = called()
    assert done.returncode in (0, 2)
    assert "Traceback" not in done.stderr
    assert all(command in done.stdout + done.stderr for command in COMMANDS)


def test_help_names_every_command() -> None:
    """Both ways to ask for it: exit status 0, all commands, nothing on standard error."""
    for done in called_in_turn(["--help"], ["-h"]):
        assert (done.returncode, done.stderr) == (0, "")
        assert all(command in done.stdout for command in COMMANDS)


def test_help_of_every_command() -> None:
    """Exit status 0, and every option and argument by name."""
    options = {
        "new": ("--template", "--list", "--yes", "CASE"),
        "view": ("--set", "--output", "--size", "CASE"),
        "watch": ("--once", "--interval", "RESULTS"),
        "run": ("--set", "--output", "--overwrite", "CASE"),
        "check": ("--set", "CASE"),
        "schema": ("--help",),
        "plot": ("--output", "--format", "--probe", "--periods", "RESULTS"),
        "render": ("--output", "--scale", "--film", "--no-film", "--size", "RESULTS"),
    }
    assert set(options) == set(COMMANDS)
    for done in called_in_turn(*([command, "--help"] for command in options)):
        assert (done.returncode, done.stderr) == (0, "")
        assert [option for option in options[done.args[0]] if option not in done.stdout] == []


def test_wrong_words_are_refused() -> None:
    """Unknown commands and options, missing and superfluous arguments, bad overrides: status 2, named, no trace."""
    calls = {
        ("walk",): "No such command 'walk'",
        ("--fast",): "No such option: --fast",
        ("run", DEMO, "--fast"): "No such option: --fast",
        ("run",): "Missing argument 'CASE'",
        ("run", DEMO, "--set"): "requires an argument",
        ("run", DEMO, DEMO): "unexpected extra argument",
        ("run", DEMO, "--set", "beam.lenght=0.5"): "length",
        ("run", DEMO, "--set", "beam.length"): "KEY=VALUE",
        ("schema", "more"): "unexpected extra argument",
        ("plot",): "Missing argument 'RESULTS'",
    }
    for done, message in zip(called_in_turn(*calls), calls.values(), strict=True):
        assert_refused(done, message)


@pytest.mark.parametrize(
    ("words", "behind"),
    [
        (("run", DEMO, "--output", ""), "behind --output"),
        (("run", DEMO, "--output="), "behind --output="),
        (("run", ""), "behind run"),
        (("plot", " "), "behind plot"),
    ],
)
def test_empty_words_are_refused(words: tuple[str | Path, ...], behind: str) -> None:
    """A variable of the shell that is not set does not fill the folder that one stands in."""
    before = set(Path.cwd().iterdir())
    assert_refused(called(*words), behind, "is a variable of the shell not set?")
    assert set(Path.cwd().iterdir()) == before


def test_unknown_command_in_a_process_of_its_own() -> None:
    """The status reaches the shell."""
    assert_refused(called("walk"), "No such command 'walk'")


@pytest.mark.parametrize("command", ["run", "check"])
def test_case_that_is_no_case_file_is_refused(command: str, tmp_path: Path) -> None:
    """A missing file, a folder, a binary and an empty file: exit status 2, what was found, no trace."""
    binary, empty = tmp_path / "binary.toml", tmp_path / "empty.toml"
    binary.write_bytes(bytes(range(256)))
    empty.write_bytes(b"")
    calls = {
        tmp_path / "no.toml": ("no.toml", "no such file"),
        tmp_path: ("a folder",),
        binary: ("binary.toml",),
        empty: ("empty.toml", "[beam]"),
    }
    for done, message in zip(called_in_turn(*([command, path] for path in calls)), calls.values(), strict=True):
        assert_refused(done, *message)


@pytest.mark.parametrize("command", ["plot", "render"])
def test_results_that_are_none_are_refused(command: str, tmp_path: Path) -> None:
    """A missing folder, an empty one, a file and damaged results: exit status 2, what was found, no trace."""
    empty, damaged, file = tmp_path / "empty", tmp_path / "damaged", tmp_path / "file"
    empty.mkdir()
    damaged.mkdir()
    for name in ("history.h5", "fields.h5", "fields.xdmf"):
        (damaged / name).write_bytes(b"\x89HDF\r\n\x1a\nno more")
    (damaged / "case.toml").write_bytes(DEMO.read_bytes())
    file.write_bytes(b"")
    calls = {
        tmp_path / "missing": ("missing", "no such folder"),
        empty: ("nothing",),
        damaged: ("damaged", "cannot be read"),
        file: ("a file",),
    }
    for done, message in zip(called_in_turn(*([command, path] for path in calls)), calls.values(), strict=True):
        assert_refused(done, *message)
    assert list(empty.iterdir()) == []


@pytest.mark.slow(minutes=0.1)
def test_wrong_options_of_drawing_are_refused(folder: Path, tmp_path: Path) -> None:
    """Options out of range, or names that the results do not have: exit status 2, named, no trace, nothing drawn."""
    calls = {
        ("render", "--size", "640"): "640",
        ("render", "--size", "0x0"): "size",
        ("render", "--size", "-640x360"): "640x360",
        ("render", "--size", "99999999x99999999"): "99999999",
        ("render", "--scale", "much"): "much",
        ("render", "--scale", "0"): "scale",
        ("render", "--scale", "nan"): "scale",
        ("render", "--frames", "0"): "--frames",
        ("plot", "--format", "bmp"): "bmp",
        ("plot", "--probe", "nowhere"): "nowhere",
        ("plot", "--component", "w"): "w",
        ("plot", "--rate", "0"): "--rate",
        ("plot", "--window", "round"): "round",
    }
    output = tmp_path / "out"
    words = [(command, folder, *options, "--output", output) for command, *options in calls]
    for done, message in zip(called_in_turn(*words), calls.values(), strict=True):
        assert_refused(done, message)
    assert not output.exists()


@pytest.mark.slow(minutes=0.3)
def test_plot_draws_figures_and_tables(folder: Path) -> None:
    """Every figure of a run is a picture with something on it; tables and data name the forcing; all are listed."""
    done = called("plot", folder)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    figures = folder / "figures"
    pictures = {path.stem for path in figures.glob("*.png")}
    assert {"time_history", "phase_portrait", "contact", "energy", "period_peaks"} <= pictures
    for path in figures.glob("*.png"):
        assert_not_blank(path)
    for path in figures.iterdir():
        assert str(path) in done.stdout
    text = (figures / "tables.txt").read_text(encoding="utf-8")
    assert text.strip() in done.stdout
    assert "Demo: a steel beam rattles" in text
    data = json.loads((figures / "figures.json").read_text(encoding="utf-8"))
    assert data["status"] == "completed"
    assert set(data["figures"]) == pictures


@pytest.mark.slow(minutes=0.1)
def test_plot_in_other_formats(folder: Path) -> None:
    """--format pdf and svg, and another folder: only these, each beginning as its format does."""
    formats = folder.parent / "formats"
    done = called("plot", folder, "--format", "pdf", "--format", "svg", "--output", formats, "--probe", "tip")
    assert done.returncode == 0, done.stderr
    assert list(formats.glob("*.png")) == []
    assert (formats / "contact.pdf").read_bytes().startswith(b"%PDF")
    assert b"<svg" in (formats / "contact.svg").read_bytes()


def test_render_draws_pictures(folder: Path) -> None:
    """Pictures of the asked size that are not blank, no film, and every file reported on standard output."""
    done = called("render", folder, "--no-film", "--size", "640x360")
    assert done.returncode == 0, done.stderr
    paths = [Path(line) for line in done.stdout.splitlines()]
    assert sorted(paths) == sorted((folder / "pictures").iterdir())
    assert paths
    for path in paths:
        assert path.suffix == ".png"
        assert Image.open(path).size == (640, 360)
        assert_not_blank(path)


def assert_not_blank(path: Path) -> None:
    """Check that a picture varies, and that it is more than a few lines on a ground."""
    pixels = np.asarray(Image.open(path).convert("L"), dtype=float)
    assert pixels.std() > 5.0, path
    ground = np.bincount(pixels.astype(int).ravel()).argmax()
    assert np.mean(np.abs(pixels - ground) > 10.0) > 0.01, path
