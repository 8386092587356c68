"""What else the beam of the experiment may do: responses from other starts, and on stiff contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.blocks import Block, ReportSection, Words
from gapbeam.postprocess.report.sections.sweep_section import sweep_sections
from gapbeam.postprocess.signals.figure_names import SMOOTHED_ACCELERATION
from gapbeam.postprocess.study_figures.response_census import census
from gapbeam.solver.record_table import STANDARD_GRAVITY
from gapbeam.studies.paper.identified_values import CASE
from gapbeam.studies.paper.printed_figures import printed
from gapbeam.studies.sweep.run_sweep import run_sweep
from gapbeam.studies.sweep.sweep_plan import Sweep
from gapbeam.studies.trials.axes import read_axis

COMMAND = "environment/run gapbeam paper"
STARTS = 4
SAME = 0.02
FIGURE = f"test {SMOOTHED_ACCELERATION}"
SHOWN = {"summary", "response-curves", "responses"}
STIFF = (
    "contact.stiffness=auto",
    "contact.damping=0.0",
    "load.exciter.amplitude=20.0",
    "load.exciter.point=0.15",
    "load.exciter.mass=0.0",
    "time.step=1e-4",
    "output.history_interval=1e-4",
)
Records = Sequence[dict[str, Any]]


def other_responses(folder: Path, clearances: Sequence[float], settings: Mapping[str, object]) -> list[Block]:
    """Start the identified beam, and one on stiff contact under a bare force, from several states at each clearance.

    Args:
        folder: Where the case of the experiment is; sweeps go into folders in it.
        clearances: m.
        settings: The identified values, by key.
    """
    axis = "support.clearance=" + ",".join(f"{one:.6g}" for one in clearances)
    soft = _swept(folder, "starts", axis, [f"{key}={value!r}" for key, value in settings.items()])
    stiff = _swept(folder, "rattling", axis, STIFF)
    return [
        Words(
            f"Every clearance from {STARTS} starts, the seat and random kicks. {_coexisting(soft)} Which of several "
            "responses is seen hangs on how a test begins."
        ),
        *_sections(folder / "starts", "identified"),
        Words(
            "The same beam as it is often modeled, on contact as stiff as the computed default under a bare force of "
            f"20 N at 150 mm: {_rattling(stiff)}"
        ),
        *_sections(folder / "rattling", "rattling"),
    ]


def _swept(folder: Path, name: str, axis: str, overrides: Sequence[str]) -> Records:
    """Run a sweep, or go on with it, and return its records."""
    wanted = Sweep(folder / CASE, tuple(overrides), (read_axis(axis, "linear", ""),), starts=STARTS)
    return run_sweep(wanted, folder / name).records


def _coexisting(records: Records) -> str:
    points = census(list(records), SAME)
    several = [point for point in points if point.coexisting > 1]
    unsettled = sum(point.unsettled for point in points)
    left = f" {unsettled} responses have not settled, so that they cannot tell." if unsettled else ""
    if not several:
        return f"All that have settled are the same response at each of the {len(points)} clearances.{left}"
    words = []
    for point in several:
        peaks = sorted(float(branch.figures[FIGURE][0]) for branch in point.branches if branch.settled)
        clearance = 1e3 * float(point.values["support.clearance"])
        words.append(f"{clearance:g} mm ({', '.join(f'{peak / STANDARD_GRAVITY:.2f}' for peak in peaks)} g)")
    return f"More than one response is found at {len(several)} of {len(points)} clearances: {'; '.join(words)}.{left}"


def _rattling(records: Records) -> str:
    passed = [record for record in records if record["verdict"] == "passed"]
    wild = sum(record.get("response") == "no cycle" for record in passed)
    largest = max(printed()["experiment"]["peak_to_peak_g"])
    loose = [
        record for record in passed if float(record["values"]["support.clearance"]) > 0.0 and record.get("figures")
    ]
    peaks = [float(record["figures"][FIGURE]["mean_in_g"]) for record in loose]
    return (
        f"{wild} of {len(passed)} responses have no cycle, as chaotic ones have none, and where there is play their "
        f"smoothed peak to peak is {min(peaks):.2g} to {max(peaks):.2g} g, against {largest:g} g at most in Table 4. "
        "Figures are means over windows with their scatter."
    )


def _sections(folder: Path, name: str) -> list[Block]:
    """Return the sections of a sweep with anchors of their own."""
    return [
        ReportSection(f"{section.title}, {name}", f"section-4-{name}-{section.anchor}", section.blocks)
        for section in sweep_sections(folder, COMMAND)
        if section.anchor in SHOWN
    ]
