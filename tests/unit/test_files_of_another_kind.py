"""Files of studies given to commands of another kind: one fault, which names the command that takes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import CaseError
from gapbeam.studies.identification.identification_file import read_identification
from gapbeam.studies.library.library_file import read_library_study
from gapbeam.studies.optimum.optimum_study import read_optimum_study
from tests.shared.command import PROJECT

READERS: dict[str, Callable[[Path], object]] = {
    "run": read_case, "identify": read_identification, "library": read_library_study, "optimize": read_optimum_study,
}  # fmt: skip


@pytest.mark.parametrize("file", sorted(path.name for path in (PROJECT / "cases" / "studies").glob("*.toml")))
@pytest.mark.parametrize("command", READERS)
def test_a_study_for_another_command_is_named(command: str, file: str) -> None:
    """All shipped studies: read by their own command, and refused once by the others with its line to type."""
    path = PROJECT / "cases" / "studies" / file
    kinds = {"identify": "identify", "li2013": "identify", "library": "library", "optimize": "optimize"}
    own = kinds.get(file.partition("-")[0], "uncertain")
    if command == own:
        assert READERS[command](path)
        return
    if (command, own) == ("library", "uncertain"):
        return  # what its file lacks is said
    with pytest.raises(CaseError) as caught:
        READERS[command](path)
    (fault,) = caught.value.faults
    assert fault.hint == f"gapbeam {own} {file}"
