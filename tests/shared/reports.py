"""Reports on results folders of every kind that gapbeam knows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gapbeam.commands.study_choice import report_kinds
from gapbeam.postprocess.report import folder_report
from gapbeam.postprocess.report.blocks import Report


def report_on(folders: Sequence[Path], command: str) -> Report:
    """Return the report on results folders of any kind."""
    kinds = folder_report.recognized(folders, (*report_kinds(), folder_report.RUN))
    return folder_report.report_on(folders, command, kinds)
