"""The studies that gapbeam offers: one line each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gapbeam.commands import (
    atlas,
    compare,
    identify,
    library,
    life,
    modes,
    optimize,
    stability,
    sweep,
    tradeoff,
    uncertain,
)
from gapbeam.commands.terminal import StudyCommand

if TYPE_CHECKING:
    from gapbeam.postprocess.report.folder_report import Kind

STUDIES: tuple[StudyCommand, ...] = (
    sweep.STUDY,
    stability.STUDY,
    tradeoff.STUDY,
    atlas.STUDY,
    uncertain.STUDY,
    library.STUDY,
    library.ESTIMATE,
    identify.STUDY,
    optimize.STUDY,
    life.STUDY,
    compare.STUDY,
    modes.STUDY,
)


def report_kinds() -> tuple[Kind, ...]:
    """Return the kinds of results folders of all studies, in the order in which a folder is tried."""
    return tuple(study.kind() for study in STUDIES if study.kind is not None)
