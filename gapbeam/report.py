"""The command `gapbeam report`: one page, and its PDF, of any results folder or of several."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from postprocess.report.blocks import Block, Report, Section

LOG = logging.getLogger("gapbeam")
NAME = "report.html"
HEAVY = 8e6  # bytes; a page that is larger opens slowly on a phone


def report(
    results: Annotated[list[Path], typer.Argument(metavar="RESULTS...", help="folders of runs, sweeps or studies")],
    output: Annotated[Path | None, typer.Option(help="page to write, *.html; by default RESULTS/report.html")] = None,
    pdf: Annotated[
        bool | None, typer.Option("--pdf/--no-pdf", help="print it too; by default where a browser is found")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace an earlier report")] = False,
) -> int:
    """Write what results show as one page that works offline, and as PDF.

    Exit status: 0 written, 2 a fault of the input, or no browser for a PDF that was asked for.
    """
    from postprocess.damage import as_written
    from postprocess.report.html import write_html

    page = output if output is not None else _default(results)
    printed = page.with_suffix(".pdf")
    _check(page, printed, pdf is not False, overwrite)
    with as_written(*results):
        made = report_on(results, " ".join(["gapbeam report", *map(str, results)]))
        write_html(made, page)
    tell_page(page, pdf)
    return 0


def tell_page(page: Path, pdf: bool | None) -> None:
    """Say where a page is, and make its PDF beside it.

    Args:
        page: A page that is written, *.html.
        pdf: Whether to print it; None: where a browser is found.

    Raises:
        BrowserError: No browser for a PDF that was asked for, or one that printed nothing.
    """
    from postprocess.report.pdf import BrowserError, find_browser, write_pdf

    print(page)
    if page.stat().st_size > HEAVY:
        LOG.warning("%s has %.1f MB: it opens slowly on a phone", page, page.stat().st_size / 1e6)
    if pdf is False:
        return
    try:
        browser = find_browser()
    except BrowserError as lacking:
        if pdf:
            raise
        LOG.info("no PDF: %s", lacking)
        return
    print(write_pdf(page, page.with_suffix(".pdf"), browser))


def report_on(folders: Sequence[Path], command: str) -> Report:
    """Return the report on results folders, several runs as a comparison.

    Args:
        folders: At least one.
        command: That makes the report.

    Raises:
        ResultsError: A folder that is not there, holds nothing that is known, or a file that cannot be read; all faults
            of the folders at once.
    """
    from postprocess.report.blocks import Report, Section
    from postprocess.report.sections.run import meta_of, run_report
    from postprocess.report.sections.several import names_of, several_sections
    from postprocess.results import open_results

    kinds = _recognized(folders)
    if all(kind.name == "run" for kind in kinds):
        runs = [open_results(folder) for folder in folders]
        if len(runs) == 1:
            return run_report(runs[0], command)
        subtitle = ", ".join(f"`{run.folder}`" for run in runs)
        meta = meta_of(runs[0], command) | {"results": ", ".join(str(run.folder) for run in runs)}
        return Report(
            f"Runs side by side: {', '.join(names_of(runs))}", subtitle, several_sections(runs, command), meta
        )
    meta = {"results": ", ".join(map(str, folders)), "made by": command}
    if len(folders) == 1:
        title = f"{kinds[0].title}: {folders[0].resolve().name}"
        return Report(title, f"In `{folders[0]}`", _as_sections(kinds[0].blocks(folders[0], command)), meta)
    parts = [
        _renamed(Section(f"{kind.title}: {folder}", f"part-{number}", kind.blocks(folder, command)), f"part-{number}")
        for number, (kind, folder) in enumerate(zip(kinds, folders, strict=True), start=1)
    ]
    return Report("Results", ", ".join(f"`{folder}`" for folder in folders), parts, meta)


@dataclass(frozen=True)
class Kind:
    """A kind of results folder.

    Attributes:
        name: In one word.
        title: In a heading.
        files: One of them is in every such folder.
        blocks: What there is to show of a folder, given the command that makes the report.
    """

    name: str
    title: str
    files: tuple[str, ...]
    blocks: Callable[[Path, str], Sequence[Block]]


def _kinds() -> tuple[Kind, ...]:
    """Return the kinds of results folders, the most particular first."""
    from postprocess.report.sections.comparison import COMPARISON_FILE, comparison_sections
    from postprocess.report.sections.identification import IDENTIFICATION_FILE, identification_blocks
    from postprocess.report.sections.run import run_report
    from postprocess.report.sections.stability import STABILITY_FILE, stability_sections
    from postprocess.report.sections.sweep import SWEEP_FILE, sweep_sections
    from postprocess.report.sections.tradeoff import TRADEOFF_FILE, tradeoff_sections
    from postprocess.results import open_results
    from solver.output.records import HISTORY_FILE, SUMMARY_FILE

    def of_run(folder: Path, command: str) -> Sequence[Section]:
        return run_report(open_results(folder), command).sections

    return (
        Kind("sweep", "Sweep", (SWEEP_FILE,), sweep_sections),
        Kind("stability", "Stability", (STABILITY_FILE,), stability_sections),
        Kind("tradeoff", "Trade-off", (TRADEOFF_FILE,), tradeoff_sections),
        Kind("identification", "Identification", (IDENTIFICATION_FILE,), identification_blocks),
        Kind("comparison", "Comparison", (COMPARISON_FILE,), comparison_sections),
        Kind("run", "Run", (SUMMARY_FILE, HISTORY_FILE), of_run),
    )


def _recognized(folders: Sequence[Path]) -> list[Kind]:
    """Return the kind of every folder.

    Raises:
        ResultsError: Folders of no kind, all at once.
    """
    from postprocess.errors import ResultsError

    known, found, faults = _kinds(), list[Kind](), list[tuple[Path, str]]()
    for folder in folders:
        kind = next((kind for kind in known if any((folder / name).is_file() for name in kind.files)), None)
        if kind is not None:
            found.append(kind)
        elif folder.is_dir():
            there = sorted(entry.name for entry in folder.iterdir())
            faults.append((folder, f"a folder with {', '.join(there[:8]) or 'nothing'}{', ...' if there[8:] else ''}"))
        else:
            faults.append((folder, "a file" if folder.exists() else "no such folder"))
    if faults:
        files = ", ".join(name for kind in known for name in kind.files)
        raise ResultsError(
            faults[0][0],
            found="; ".join([faults[0][1], *(f"{folder}: {words}" for folder, words in faults[1:])]),
            expected=f"a results folder, which holds one of {files}",
            remedy="give the folder that gapbeam run, sweep, stability, tradeoff, identify or compare named",
        )
    return found


def _default(results: Sequence[Path]) -> Path:
    if len(results) == 1:
        return results[0] / NAME
    names = [folder.resolve().name for folder in results]
    rest = names[1] if len(names) == 2 else f"{len(names) - 1}-others"
    return Path("results") / f"{names[0]}-and-{rest}" / NAME


def _check(page: Path, printed: Path, prints: bool, overwrite: bool) -> None:
    """Refuse a page that could not or should not be written.

    Raises:
        OptionError: Another suffix, a report that is there, or a folder that cannot be written.
    """
    from gapbeam.stored_records import refuse_links
    from postprocess.errors import OptionError
    from solver.output.folder import check_folder
    from solver.output.place import check_name

    check_name(page)
    check_name(printed.with_name(printed.name + ".part"))
    refuse_links(places=(page, printed, page.with_name(page.name + ".part")))
    if page.suffix.lower() not in (".html", ".htm"):
        raise OptionError(f"--output {page}: expected a file that ends in .html; its PDF stands beside it")
    there = [path for path in (page, *([printed] if prints else [])) if path.exists()]
    if there and not overwrite:
        told = " and ".join(map(str, there))
        raise OptionError(f"{told} is there already; choose another --output, or pass --overwrite to replace it")
    check_folder(page.parent, overwrite=True)


def _as_sections(blocks: Sequence[Block]) -> list[Section]:
    """Return blocks as sections, those that are none under one heading."""
    from postprocess.report.blocks import Section

    loose = [block for block in blocks if not isinstance(block, Section)]
    sections = [block for block in blocks if isinstance(block, Section)]
    return [*([Section("Findings", "findings", loose)] if loose else []), *sections]


def _renamed(section: Section, prefix: str) -> Section:
    """Return a section with the anchors of those in it made unique."""
    from postprocess.report.blocks import Section

    inner = [
        _renamed(replace(block, anchor=f"{prefix}-{block.anchor}"), prefix) if isinstance(block, Section) else block
        for block in section.blocks
    ]
    return replace(section, blocks=inner)
