"""A study that gapbeam does not have: how the peak contact force of a case depends on one halving of the step."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import StudyCommand
from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.folder_report import Kind

STEPS_FILE = "step-halving.json"


def halve_step(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")],
    output: Annotated[Path, typer.Option(help="folder")],
) -> int:
    """Run a case with its step and with half of it."""
    from gapbeam.solver.case.reading.case_reader import read_case
    from gapbeam.studies.study_folder import study_folder
    from gapbeam.studies.trials.response import try_case

    step = read_case(case, []).time.step
    assert step != "auto"
    trials = [(size, try_case(read_case(case, {"time.step": size}))) for size in (step, step / 2)]
    with study_folder(output):
        rows = [{"step": size, "peak_force": trial.peak_force, "verdict": trial.verdict} for size, trial in trials]
        (output / STEPS_FILE).write_text(json.dumps(rows), encoding="utf-8")
    return 0


def _tables(folder: Path, command: str) -> Sequence[TableBlock]:
    rows = json.loads((folder / STEPS_FILE).read_text(encoding="utf-8"))
    cells = [(row["step"], row["peak_force"], row["verdict"]) for row in rows]
    return [
        TableBlock(
            "Peak contact force over the step", ("step (s)", "peak force (N)", "verdict"), cells, command=command
        )
    ]


def _kind() -> Kind:
    return Kind("step halving", "Step halving", (STEPS_FILE,), _tables)


STUDY = StudyCommand(halve_step, _kind)
