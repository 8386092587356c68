"""The report on the folder of `gapbeam compare`: verdict, figures, waveforms and costs of both runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Command,
    Picture,
    ReportSection,
    TableBlock,
    Verdict,
    warnings_of,
)
from gapbeam.postprocess.report.markdown_text import sentence
from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.shell_command import shell_command

COMPARISON_FILE, PICTURE = "comparison.json", "comparison.png"
_KEYS = ("a", "b", "agree", "verdict", "tolerance", "runs", "figures", "waveforms", "costs", "notes")


def comparison_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return what `gapbeam compare` found.

    Args:
        folder: As `gapbeam compare` left it.
        command: That makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no comparison.
    """
    found = read_object(folder / COMPARISON_FILE, _KEYS)
    blocks = comparison_blocks(found, command)
    pair = Path(found["a"]), Path(found["b"])
    if (folder / PICTURE).is_file():
        words = "Waveforms of A and B over each other, and their harmonics."
        blocks.append(Picture(folder / PICTURE, words, shell_command("gapbeam", "compare", *pair)))
    blocks.append(Command(shell_command("gapbeam", "report", *pair)))
    return [ReportSection("A against B", "comparison", blocks)]


def comparison_blocks(found: Mapping[str, Any], command: str) -> list[Block]:
    """Return verdict and tables of a comparison.

    Args:
        found: As `gapbeam.postprocess.comparison.comparison_report.as_data` gives it.
        command: That makes the report.
    """
    blocks: list[Block] = [Verdict("passed" if found["agree"] else "warning", sentence(str(found["verdict"])))]
    blocks += warnings_of([str(note) for note in found["notes"]])
    runs = [
        (
            name.upper(), found[name], run["periodicity"], run["windows"], run["forcing_periods_in_a_window"],
            float(run["start"]), float(run["end"]),
        )
        for name, run in found["runs"].items()
    ]  # fmt: skip
    heads = ("", "results", "response", "windows", "forcing periods in a window", "from (s)", "to (s)")
    blocks.append(TableBlock("The runs, and the windows over which they are compared", heads, runs))
    figures: list[tuple[Cell, ...]] = []
    for row in found["figures"]:
        unit, factor = shown(row["unit"])
        difference = row["difference"]
        figures.append(
            (
                f"{row['name']} ({unit})", factor * row["a"], factor * row["b"],
                None if difference is None else 100.0 * difference, "" if row["decides"] else "reported only",
            )
        )  # fmt: skip
    blocks.append(
        TableBlock(
            f"Figures over the windows; more than {100 * found['tolerance']:g} % is a difference",
            ("", "A", "B", "difference (%)", ""),
            figures,
            command=command,
        )
    )
    waves = [(one["name"], 100.0 * one["rms"], 100.0 * one["largest"]) for one in found["waveforms"]]
    if waves:
        blocks.append(TableBlock("Waveforms, A − B over the range", ("", "rms (%)", "largest (%)"), waves, digits=3))
    costs = [(one["name"], one["a"], one["b"]) for one in found["costs"]]
    if costs:
        blocks.append(TableBlock("Costs", ("", "A", "B"), costs))
    return blocks
