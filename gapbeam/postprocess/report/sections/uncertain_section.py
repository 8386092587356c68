"""The report on a study of uncertain values: probabilities, distributions of each response, causes of scatter."""

from __future__ import annotations

from pathlib import Path

from gapbeam.postprocess.report.blocks import Block, ReportSection, TableBlock, Verdict, picture_section
from gapbeam.postprocess.report.study_json import read_records

UNCERTAIN_FILE, UNCERTAIN_PICTURE = "uncertain.json", "uncertain.png"
TABLES = {
    "probabilities": "Probabilities with 95 % intervals",
    "distributions": "Figures of each response: mean with 95 % interval, standard deviation, quantiles",
    "sobol-indices": "Sobol indices with 95 % intervals, and from half of the points",
    "convergence": "Probabilities from a part of the members",
}


def uncertain_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, the picture and the tables.

    Args:
        folder: As a study of uncertain values left it.
        command: That makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    del command
    (record,) = read_records(folder / UNCERTAIN_FILE, ("headline", "complete", *TABLES))
    blocks: list[Block] = [Verdict("passed" if record["complete"] else "warning", str(record["headline"]))]
    for name, caption in TABLES.items():
        heads, rows = record[name]["heads"], record[name]["rows"]
        if rows:
            blocks.append(TableBlock(caption, tuple(heads), [tuple(row) for row in rows], digits=4))
    caption = "Figures of all members by response; dashed: limits."
    return [
        ReportSection("Summary", "summary", blocks),
        *picture_section(folder / UNCERTAIN_PICTURE, caption, "gapbeam.uncertain"),
    ]
