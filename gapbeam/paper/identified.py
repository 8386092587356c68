"""What the paper does not print, identified from its Table 4."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from gapbeam.identify import identify
from postprocess.identified import read_identification_data

CASE = "experiment.toml"
FITTED, ALL, WIDE, PLACED = "table4", "table4-all", "table4-unknowns", "table4-place"
LEAVE_ONE_OUT = (ALL,)
PLACES = (0.15, 0.2, 0.35)  # m, of the exciter, beside that of the case


def copied(folder: Path) -> None:
    """Put the case of the experiment and its identifications into a folder, as they come with gapbeam."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in (CASE, *(f"{study}.toml" for study in (FITTED, ALL, WIDE, PLACED))):
        text = files("gapbeam.paper").joinpath(name).read_text(encoding="utf-8")
        (folder / name).write_text(text, encoding="utf-8")


def identified(study: str, folder: Path, overrides: Sequence[str] = (), name: str = "") -> dict[str, Any]:
    """Run an identification of Table 4, or go on with it, and return what it found.

    Args:
        study: Name of its file, without ending.
        folder: Where the copies of the files are; results go into a folder in it.
        overrides: Keys of the case, KEY=VALUE.
        name: Of the folder; by default that of the study.

    Returns:
        The content of its `identification.json`, with "exit_status".

    Raises:
        ResultsError: No set of values passed in all experiments.
    """
    results = folder / (name or study)
    status = identify(folder / f"{study}.toml", list(overrides), study in LEAVE_ONE_OUT, results, None, False)
    return read_identification_data(results) | {"exit_status": status}


def settings_of(found: dict[str, Any]) -> dict[str, object]:
    """Return what an identification sets the keys of the case to."""
    return {unknown["key"]: unknown["value"] for unknown in found["unknowns"]}


def by_place(folder: Path, found: dict[str, Any]) -> list[tuple[float, dict[str, Any]]]:
    """Return the identification from all clearances for several places of the exciter, with that of the case.

    Args:
        folder: Where the copies of the files are.
        found: With the place of the case.
    """
    place = placed(folder / CASE)
    others = [(x, identified(PLACED, folder, [f"load.exciter.point={x:g}"], f"{PLACED}-{x:g}")) for x in PLACES]
    return sorted([(place, found), *others], key=lambda pair: pair[0])


def placed(case: Path) -> float:
    """Return the place of the exciter in a case, m."""
    from solver.case_file.reader import read_case

    load = next(load for load in read_case(case).load if load.type == "exciter")
    assert isinstance(load.point, float)
    return load.point
