"""Which runs section 3 of the paper needs, and the printed figures that they are held against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gapbeam.studies.paper.adams_runs import EXCITER, FORCE, PLACE, Asked, RunFigures, geometric_mean
from gapbeam.studies.paper.printed_figures import printed

COMMAND = "environment/run gapbeam run cases/li2013-adams.toml"
ELASTIC = " --set model.type=beam --set damping.frequencies=[40,300] --set damping.ratios=[0.01,0.01]"
SUSPENDED = "".join(f" --set load.shaker.{key}={value:g}" for key, value in EXCITER.items())
TEXT = " --set contact.law.full_depth=1e-5"
FORCES = (0.0, 2.0, 5.0, FORCE, 15.0, 20.0, 30.0)  # N
PLACES = (0.1, 0.2, 0.3)  # m
LONG = 40  # forcing periods of the runs that the factors are taken from
OTHER_MODELS = {
    "102 beam elements": (("type", "beam"), ("elements", 102)),
    "plane stress, reduced": (("type", "reduced"),),
}

Runs = Mapping[Asked, RunFigures]


def main_runs() -> list[Asked]:
    """Return the runs of figures and factors: clearances, damping, beam and exciter in all combinations."""
    return [
        main_run(clearance, depth, elastic, suspended)
        for clearance in clearances()
        for depth in depths()
        for elastic in (False, True)
        for suspended in (False, True)
    ]


def main_run(clearance: float, depth: float, elastic: bool = False, suspended: bool = False) -> Asked:
    """Return one of these runs."""
    return Asked(clearance, depth, elastic, suspended, periods=LONG, drawn=not suspended)


def variants() -> dict[str, list[Asked]]:
    """Return the runs of the sensitivities by what is changed, with full damping where the text has it."""
    table, text = depths()
    changes: dict[str, dict[str, Any]] = {f"force {force:g} N": {"force": force} for force in FORCES}
    changes |= {f"force at {place:g} m, not {PLACE:g} m": {"place": place} for place in PLACES}
    changes |= {
        "no gravity": {"gravity": 0.0},
        "from the seat": {"start": "seat"},
        "half the step": {"step": 5.0e-6},
        f"full damping at {table:g} mm": {"depth": table},
        f"full damping at {table:g} mm, half the step": {"depth": table, "step": 5.0e-6},
    }
    both = [Asked(clearance, text, elastic) for elastic in (False, True) for clearance in ends()]
    found = {name: [replace(one, **change) for one in both] for name, change in changes.items()}
    for name, model in OTHER_MODELS.items():
        found[name] = [Asked(clearance, text, True, model=model) for clearance in ends()]
    return found


def clearances() -> list[float]:
    """Return those of Table 1, mm."""
    return list(printed()["adams"]["clearance_mm"])


def ends() -> tuple[float, float]:
    """Return the smallest and the largest of these, mm."""
    return clearances()[0], clearances()[-1]


def depths() -> tuple[float, float]:
    """Return the penetration of full damping by Table 2 and by the text, mm."""
    adams = printed()["adams"]
    return adams["penetration"], adams["penetration_in_text"]


def measured(clearance: float) -> float:
    """Return the peak to peak of Table 4 at a clearance, g."""
    experiment = printed()["experiment"]
    return float(experiment["peak_to_peak_g"][experiment["clearance_mm"].index(clearance)])


def over_experiment(runs: Runs, depth: float, kind: str, elastic: bool = False, suspended: bool = False) -> float:
    """Return a peak to peak of the main runs over that of Table 4, geometric mean of the clearances.

    Args:
        runs: The runs.
        depth: Penetration of full damping, mm.
        kind: Name of a peak to peak of `RunFigures`.
        elastic: Of the elastic beam.
        suspended: Of the exciter with its suspension.
    """
    found = [runs[main_run(clearance, depth, elastic, suspended)] for clearance in clearances()]
    return geometric_mean([getattr(words, kind) / measured(words.asked.clearance) for words in found])
