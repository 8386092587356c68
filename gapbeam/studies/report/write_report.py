"""Page of a report, and its PDF, in the folder of the results."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from gapbeam.postprocess.report.folder_report import Kind, report_on, span_report
from gapbeam.postprocess.report.html_page import write_html
from gapbeam.postprocess.report.pdf_page import BrowserError, find_browser, write_pdf
from gapbeam.postprocess.results.damaged_files import as_written
from gapbeam.postprocess.results.run_watch import SpanOfRun, span_of
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.solver.record_table import HISTORY_FILE
from gapbeam.solver.run.output.results_folder import check_folder, check_name
from gapbeam.studies.report.span_statistics import statistics_of_span, wear_of_span
from gapbeam.studies.study_folder import refuse_links

LOG = logging.getLogger("gapbeam")
NAME = "report.html"
HEAVY = 8e6  # bytes; a page that is larger opens slowly on a phone


def write_report(
    results: Sequence[Path],
    kinds: Sequence[Kind],
    page: Path | None = None,
    pdf: bool | None = None,
    overwrite: bool = False,
    begin: float | None = None,
    end: float | None = None,
) -> list[Path]:
    """Write a report on results: one page that works offline, and a PDF.

    Args:
        results: Folders of runs or studies.
        kinds: Kinds of results folders that studies write, the most particular first.
        page: Page to write, *.html; None: report.html in the folder, or in one for all of them.
        pdf: Whether to print the page too; None: where a browser is found.
        overwrite: Replace an earlier report.
        begin: First time of a run that is looked at, s; None: from the start.
        end: Last time, s; None: to the end.

    Returns:
        The page and, where there is one, its PDF.

    Raises:
        ResultsError: A folder that is not there, holds nothing that is known, or a file that cannot be read.
        OptionError: Another suffix, a report that is there, or a span of time that there is not.
        UserError: A place that cannot be written.
        BrowserError: No browser for a PDF that was asked for, or one that printed nothing.
    """
    page = page if page is not None else page_of(results)
    _check(page, page.with_suffix(".pdf"), pdf is not False, overwrite)
    with as_written(*results):
        words: list[str | Path] = ["gapbeam", "report", *results]
        if begin is None and end is None:
            made = report_on(results, shell_command(*words), kinds)
        else:
            span = _span(results, begin, end)
            words += [word for name, time in (("--from", begin), ("--to", end)) if time is not None
                      for word in (name, f"{time:g}")]  # fmt: skip
            statistics = statistics_of_span(span)
            made = span_report(span, statistics, shell_command(*words), wear_of_span(span, statistics))
        write_html(made, page)
    return [page, *print_page(page, pdf)]


def _span(results: Sequence[Path], begin: float | None, end: float | None) -> SpanOfRun:
    """Return a span of the one run that was given.

    Raises:
        OptionError: Several folders, or one of a study; otherwise as `span_of`.
    """
    if len(results) != 1:
        raise OptionError(f"a span of time of {len(results)} folders; expected one run; leave out --from and --to")
    if not (results[0] / HISTORY_FILE).is_file():
        raise OptionError(
            f"a span of time of {results[0]}, which holds no {HISTORY_FILE}; expected the folder of a run; leave out "
            "--from and --to, or name a run in it"
        )
    return span_of(results[0], begin, end)


def print_page(page: Path, pdf: bool | None) -> list[Path]:
    """Make the PDF of a page in its folder.

    Args:
        page: A page that is written, *.html.
        pdf: Whether to print it; None: where a browser is found.

    Returns:
        The PDF, where there is one.

    Raises:
        BrowserError: No browser for a PDF that was asked for, or one that printed nothing.
    """
    if page.stat().st_size > HEAVY:
        LOG.warning("%s has %.1f MB: it opens slowly on a phone", page, page.stat().st_size / 1e6)
    if pdf is False:
        return []
    try:
        browser = find_browser()
    except BrowserError as lacking:
        if pdf:
            raise
        LOG.info("no PDF: %s", lacking)
        return []
    return [write_pdf(page, page.with_suffix(".pdf"), browser)]


def page_of(results: Sequence[Path]) -> Path:
    """Return the default page of the report on results."""
    if len(results) == 1:
        return results[0] / NAME
    names = [folder.resolve().name for folder in results]
    rest = names[1] if len(names) == 2 else f"{len(names) - 1}-others"
    return Path("results") / f"{names[0]}-and-{rest}" / NAME


def _check(page: Path, printed: Path, prints: bool, overwrite: bool) -> None:
    """Refuse a page that could not or should not be written.

    Raises:
        OptionError: Another suffix, or a report that is there.
        UserError: A folder that cannot be written.
    """
    check_name(page)
    check_name(printed.with_name(printed.name + ".part"))
    refuse_links(places=(page, printed, page.with_name(page.name + ".part")))
    if page.suffix.lower() not in (".html", ".htm"):
        raise OptionError(f"`output=` {page}: expected a file that ends in .html; its PDF stands beside it")
    there = [path for path in (page, *([printed] if prints else [])) if path.exists()]
    if there and not overwrite:
        words = " and ".join(map(str, there))
        raise OptionError(f"{words} is there already; choose another `output=`, or pass `overwrite=True` to replace it")
    check_folder(page.parent, overwrite=True)
