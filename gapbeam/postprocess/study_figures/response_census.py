"""The census of a sweep: which responses coexist at a point, and how many starts reached each.

Two responses are the same if they have the same cycle, or one has not quite settled, and every amplitude is the same
within the tolerance, the scatter of both, and what the rest of their transients may change: of acceleration (2.5 ms
mean) and displacement at every probe. Responses coexist where two that have settled are not the same: what has not
settled may still become any of them, and what has no cycle has settled only where several windows show its scatter.
Responses that have statistics, random and chaotic ones, differ only where 95 % intervals of one of them are disjoint:
of the rms of a probe, or of the contact share of a face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

Record = Mapping[str, Any]

CREEPING = "not settled"
CYCLE, WILD, RANDOM = "period ", "no cycle", "random"
AMPLITUDES = (" displacement", " smoothed acceleration")
DECIDING = ("rms", "lateral_rms", "contact_share")  # statistics whose intervals are compared


@dataclass(frozen=True)
class Branch:
    """One of the responses at a point.

    Attributes:
        values: Of the keys of the sweep, as typed.
        word: "period 1", "no cycle", "random", "not settled", ...
        members: The records that found it.
    """

    values: dict[str, str]
    word: str
    members: tuple[Record, ...]

    @property
    def settled(self) -> bool:
        """True where the response has settled: to a cycle, or to a motion that never repeats."""
        return self.word in (WILD, RANDOM) or self.word.startswith(CYCLE)

    @property
    def count(self) -> int:
        """Number of members that reached the response."""
        return len(self.members)

    @property
    def figures(self) -> dict[str, tuple[float, float, str]]:
        """Figures by name: mean over the members, scatter (within and between them), unit."""
        found = {}
        for name, figure in self.members[0]["figures"].items():
            entries = [member["figures"][name] for member in self.members if name in member["figures"]]
            means = np.array([entry["mean"] for entry in entries])
            within = np.mean([entry["scatter"] ** 2 for entry in entries])
            found[name] = float(means.mean()), float(np.sqrt(within + means.var())), str(figure["unit"])
        return found

    @property
    def reached_from(self) -> list[str]:
        """Starts and directions that led to it."""
        return [" ".join(filter(None, (member["start"], member["direction"]))) for member in self.members]


@dataclass(frozen=True)
class SweepPoint:
    """Result of one point of a sweep.

    Attributes:
        values: Of the keys, as typed.
        branches: The responses, the one that was reached most often first.
        failures: Records of what did not pass, or has no figures.
    """

    values: dict[str, str]
    branches: tuple[Branch, ...]
    failures: tuple[Record, ...]

    @property
    def coexisting(self) -> int:
        """Number of different responses that have settled."""
        return sum(branch.settled for branch in self.branches)

    @property
    def unsettled(self) -> int:
        """Number of starts whose response has not settled, nor comes near to one that has."""
        return sum(branch.count for branch in self.branches if branch.word == CREEPING)


def census_words(points: Sequence[SweepPoint]) -> list[str]:
    """Return at how many points responses coexist, and how many responses cannot tell, a clause each."""
    several, unsettled = sum(point.coexisting > 1 for point in points), sum(point.unsettled for point in points)
    words = [f"{several} of {len(points)} points have more than one response"]
    if unsettled:
        words.append(f"{unsettled} responses have not settled, so that they cannot tell: try a larger time.end")
    return words


def census(records: Sequence[Record], tolerance: float) -> list[SweepPoint]:
    """Sort the records of a sweep into points, and those of a point into responses.

    Args:
        records: In the order of the points.
        tolerance: Relative difference of amplitudes that are the same.
    """
    places: dict[tuple[tuple[str, str], ...], list[Record]] = {}
    for record in records:
        places.setdefault(tuple(record["values"].items()), []).append(record)
    points = []
    for values, there in places.items():
        good = [record for record in there if record["verdict"] == "passed" and record.get("figures")]
        groups = _grouped([record for record in good if _kind(record, tolerance) != CREEPING], tolerance)
        creeping = list[Record]()
        for record in good:
            if _kind(record, tolerance) == CREEPING:
                near = [group for group in groups if any(_same(record, other, tolerance) for other in group)]
                (max(near, key=len) if near else creeping).append(record)
        groups += _grouped(creeping, tolerance)
        groups.sort(key=len, reverse=True)
        branches = tuple(Branch(dict(values), _word(group, tolerance), tuple(group)) for group in groups)
        points.append(SweepPoint(dict(values), branches, tuple(record for record in there if record not in good)))
    return points


def _grouped(records: Sequence[Record], tolerance: float) -> list[list[Record]]:
    """Return groups of records each of which is the same as another of its group."""
    groups: list[list[Record]] = []
    for record in records:
        joined = [group for group in groups if any(_same(record, other, tolerance) for other in group)]
        others = [group for group in groups if not any(group is one for one in joined)]
        groups = [*others, [*chain.from_iterable(joined), record]]
    return groups


def _kind(record: Record, tolerance: float) -> str:
    """Return the kind of a response: without a cycle only where it repeats in none and windows show its scatter."""
    word = str(record["response"])
    near = record.get("windows", 2) < 2 or record.get("repeats_within", np.inf) <= tolerance
    return CREEPING if word == WILD and near else word


def _word(group: Sequence[Record], tolerance: float) -> str:
    words = [_kind(record, tolerance) for record in group]
    return next((word for word in words if word != CREEPING), CREEPING)


def _same(one: Record, other: Record, tolerance: float) -> bool:
    if len({_kind(one, tolerance), _kind(other, tolerance)} - {CREEPING}) > 1:
        return False
    pairs = _intervals(one, other)
    if pairs:
        return all(a["low"] <= b["high"] and b["low"] <= a["high"] for a, b in pairs)
    for name in one["figures"]:
        if name.endswith(AMPLITUDES) and name in other["figures"]:
            a, b = one["figures"][name], other["figures"][name]
            allowed = tolerance * max(abs(a["mean"]), abs(b["mean"])) + a["scatter"] + b["scatter"]
            allowed += a.get("unsettled", 0.0) + b.get("unsettled", 0.0)
            if abs(a["mean"] - b["mean"]) > allowed:
                return False
    return True


def _intervals(one: Record, other: Record) -> list[tuple[Record, Record]]:
    """Return the deciding figures of two responses that both know with an interval."""
    names = [name for name in one["figures"] if name.rpartition(".")[2] in DECIDING and name in other["figures"]]
    pairs = [(one["figures"][name], other["figures"][name]) for name in names]
    return [(a, b) for a, b in pairs if "low" in a and "low" in b]
