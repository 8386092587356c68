"""impacts.csv: the impacts of a run, one a line, readable by any program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gapbeam.solver.diagnostics.contact_episodes import ImpactList
from gapbeam.solver.run.output.atomic_files import written
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.schema.record_table import IMPACT_COLUMNS, IMPACTS_FILE

HEAD = ",".join(["face", *(f"{name} ({unit})" if unit else name for name, unit in IMPACT_COLUMNS.items())])


def write_impacts(folder: Path, faces: Sequence[str], impacts: Sequence[ImpactList]) -> None:
    """Write the impacts that were kept of each face, with how many each of them stands for.

    Raises:
        NotWritten: It could not be written.
    """
    lines = [HEAD]
    for face, kept in zip(faces, impacts, strict=True):
        lines += [f"{face},{','.join(map(repr, row))},{kept.every}" for row in kept.rows.tolist()]
    path = folder / IMPACTS_FILE
    with written(path):
        write_beside(path, "\n".join(lines) + "\n")
