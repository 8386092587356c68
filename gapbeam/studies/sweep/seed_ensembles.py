"""The points of a sweep that differ in the seeds of their noise only: members of an ensemble, with one interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gapbeam.solver.diagnostics.statistics.pooled_members import FEWEST, pooled_figures
from gapbeam.solver.diagnostics.statistics.statistic_figures import may_be_asked
from gapbeam.solver.messages.wording import counted

LOAD, SEED = "load.", ".seed"


@dataclass(frozen=True)
class Ensemble:
    """Members that differ in seeds only.

    Attributes:
        values: Values of the other keys of the sweep, as typed.
        members: Number of members.
        seconds: Seconds of all records behind the burn-ins, s.
        figures: Pooled, as `pooled_figures` returns them.
    """

    values: dict[str, str]
    members: int
    seconds: float
    figures: list[dict[str, Any]]

    def as_data(self) -> dict[str, Any]:
        """Return the ensemble for JSON."""
        return vars(self)


def ensembles_of(records: Sequence[Mapping[str, Any]]) -> list[Ensemble]:
    """Return the ensembles of two members and more among the responses of a sweep, in the order of the points.

    Members have passed, and have statistics. Responses from other starts, or carried ones, are no members.
    """
    groups: dict[tuple[tuple[str, str], ...], dict[tuple[str, ...], Mapping[str, Any]]] = {}
    for record in records:
        seeds = tuple(value for key, value in record["values"].items() if is_seed(key))
        if not seeds or record["verdict"] != "passed" or not (record.get("statistics") or {}).get("figures"):
            continue
        others = tuple((key, value) for key, value in record["values"].items() if not is_seed(key))
        groups.setdefault(others, {}).setdefault(seeds, record)
    return [
        _pooled(dict(others), list(members.values())) for others, members in groups.items() if len(members) >= FEWEST
    ]


def is_seed(key: str) -> bool:
    """Return whether a key of a sweep is the seed of a load."""
    return key.startswith(LOAD) and key.endswith(SEED)


def ensemble_words(one: Ensemble) -> str:
    """Return the result of an ensemble and the need of its least certain figure, in one line."""
    known = [figure for figure in one.figures if figure["relative"] is not None and may_be_asked(figure["name"])]
    words = f"{counted(one.members, 'member')}, {one.seconds:.6g} s together"
    if not known:
        return words
    widest = max(known, key=lambda figure: float(figure["relative"]))
    need = float(widest["time_for_2_percent"])
    return (
        f"{words}; least certain: {widest['name']} +- {widest['relative']:.1%} of {widest['effective_samples']:.0f} "
        f"independent samples, relative variance {widest['relative_variance_times_time']:.3g} / T[s], "
        f"2 % takes {need:.3g} s, {need / one.members:.3g} s of each member"
    )


def _pooled(values: dict[str, str], members: list[Mapping[str, Any]]) -> Ensemble:
    found = [member["statistics"] for member in members]
    seconds = sum(float(one["seconds"]) - float(one["burn_in"]) for one in found)
    return Ensemble(values, len(members), seconds, pooled_figures(found))
