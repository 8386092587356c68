"""Page of a report, its PDF, and statistics of the span that it shows, in the folder of the results.

Statistics of a span, and its wear, follow from the sums over time that records hold.

Records lack the squares of forces and the approach speeds, whose figures are left out. So are records before the first
one of the span, and no burn-in is cut but the span's own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.report.blocks import LiveModel, ReportSection
from gapbeam.postprocess.report.folder_report import RUN, Kind, recognized, report_on, span_report
from gapbeam.postprocess.report.html_page import write_html
from gapbeam.postprocess.report.pdf_page import BrowserError, find_browser, write_pdf
from gapbeam.postprocess.results.bounded_files import as_written
from gapbeam.postprocess.results.run_watch import SpanOfRun, span_of
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.postprocess.signals.signal import names_along
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.statistics.run_statistics import SUMMED, RecordStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, Doubts
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.run.outcome import all_rates, work_rate
from gapbeam.solver.run.output.results_folder import check_folder, check_name
from gapbeam.solver.run.stop_rule import decay_time, has_statistics
from gapbeam.solver.schema.record_table import CASE_FILE, HISTORY_FILE
from gapbeam.studies.study_folder import refuse_links

MOTIONS = ("displacement", "acceleration_absolute")


def statistics_of_span(run: SpanOfRun) -> dict[str, Any] | None:
    """Return the statistics of a span, as the summary of a run has them; None without any, and for structures.

    Raises:
        UserError: The case of the results cannot be read.
    """
    if not run.summary.get("statistics") or run.summary.get("scene"):
        return None
    case = read_case(run.folder / CASE_FILE)
    history = run.history
    if not has_statistics(case) or "contact_time" not in history or "closings" not in history:
        return None
    faces, probes = (tuple(names_along(history, dimension)) for dimension in ("face", "probe"))
    times = np.asarray(history["time"].values, dtype=float)
    slides = {"sliding_work", "work_by_mode"} <= set(history.variables)
    found = RecordStatistics(
        faces, probes, bends_in_two_planes(case), float(np.median(np.diff(times))), decay_time(case), slides
    )
    wanted = (*SUMMED, *(("sliding_work", "work_by_mode") if slides else ()), *(MOTIONS if probes else ()))
    rows = {name: np.asarray(history[name].values, dtype=float) for name in wanted if name in history}
    found.see(rows | {"time": times})
    return found.describe(Doubts.restored(run.summary["statistics"]))


def wear_of_span(run: SpanOfRun, statistics: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return the summary's entry on wear, of a span; None for a run without [wear].

    Work and its parts are differences of records. Maps are of the whole run: records do not hold the points.

    Args:
        run: The span.
        statistics: Statistics of its records, with their intervals; None: the run has none.
    """
    whole, history = run.summary.get("wear"), run.history
    if not whole or "sliding_work" not in history:
        return None
    seconds = run.times[1] - run.times[0]
    known = {one["name"]: one for one in (statistics or {}).get("figures", ())}
    faces = {}
    for name, of_run in whole["faces"].items():
        work = _change(history["sliding_work"].sel(worn_face=name).values)
        found = {"work": work, "coefficient": of_run.get("coefficient"), "area": of_run.get("area")}
        rate = work_rate(work, seconds, known.get(f"face.{name}.{WORK_RATE}"))
        if "work_by_mode" in history:
            parts = history["work_by_mode"].sel(worn_face=name)
            modes = {str(mode): _change(parts.sel(slip_mode=mode).values) for mode in parts["slip_mode"].values}
            found["work_by_mode"] = modes
            found["work_rate_by_mode"] = {
                mode: work_rate(part, seconds, known.get(f"face.{name}.{mode}_{WORK_RATE}"))
                for mode, part in modes.items()
            }
        faces[name] = found | all_rates(rate, found["coefficient"], found["area"])
    kept = {key: whole.get(key) for key in ("area", "impact_time", "sticking_speed")}
    return kept | {"seconds": seconds, "faces": faces}


def _change(values: np.ndarray) -> float:
    return float(values[-1] - values[0])


NAME = "report.html"
LIVE = (
    "Marched in your browser with the reduced model of {modes} modes in steps of {step:.3g} ms; not the certified run: "
    "no gates, no error estimates."
)
HEAVY = 8e6  # bytes; a page that is larger opens slowly on a phone


def write_report(
    results: Sequence[Path],
    kinds: Sequence[Kind],
    page: Path | None = None,
    pdf: bool | None = None,
    overwrite: bool = False,
    begin: float | None = None,
    end: float | None = None,
    live: Callable[[Path], dict[str, Any] | None] = lambda _folder: None,
) -> list[Path]:
    """Write a report on results: one page that works offline, and a PDF.

    Arguments, what is returned and errors are as in `gapbeam.report`; beside these the kinds of folders that studies
    write, the most particular first, and a function of a run's folder that returns data of its live model, or None.
    """
    found = recognized(results, (*kinds, RUN)) if begin is None and end is None else None
    page = page if page is not None else page_of(results)
    _check(page, page.with_suffix(".pdf"), pdf is not False, overwrite)
    with as_written(*results, into=page):
        words: list[str | Path] = ["gapbeam", "report", *results]
        if found is not None:
            made = report_on(results, shell_command(*words), found)
            data = live(results[0]) if len(results) == 1 and (results[0] / HISTORY_FILE).is_file() else None
            if data is not None:
                words_of_it = LIVE.format(modes=data["modes"], step=1e3 * data["step"])
                section = ReportSection("Try other values", "live", [LiveModel(data, words_of_it)])
                made = replace(made, sections=[*made.sections[:1], section, *made.sections[1:]])
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
        words = " and ".join(map(str, there)) + (" are" if len(there) > 1 else " is")
        raise OptionError(f"{words} there already; choose another `output=`, or pass `overwrite=True` to replace it")
    check_folder(page.parent, overwrite=True)
