"""Report on results folders of any kind, on several runs as a comparison, or on a span of time of one run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, TableBlock, Verdict, Words
from gapbeam.postprocess.report.sections.atlas_section import (
    ATLAS_FILE,
    ATLAS_KEYS,
    LIBRARY_FILE,
    OPTIMUM_FILE,
    atlas_sections,
    beside_curve,
    library_sections,
    optimum_sections,
)
from gapbeam.postprocess.report.sections.contact_section import wear_section
from gapbeam.postprocess.report.sections.curve_section import (
    COMPARISON_FILE,
    LIFE_FILE,
    comparison_sections,
    life_sections,
)
from gapbeam.postprocess.report.sections.run_section import (
    case_section,
    meta_of,
    names_of,
    run_report,
    sections_of_records,
    several_sections,
)
from gapbeam.postprocess.report.sections.scene_section import scene_of
from gapbeam.postprocess.report.sections.statistics_section import (
    energy_of_span,
    impacts_section,
    peak_rows,
    statistics_section,
)
from gapbeam.postprocess.report.sections.sweep_section import (
    SWEEP_FILE,
    UNCERTAIN_FILE,
    sweep_sections,
    uncertain_sections,
)
from gapbeam.postprocess.report.sections.tradeoff_section import (
    IDENTIFICATION_FILE,
    STABILITY_FILE,
    TRADEOFF_FILE,
    identification_blocks,
    stability_sections,
    tradeoff_sections,
)
from gapbeam.postprocess.report.sections.verdict_section import FIGURE_HEADS, run_verdicts
from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results.run_watch import SpanOfRun
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.signals.signal import SignalError, turning_in
from gapbeam.solver.schema.record_table import CURVE_FILE, HISTORY_FILE, SUMMARY_FILE


def report_on(folders: Sequence[Path], command: str, kinds: Sequence[Kind]) -> Report:
    """Return the report on results folders, several runs as a comparison.

    Args:
        folders: Folders, at least one.
        command: Command that makes the report.
        kinds: Kind of every folder, of `recognized`.

    Raises:
        ResultsError: A file that cannot be read.
    """
    if all(kind is RUN for kind in kinds):
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
        _renamed(
            ReportSection(f"{kind.title}: {folder}", f"part-{number}", kind.blocks(folder, command)), f"part-{number}"
        )
        for number, (kind, folder) in enumerate(zip(kinds, folders, strict=True), start=1)
    ]
    parts += _beside_curves(folders)
    return Report("Results", ", ".join(f"`{folder}`" for folder in folders), parts, meta)


def _beside_curves(folders: Sequence[Path]) -> Iterator[ReportSection]:
    """Yield a section for each atlas and each response curve over its key: responses that are not on the curve."""
    curves = [folder for folder in folders if (folder / CURVE_FILE).is_file()]
    for number, atlas in enumerate(folder for folder in folders if (folder / ATLAS_FILE).is_file()):
        records = read_records(atlas / ATLAS_FILE, ATLAS_KEYS)
        for place, folder in enumerate(curves):
            curve = read_object(folder / CURVE_FILE, ("key", "unit", "periods", "points"))
            section = beside_curve(curve, records)
            if section is not None:
                yield _renamed(replace(section, title=f"{section.title} at {folder}"), f"beside-{number}-{place}")


@dataclass(frozen=True)
class Kind:
    """A kind of results folder.

    Attributes:
        name: Kind in one word.
        title: Kind in a heading.
        files: Names of files, of which every such folder has one.
        blocks: Function that returns the blocks on a folder, given the command that makes the report.
    """

    name: str
    title: str
    files: tuple[str, ...]
    blocks: Callable[[Path, str], Sequence[Block]]


def _of_run(folder: Path, command: str) -> Sequence[ReportSection]:
    return run_report(open_results(folder), command).sections


RUN = Kind("run", "Run", (SUMMARY_FILE, HISTORY_FILE), _of_run)


def recognized(folders: Sequence[Path], kinds: Sequence[Kind]) -> list[Kind]:
    """Return the kind of every folder.

    Args:
        folders: Folders of results.
        kinds: All kinds, the most particular first.

    Raises:
        ResultsError: Folders of no kind, all at once.
    """
    found, faults = list[Kind](), list[tuple[Path, str]]()
    for folder in folders:
        kind = next((kind for kind in kinds if any((folder / name).is_file() for name in kind.files)), None)
        if kind is not None:
            found.append(kind)
        elif folder.is_dir():
            there = sorted(entry.name for entry in folder.iterdir())
            faults.append((folder, f"a folder with {', '.join(there[:8]) or 'nothing'}{', ...' if there[8:] else ''}"))
        else:
            faults.append((folder, "a file" if folder.exists() else "no such folder"))
    if faults:
        files = ", ".join(name for kind in kinds for name in kind.files)
        raise ResultsError(
            faults[0][0],
            found="; ".join([faults[0][1], *(f"{folder}: {words}" for folder, words in faults[1:])]),
            expected=f"a results folder, which holds one of {files}",
            remedy="give the folder that gapbeam run or a study such as gapbeam sweep named",
        )
    return found


def _as_sections(blocks: Sequence[Block]) -> list[ReportSection]:
    """Return blocks as sections, those that are none under one heading."""
    loose = [block for block in blocks if not isinstance(block, ReportSection)]
    sections = [block for block in blocks if isinstance(block, ReportSection)]
    return [*([ReportSection("Findings", "findings", loose)] if loose else []), *sections]


def _renamed(section: ReportSection, prefix: str) -> ReportSection:
    """Return a section with the anchors of those in it made unique."""
    inner = [
        _renamed(replace(block, anchor=f"{prefix}-{block.anchor}"), prefix)
        if isinstance(block, ReportSection)
        else block
        for block in section.blocks
    ]
    return replace(section, blocks=inner)


NO_SCENE = (
    "There is no moving scene: the run left fewer than three fields of the motion in this span. A longer span, or a "
    "run with a smaller `output.fields_interval`, has them."
)


def span_report(
    run: SpanOfRun, statistics: Mapping[str, Any] | None, command: str, wear: Mapping[str, Any] | None = None
) -> Report:
    """Return the report on a span of a run: the end of the run, and its records and fields within the span.

    Args:
        run: The span.
        statistics: Statistics of its records, as the summary of a run has them; None: the run has none.
        command: Command that makes the report.
        wear: Wear of the span, in the form of the summary of a run; None: nothing wears.

    Raises:
        ResultsError: A file of the results cannot be read.
    """
    first, last = run.times
    span = f"from t = {first:.6g} to {last:.6g} s"
    words = (
        f"Records {span}, of a run to {float(run.whole_history['time'][-1]):.6g} s. Gates, margins, maps of wear and "
        "the loads that were generated belong to the whole run: see the report without `--from` and `--to`."
    )
    opening: list[Block] = [*run_verdicts(run), *_scene(run, command), Words(words)]
    if rows := peak_rows(run.history):
        opening.append(TableBlock(f"Results {span}", FIGURE_HEADS, rows))
    chance = statistics_section({"statistics": statistics}) if statistics else None
    impacts = impacts_section(run.impacts, last - first, span, turning_in(run.history))
    worn = None if wear is None else wear_section({"wear": wear}, {}, command, since=f"t = {first:.6g} s")
    records = sections_of_records(run, command)
    rest = [chance, worn, *records, impacts, *_energy(run, command), case_section(run)]
    sections = [ReportSection("Summary", "summary", opening), *(one for one in rest if one is not None)]
    return Report(f"{run.title}, {span}", f"Run in `{run.folder}`", sections, meta_of(run, command))


def _scene(run: SpanOfRun, command: str) -> list[Block]:
    """Return the moving scene of the fields in the span, or why there is none."""
    try:
        scene = scene_of(run, command, run.begin, run.end)
    except (ResultsError, SignalError) as fault:
        return [Verdict("warning", f"There is no moving scene: {fault}")]
    return [Words(NO_SCENE)] if scene is None else [scene]


def _energy(run: SpanOfRun, command: str) -> list[ReportSection]:
    try:
        found = energy_of_span(run.history, command)
    except SignalError as fault:
        return [ReportSection("Energy", "energy", [Verdict("error", str(fault))])]
    return [] if found is None else [found]


_KINDS = (
    Kind("sweep", "Sweep", (SWEEP_FILE,), sweep_sections),
    Kind("stability", "Stability", (STABILITY_FILE,), stability_sections),
    Kind("tradeoff", "Trade-off", (TRADEOFF_FILE,), tradeoff_sections),
    Kind("atlas", "Atlas", (ATLAS_FILE,), atlas_sections),
    Kind("uncertain", "Uncertain values", (UNCERTAIN_FILE,), uncertain_sections),
    Kind("identification", "Identification", (IDENTIFICATION_FILE,), identification_blocks),
    Kind("optimum", "Optimum", (OPTIMUM_FILE,), optimum_sections),
    Kind("library", "Library", (LIBRARY_FILE,), library_sections),
    Kind("life", "Life", (LIFE_FILE,), life_sections),
    Kind("comparison", "Comparison", (COMPARISON_FILE,), comparison_sections),
)
KINDS = {kind.name: kind for kind in _KINDS}
"""Kinds by their names."""
