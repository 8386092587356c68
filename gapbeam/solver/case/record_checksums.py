"""The checksums of the files that loads are read from, written into a case."""

from __future__ import annotations

from gapbeam.solver.case.case import Case


def with_checksums(case: Case) -> Case:
    """Return a case whose loads have the checksums of their files.

    Raises:
        RecordError: The file of a load cannot be used, or is another one than its checksum says.
    """
    return case.model_copy(update={"load": tuple(load.with_checksum() for load in case.load)})
