"""Reports on results folders of every kind that gapbeam knows."""

from __future__ import annotations

from functools import partial

from gapbeam.commands.study_choice import report_kinds
from gapbeam.postprocess.report import folder_report

report_on = partial(folder_report.report_on, kinds=report_kinds())
