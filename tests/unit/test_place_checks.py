"""Where results go: names and places that are refused before anything is computed, and one writer at a time."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import gapbeam
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run.output.results_folder import check_place, locked
from gapbeam.studies.study_folder import study_folder
from tests.shared.command import DEMO, PROJECT, alone, called_in_turn

pytestmark = alone
STUDIES: dict[str, tuple[str | Path, ...]] = {
    "sweep": (DEMO, "support.clearance=1e-4", "--set", "time.end=0.01"),
    "stability": (DEMO,),
    "tradeoff": (DEMO,),
    "modes": (DEMO,),
    "identify": (PROJECT / "cases" / "studies" / "identify-li2013.toml",),
}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("x" * 5000, "is a name of 5000 bytes; expected at most 255"),
        ("ü" * 200, "is a name of 400 bytes"),
        ("/".join(["z" * 200] * 30), "is a path of "),
        ("a\nb", r'"a\nb" has a character that no name should have'),
        ("a\x1b]0;owned\x07b", r"a\x1b]0;owned\x07b"),
        ("a\x00b", r"\x00"),
        ("a\udcffb", r"\udcff"),
        ("a file", "a file is a file, not a folder"),
        ("a file/below", "a file is a file, not a folder"),
        ("a link", "is a link that leads nowhere"),
        ("a loop", "is a link that leads nowhere"),
    ],
    ids=["long", "two-bytes", "deep", "newline", "escape", "nul", "surrogate", "file", "below", "link", "loop"],
)
def test_names_that_are_refused(name: str, text: str, tmp_path: Path) -> None:
    """Names that no file should have, and things instead of folders: a message, nothing written."""
    (tmp_path / "a file").touch()
    (tmp_path / "a link").symlink_to(tmp_path / "nowhere")
    (tmp_path / "a loop").symlink_to(tmp_path / "a loop")
    there = sorted(path.name for path in tmp_path.iterdir())
    for refused in (lambda folder: check_place(folder), lambda folder: gapbeam.run(DEMO, (), folder)):
        with pytest.raises(UserError) as fault:
            refused(tmp_path / name)
        assert text in str(fault.value).replace(str(tmp_path), "")
        assert str(fault.value).isprintable()
        assert len(str(fault.value)) < 500
    assert sorted(path.name for path in tmp_path.iterdir()) == there


@pytest.mark.parametrize("name", ["of two words", "größe", "مقياس", "a\u200db", "."])
def test_names_that_are_not(name: str, tmp_path: Path) -> None:
    """Letters of any language, and the folder one stands in."""
    check_place(tmp_path / name)


def test_places_where_nothing_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a root file system of environment/run only what is the machine's own; the kernel's folders never."""
    monkeypatch.setenv("GAPBEAM_SHARED", f"/srv:{tmp_path}")
    check_place(tmp_path / "results")
    (tmp_path / "out").symlink_to("/usr")
    for lost in ("/usr/x", "/new/x", "/run/x", "/dev/shm/x", tmp_path / "out" / "x", f"{tmp_path}-beside"):
        with pytest.raises(UserError, match=rf"lost at the end.*expected a folder in one of /srv, {tmp_path}"):
            check_place(Path(lost))
    monkeypatch.delenv("GAPBEAM_SHARED")
    for place in ("/proc/self/x", "/sys/x", "/dev/x"):
        with pytest.raises(UserError, match="no place for files"):
            check_place(Path(place))
    with pytest.raises(UserError, match="the root of all folders"):
        check_place(Path("/"))
    with pytest.raises(UserError, match=r"\$HOME/x"):
        check_place(Path("~/x"))


def test_empty_output_of_the_call() -> None:
    """An empty text would fill the current folder."""
    for output in ("", " "):
        with pytest.raises(UserError, match="an empty word"):
            gapbeam.run(DEMO, (), output)


def test_root_file_system_reports_what_it_shows() -> None:
    """Where environment/run entered one, the checkout and the folder for temporary files are among it."""
    shared = os.environ.get("GAPBEAM_SHARED")
    if shared is None:
        pytest.skip("not in a root file system")
    assert any(PROJECT.is_relative_to(folder) for folder in shared.split(":"))
    assert not any(Path(folder).is_relative_to("/usr/bin") for folder in shared.split(":"))


@pytest.mark.slow(minutes=0.1)
def test_studies_hold_their_folder(tmp_path: Path) -> None:
    """A folder that another run or study writes is refused, before anything is computed, and left as it is."""
    calls = [(command, *words, "--output", tmp_path / "held") for command, words in STUDIES.items()]
    with locked(tmp_path / "held"):
        more = [("sweep", *STUDIES["sweep"], "--output", tmp_path / ("y" * 300)), ("plot", "x" * 300)]
        *held, unfit, unknown = called_in_turn(*calls, *more)
        for done in held:
            assert (done.returncode, done.stdout) == (2, ""), done.stderr
            assert f"is being written by another run (process {os.getpid()}" in done.stderr
        assert [path.name for path in (tmp_path / "held").iterdir()] == ["run.lock"]
    assert (unfit.returncode, unfit.stdout) == (2, "")
    assert "is a name of 300 bytes" in unfit.stderr
    assert (unknown.returncode, unknown.stdout, "Traceback" in unknown.stderr) == (2, "", False)


def test_folder_of_a_study_goes_where_nothing_was_written(tmp_path: Path) -> None:
    """Folders that a study made go with its failure; what was there or was written stays."""
    (tmp_path / "there").mkdir()
    for name, left in (("there/new/newer", "there"), ("there", "there")):
        with pytest.raises(ZeroDivisionError), study_folder(tmp_path / name):
            raise ZeroDivisionError
        assert [path.name for path in tmp_path.rglob("*")] == [left]
    with study_folder(tmp_path / "new"):
        (tmp_path / "new" / "file").touch()
    (tmp_path / "new" / "link").symlink_to("file")
    with pytest.raises(UserError, match="holds links"), study_folder(tmp_path / "new"):
        pass
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["file", "link"]


def test_own_case_is_not_replaced(tmp_path: Path) -> None:
    """`gapbeam run case.toml --output . --overwrite` leaves the case as its author wrote it; that of a run may go."""
    case = tmp_path / "case.toml"
    case.write_bytes(DEMO.read_bytes())
    brief = ("time.end=1e-3",)
    with pytest.raises(UserError, match="was not written by a run"):
        gapbeam.run(case, brief, tmp_path, overwrite=True)
    assert case.read_bytes() == DEMO.read_bytes()
    for _ in range(2):
        assert gapbeam.run(DEMO, brief, tmp_path / "out", overwrite=True).exit_status == 0
    assert gapbeam.run(tmp_path / "out" / "case.toml", (), tmp_path / "out", overwrite=True).exit_status == 0
