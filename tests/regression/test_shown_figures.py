"""Figures that pages show are those that their commands give, where the executed page shortens the command."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import gapbeam
from docs.execution.page_steps import Step, page_steps
from docs.execution.step_runner import StepError, prepared, refuse_other_output
from docs.site.code_blocks import blocks
from tests.shared.command import alone

PROJECT = Path(__file__).parents[2]
DOCS = PROJECT / "docs"
DAMPED = "\n[damping]\nfrequencies = [40.0, 300.0]\nratios = [0.01, 0.01]\n"
WITHIN = 0.02  # other releases, other machines
CHAOTIC = 0.3  # of peaks behind impacts, which round-off changes
LONG, SHORT = pytest.mark.slow(minutes=1.5), pytest.mark.slow(minutes=0.5)
SHOWN = [
    ("tutorials/first-case.md", "run first.toml", "tip peak-to-peak displacement", DAMPED, CHAOTIC, LONG),
    ("how-to/predict-wear.md", "run cases/random-vibration", "wear: base", "", WITHIN, SHORT),
    ("how-to/record-stresses.md", "run cases/cantilever", "root peak-to-peak axial stress", "", WITHIN, SHORT),
]


@alone
@pytest.mark.parametrize(
    ("page", "command", "shown", "more", "within"),
    [pytest.param(*one, id=Path(one[0]).stem, marks=mark) for *one, mark in SHOWN],
)
def test_shown_lines_are_printed(page: str, command: str, shown: str, more: str, within: float, tmp_path: Path) -> None:
    """The command as the page shows it, and not as it is shortened, prints the line."""
    prepared(tmp_path)
    for step in page_steps(DOCS / page):
        if step.kind == "file":
            (tmp_path / step.file).write_text(step.text + more, encoding="utf-8")
    found = list(blocks(DOCS / page))
    line = next(line for block in found for line in block.text.splitlines() if line.strip().startswith(shown))
    words = next(
        words for block in found if block.kind == "sh" for words in block.commands() if command in shlex.join(words)
    )
    words = words[words.index("gapbeam") + 1 :]
    paths = os.pathsep.join([str(PROJECT), *filter(None, [os.environ.get("PYTHONPATH")])])
    estimated = {key: value for key, value in os.environ.items() if key != "GAPBEAM_ERRORS"}
    done = subprocess.run(
        [sys.executable, "-m", "gapbeam", *words],
        cwd=tmp_path, env=estimated | {"PYTHONPATH": paths}, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    # round-off changes where motions part: errors, and the span that they are of, are left out
    figures = re.sub(r"\+- .*", "...", line)
    refuse_other_output(Step(0, "output", figures, within=within), done.stdout + done.stderr)


@pytest.mark.slow(minutes=0.3)
@alone
def test_sizes_of_models_are_those_of_the_tutorial(tmp_path: Path) -> None:
    """DOFs of the mesh and of its reduced model; computed in a folder of their own."""
    text = (DOCS / "tutorials" / "clearance-study.md").read_text(encoding="utf-8")
    changes = {"model.type": "reduced", "time.end": 1e-3, "output.errors": "none"}
    found = gapbeam.run(PROJECT / "cases" / "li2013-2d.toml", changes, output=tmp_path / "run").summary["model"]
    assert f"marches {found['dofs']} DOFs instead of the {found['mesh_dofs']} of the mesh" in text


def test_other_output_is_refused() -> None:
    """Words in the order of the page, numbers within the tolerance, anything where the page has dots."""
    step = Step(7, "output", "life 13.6 days (12.5 to 14.8), ... 6 runs", within=0.01)
    refuse_other_output(step, "so:\n  life 13.61 days (12.5 to 14.8),  chance 3 %; 6 runs\n")
    for printed in ("life 13.9 days (12.5 to 14.8), x 6 runs", "life 13.6 h (12.5 to 14.8), x 6 runs", ""):
        with pytest.raises(StepError, match=r"line 7: the page shows"):
            refuse_other_output(step, printed)
