"""A study is added by one file and one line in the list of studies: command, help, results folder and report."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shared.command import DEMO, PROJECT, alone, process_environment

LIST = "study_choice.py"


def gapbeam_in(folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """Call the command line of the copy of gapbeam in a folder."""
    command = [sys.executable, "-m", "gapbeam", *map(str, words)]
    variables = process_environment() | {"PYTHONPATH": str(folder)}
    return subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of gapbeam with a study more: one new file, one that lists it."""
    folder = tmp_path_factory.mktemp("extended")
    shutil.copytree(PROJECT / "gapbeam", folder / "gapbeam", ignore=shutil.ignore_patterns("__pycache__"))
    commands = folder / "gapbeam" / "commands"
    before = {path: path.read_bytes() for path in (folder / "gapbeam").rglob("*") if path.is_file()}
    shutil.copy(PROJECT / "tests" / "programs" / "made_up_study.py", commands)
    text = (commands / LIST).read_text(encoding="utf-8")
    text = text.replace("from gapbeam.commands import ", "from gapbeam.commands import made_up_study, ", 1)
    text = text.replace("    modes.STUDY,\n", "    modes.STUDY,\n    made_up_study.STUDY,\n", 1)
    (commands / LIST).write_text(text, encoding="utf-8")
    after = {path: path.read_bytes() for path in (folder / "gapbeam").rglob("*") if path.is_file()}
    assert sorted(path.name for path in after if after[path] != before.get(path)) == ["made_up_study.py", LIST]
    return folder


@pytest.mark.slow(minutes=0.3)
@alone
def test_a_study_takes_two_files(extended: Path, tmp_path: Path) -> None:
    """The command computes, and `gapbeam report` shows the folder that it wrote."""
    case, folder = tmp_path / "case.toml", tmp_path / "halved"
    case.write_text(_short(DEMO.read_text(encoding="utf-8")), encoding="utf-8")
    assert "Run a case with its step and with half of it" in gapbeam_in(extended, "halve-step", "--help").stdout
    done = gapbeam_in(extended, "halve-step", case, "--output", folder)
    assert done.returncode == 0, done.stderr
    rows = json.loads((folder / "step-halving.json").read_text(encoding="utf-8"))
    assert [row["verdict"] for row in rows] == ["passed", "passed"]
    assert rows[0]["step"] == pytest.approx(2.0 * rows[1]["step"])
    assert rows[0]["peak_force"] == pytest.approx(rows[1]["peak_force"], rel=0.2)
    done = gapbeam_in(extended, "report", folder, "--no-pdf")
    assert done.returncode == 0, done.stderr
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Step halving" in page
    assert "Peak contact force over the step" in page


@alone
def test_without_the_study_its_folder_is_refused(tmp_path: Path) -> None:
    """The report does not guess what a folder of an unknown study shows."""
    (tmp_path / "step-halving.json").write_text("[]", encoding="utf-8")
    done = gapbeam_in(PROJECT, "report", tmp_path, "--no-pdf")
    assert done.returncode == 2
    assert "expected" in done.stderr
    assert "sweep.json" in done.stderr


def _short(text: str) -> str:
    """Return the demo with some steps only."""
    lines = ["end = 0.004" if line.startswith("end =") else line for line in text.splitlines()]
    return "\n".join(lines) + "\n"
