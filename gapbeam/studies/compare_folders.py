"""The comparison of two runs, from their folders to comparison.json and comparison.png."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from gapbeam.postprocess.comparison_report import as_data, as_tables, draw_comparison
from gapbeam.postprocess.results.bounded_files import as_written
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.run_comparison import DISAGREE, TOLERANCE, RunComparison, compare
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder, write_json


@dataclass(frozen=True, repr=False)
class ComparisonResult(PrintedResult):
    """Two runs side by side.

    Attributes:
        folder: Folder of its files.
        comparison: Figures, waveforms, costs and verdict.
        data: comparison.json.
        picture: comparison.png.
    """

    folder: Path
    comparison: RunComparison
    data: Path
    picture: Path

    @property
    def agree(self) -> bool:
        """True where the runs agree within the tolerance."""
        return self.comparison.agree

    @property
    def exit_status(self) -> int:
        """0 where the runs agree, 5 where they do not."""
        return 0 if self.agree else DISAGREE

    def headline(self) -> str:
        """Return the verdict."""
        return self.comparison.verdict

    def tables(self) -> list[Table]:
        """Return figures and costs."""
        return as_tables(self.comparison)


def compare_folders(
    a: Path, b: Path, folder: Path, tolerance: float = TOLERANCE, after: float | None = None
) -> ComparisonResult:
    """Compare two runs and write the results.

    Args:
        a: Results folder of one run.
        b: Results folder of the other.
        folder: Folder for the comparison.
        tolerance: Largest difference that counts as agreement, as a fraction.
        after: End of the transient, s; None: found in the records.

    Raises:
        ResultsError: A folder has no readable results.
        ComparisonError: The runs cannot be compared.
        UserError: The folder of the comparison cannot be written.
    """
    data, picture = folder / "comparison.json", folder / "comparison.png"
    with study_folder(folder), as_written(a, b, into=folder):
        found = compare(open_results(a), open_results(b), tolerance, after)
        write_json(data, as_data(found))
        draw_comparison(found, picture)
    return ComparisonResult(folder, found, data, picture)


def comparison_folder(a: Path, b: Path) -> Path:
    """Return the default folder of a comparison."""
    return Path("results") / f"{a.resolve().name}-against-{b.resolve().name}"
