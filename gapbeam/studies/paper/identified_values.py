"""What the paper does not print, identified from its Table 4."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from gapbeam.postprocess.study_figures.identification_figures import read_identification_data
from gapbeam.studies.identification.identification_file import read_identification
from gapbeam.studies.identification.run_identification import run_identification
from gapbeam.studies.paper.printed_figures import printed

CASE = "experiment.toml"
FITTED, ALL, WIDE, PLACED = "table4", "table4-all", "table4-unknowns", "table4-place"
LEAVE_ONE_OUT = (ALL,)
PLACES = (0.15, 0.2, 0.35)  # m, of the exciter, beside that of the case


def copied(folder: Path) -> None:
    """Put the case of the experiment and its identifications into a folder, as they come with gapbeam."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in (CASE, *(f"{study}.toml" for study in (FITTED, ALL, WIDE, PLACED))):
        text = files("gapbeam.studies.paper").joinpath(name).read_text(encoding="utf-8")
        (folder / name).write_text(text, encoding="utf-8")


def identified(study: str, folder: Path, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Run an identification of Table 4, or go on with it, and return what it found.

    Args:
        study: Name of its file, without ending.
        folder: Where the copies of the files are; results go into a folder in it.
        overrides: Keys of the case, KEY=VALUE.

    Returns:
        The content of its `identification.json`, with "exit_status".

    Raises:
        ResultsError: No set of values passed in all experiments.
    """
    results = folder / study
    problem = read_identification(folder / f"{study}.toml", overrides)
    result = run_identification(problem, results, study in LEAVE_ONE_OUT)
    return read_identification_data(results) | {"exit_status": result.exit_status}


def settings_of(found: dict[str, Any]) -> dict[str, float]:
    """Return what an identification sets the keys of the case to."""
    return {unknown["key"]: float(unknown["value"]) for unknown in found["unknowns"]}


def by_place(folder: Path, found: dict[str, Any]) -> list[tuple[float, dict[str, Any]]]:
    """Return the identification from all clearances for several places of the exciter, with that of the case.

    Args:
        folder: Where the copies of the files are.
        found: With the place of the case.
    """
    place = placed(folder / CASE)
    known = settings_of(found)
    others = []
    for x in PLACES:
        study = f"{PLACED}-{x:g}"
        text = (folder / f"{PLACED}.toml").read_text(encoding="utf-8")
        (folder / f"{study}.toml").write_text(_started(text, known, place, x), encoding="utf-8")
        others.append((x, identified(study, folder, [f"load.exciter.point={x:g}"])))
    return sorted([(place, found), *others], key=lambda pair: pair[0])


def _started(text: str, known: dict[str, float], place: float, x: float) -> str:
    """Return a study that starts where force and mass have the same moments about the edge of the base."""
    arm = (place - printed()["beam"]["support_length"]) / (x - printed()["beam"]["support_length"])
    starts = {
        "contact.stiffness": known["contact.stiffness"],
        "load.exciter.amplitude": known["load.exciter.amplitude"] * arm,
        "load.exciter.mass": known["load.exciter.mass"] * arm**2,
    }
    for key, value in starts.items():
        text = re.sub(rf'(key = "{re.escape(key)}".*?\nstart = )[^\n]*', rf"\g<1>{value:.4g}", text, flags=re.S)
    return text


def placed(case: Path) -> float:
    """Return the place of the exciter in a case, m."""
    from gapbeam.solver.case.reading.case_reader import read_case

    load = next(load for load in read_case(case).load if load.attachment is not None)
    assert isinstance(load.place.point, float)
    return load.place.point
