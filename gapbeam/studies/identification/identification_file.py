"""File of an identification, read into a problem of unknowns on their scales, experiments and measurements.

All faults of a file are reported in one error.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case, read_tables
from gapbeam.solver.case.reading.overrides import override, pairs, unit_of_key
from gapbeam.solver.case.reading.value_words import flat
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.messages.errors import CaseError, Fault
from gapbeam.solver.messages.wording import either, near
from gapbeam.solver.schema.record_table import COMPONENTS
from gapbeam.studies.identification.identification_tables import (
    Figure,
    ForceFigure,
    FrequencyFigure,
    Identification,
    Measurement,
    MotionFigure,
    Unknown,
    contradictions,
)

FloatArray = np.ndarray
Values = tuple[float, ...]
DIGITS = 12  # of a value that is tried: as it is written, so that it can be tried again


@dataclass(frozen=True)
class Coordinate:
    """An unknown on its scale: 0 at its lower bound, 1 at its upper one.

    Attributes:
        unknown: Key and bounds.
        unit: Unit of its values.
        entries: Length of the list that the key holds; None: a number.
    """

    unknown: Unknown
    unit: str
    entries: int | None = None

    @property
    def logarithmic(self) -> bool:
        """True for a logarithmic scale."""
        return self.unknown.scale == "log"

    def value(self, z: float) -> float:
        """Return the value at a place on the scale, within the bounds."""
        low, high = self._ends()
        t = low + min(max(z, 0.0), 1.0) * (high - low)
        value = 10.0**t if self.logarithmic else t
        return min(max(float(f"{value:.{DIGITS}g}"), self.unknown.lower), self.unknown.upper)

    def place(self, value: float) -> float:
        """Return the place of a value on the scale."""
        low, high = self._ends()
        return ((math.log10(value) if self.logarithmic else value) - low) / (high - low)

    def elasticity(self, z: float) -> float:
        """Return d ln(value) / dz at a place; 0 where the value is 0."""
        low, high = self._ends()
        if self.logarithmic:
            return (high - low) * math.log(10.0)
        value = low + z * (high - low)
        return (high - low) / value if value else 0.0

    def setting(self, value: float) -> object:
        """Return the value of the key."""
        return value if self.entries is None else [value] * self.entries

    def _ends(self) -> tuple[float, float]:
        low, high = self.unknown.lower, self.unknown.upper
        return (math.log10(low), math.log10(high)) if self.logarithmic else (low, high)


@dataclass(frozen=True)
class Experiment:
    """Run shared by all measurements with the same settings.

    Attributes:
        settings: Changes to the case, by key.
        figures: Figures of its measurements.
    """

    settings: Mapping[str, Any]
    figures: tuple[Figure, ...]

    @property
    def label(self) -> str:
        """The settings in words."""
        return ", ".join(f"{key} = {value:.6g}" if isinstance(value, float) else f"{key} = {value}"
                         for key, value in self.settings.items()) or "the case"  # fmt: skip


@dataclass(frozen=True)
class Problem:
    """An identification with its case.

    Attributes:
        file: Its file as read.
        base: The case with what [set] and the command line changed.
        coordinates: The unknowns.
        experiments: Each distinct set of settings.
        places: Number of the experiment of each measurement.
    """

    file: Identification
    base: Case
    coordinates: tuple[Coordinate, ...]
    experiments: tuple[Experiment, ...]
    places: tuple[int, ...]

    @property
    def measurements(self) -> tuple[Measurement, ...]:
        """The measurements, as in the file."""
        return self.file.measurement

    @property
    def fitted(self) -> tuple[int, ...]:
        """Numbers of the measurements that take part in the fit."""
        return tuple(place for place, one in enumerate(self.measurements) if one.use == "fit")

    def values(self, z: FloatArray) -> Values:
        """Return the values of the unknowns at places on their scales, (n,)."""
        return tuple(one.value(float(place)) for one, place in zip(self.coordinates, z, strict=True))

    def scaled(self, values: Values) -> FloatArray:
        """Return the places of values on the scales, (n,)."""
        return np.array([one.place(value) for one, value in zip(self.coordinates, values, strict=True)])

    def settings(self, values: Values) -> dict[str, object]:
        """Return the values of the keys of the unknowns."""
        return {one.unknown.key: one.setting(value) for one, value in zip(self.coordinates, values, strict=True)}

    @property
    def start(self) -> FloatArray:
        """Start values of the file, on the scales, (n,)."""
        given = [one.unknown.start for one in self.coordinates]
        return np.array([0.5 if s is None else one.place(s) for one, s in zip(self.coordinates, given, strict=True)])

    def figure(self, number: int) -> Figure:
        """Return the figure of a measurement."""
        name = self.measurements[number].figure
        return next(figure for figure in self.file.figure if figure.name == name)

    @property
    def everything(self) -> tuple[int, ...]:
        """Numbers of all experiments."""
        return tuple(range(len(self.experiments)))


def read_identification(path: Path, overrides: Sequence[str] = ()) -> Problem:
    """Read the file of an identification with its case.

    Args:
        path: The file.
        overrides: Overrides of the case, texts KEY=VALUE, over those of the file.

    Raises:
        CaseError: A file cannot be read, or there are faults: all of those that can be distinguished from each other.
    """
    file = read_tables(path, Identification, contradictions)
    empty = [name for name in ("unknown", "figure", "measurement") if not getattr(file, name)]
    if empty:
        raise CaseError(
            str(path),
            [Fault((), f"{name} = []", f"at least one [[{name}]]", where=f"{path}: {name}") for name in empty],
        )
    case = path.parent / file.case
    typed = list(pairs(overrides))
    if any(isinstance(entry, Fault) for entry in typed):
        override({}, overrides)
        raise CaseError(str(path), [entry for entry in typed if isinstance(entry, Fault)])
    changes = settings_of(file.set) | dict(entry for entry in typed if not isinstance(entry, Fault))
    places = {key: f"{path}: [set] {key}" for key in settings_of(file.set)}
    try:
        base = read_case(case, changes)
    except CaseError as error:
        raise CaseError(error.source, _placed(error.faults, places)) from error
    faults = [*_case_faults(file, base, path), *_figure_faults(file, base, path)]
    coordinates = tuple(_coordinate(unknown, base) for unknown in file.unknown)
    problem = _problem(file, base, coordinates)
    faults += _experiment_faults(problem, case, changes, places, path)
    if faults:
        raise CaseError(str(path), list({(fault.where, fault.found): fault for fault in faults}.values()))
    return problem


def settings_of(table: Mapping[str, Any], inside: str = "") -> dict[str, Any]:
    """Return a table of overrides as dotted keys; a table with a type is replaced as a whole."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        name = f"{inside}.{key}" if inside else key
        if isinstance(value, Mapping) and "type" not in value:
            found |= settings_of(value, name)
        else:
            found[name] = value
    return found


def _problem(file: Identification, base: Case, coordinates: tuple[Coordinate, ...]) -> Problem:
    """Return the problem: one experiment for every distinct set of settings."""
    settings = [settings_of(one.set) for one in file.measurement]
    distinct = [entry for place, entry in enumerate(settings) if entry not in settings[:place]]
    places = tuple(distinct.index(entry) for entry in settings)
    named = {figure.name: figure for figure in file.figure}
    experiments = []
    for number, entry in enumerate(distinct):
        here = [one for one, place in zip(file.measurement, places, strict=True) if place == number]
        figures = tuple(named[name] for name in dict.fromkeys(one.figure for one in here))
        experiments.append(Experiment(entry, figures))
    return Problem(file, base, coordinates, tuple(experiments), places)


def _coordinate(unknown: Unknown, base: Case) -> Coordinate:
    """Return an unknown with its unit, and the length of the list that its key holds."""
    tables = base.model_dump(mode="json")
    value = flat(tables).get(unknown.key)
    return Coordinate(unknown, unit_of_key(unknown.key, tables), len(value) if isinstance(value, list) else None)


def _case_faults(file: Identification, base: Case, path: Path) -> Iterator[Fault]:
    """Yield contradictions between an identification and its case."""
    where = f"{path}: case = {file.case}"
    frequencies = forcing_frequencies(base.load)
    marched = any(not isinstance(figure, FrequencyFigure) for figure in file.figure)
    if marched and len(frequencies) != 1:
        words = ", ".join(f"{f:g}" for f in frequencies) or "none"
        yield Fault((), f"{words} Hz", "loads of one forcing frequency, whose periods are the windows", where=where)
    if isinstance(base.analysis, Periodic):
        hint = '"analysis.type" = "transient" in [set]'
        yield Fault((), 'analysis.type = "periodic"', '"transient": responses are marched to', hint, where=where)
    if marched and base.time.step == "auto":
        hint = '"time.step" in [set], the number that gapbeam check gives for the case'
        yield Fault((), 'time.step = "auto"', "a step in s: one that changes with the unknowns makes the misfit jump",
                    hint, where=where)  # fmt: skip


def _figure_faults(file: Identification, base: Case, path: Path) -> Iterator[Fault]:
    """Figures of probes and components that the case has."""
    probes = [probe.name for probe in base.probe]
    known, faces = COMPONENTS[base.mesh.dimension], [face.name for face in base.layout.faces]
    frequency = max(forcing_frequencies(base.load), default=1.0)
    for number, figure in enumerate(file.figure, 1):
        where = f'{path}: [[figure]] number {number} (name "{figure.name}")'
        if isinstance(figure, MotionFigure):
            if figure.probe not in probes:
                close = near(figure.probe, probes)
                expected = f"a [[probe]] of the case: {either(probes)}" if probes else "a [[probe]] in the case"
                hint = f'did you mean "{close}"?' if close else ""
                yield Fault((), f'probe = "{figure.probe}"', expected, hint, where=where)
            if figure.component is not None and figure.component not in known:
                yield Fault((), f'component = "{figure.component}"', either(known), where=where)
            samples = figure.average.rate / frequency if figure.average is not None else float("inf")
            if figure.statistic == "harmonic" and samples < 2 * figure.order + 2:
                found = f"{samples:.3g} samples in a forcing period of {1.0 / frequency:g} s"
                yield Fault((), found, f"at least {2 * figure.order + 2} for harmonic {figure.order}",
                            "a higher rate of the average", where=where)  # fmt: skip
        elif isinstance(figure, ForceFigure) and figure.face not in faces:
            close = near(figure.face, faces)
            hint = f'did you mean "{close}"?' if close else ""
            yield Fault((), f'face = "{figure.face}"', f"a face of the case: {either(faces)}", hint, where=where)
        elif isinstance(figure, ForceFigure) and not probes:
            yield Fault((), "no [[probe]] in the case", "at least one, which shows the period", where=where)


def _experiment_faults(
    problem: Problem, case: Path, changes: Mapping[str, Any], places: Mapping[str, str], path: Path
) -> Iterator[Fault]:
    """Every experiment at the start, and the first one at the bounds of every unknown, must be cases without fault."""
    start = problem.values(problem.start)
    settings = problem.settings(start)
    here = dict(places) | {
        one.unknown.key: f"{path}: [[unknown]] number {number} ({one.unknown.key} = {value:g})"
        for number, (one, value) in enumerate(zip(problem.coordinates, start, strict=True), 1)
    }
    for number, experiment in enumerate(problem.experiments):
        owner = problem.places.index(number) + 1
        mine = {key: f"{path}: [[measurement]] number {owner} set {key}" for key in experiment.settings}
        yield from _faults_at(case, {**changes, **experiment.settings, **settings}, here | mine)
    first = problem.experiments[0].settings if problem.experiments else {}
    for number, one in enumerate(problem.coordinates, 1):
        for end in ("lower", "upper"):
            value = getattr(one.unknown, end)
            mine = {one.unknown.key: f"{path}: [[unknown]] number {number} ({one.unknown.key}) {end}"}
            tried = {**changes, **first, **settings, one.unknown.key: one.setting(value)}
            yield from _faults_at(case, tried, here | mine)


def _faults_at(case: Path, overrides: Mapping[str, Any], places: Mapping[str, str]) -> list[Fault]:
    try:
        read_case(case, overrides)
    except CaseError as error:
        return _placed(error.faults, places)
    return []


def _placed(faults: Sequence[Fault], places: Mapping[str, str]) -> list[Fault]:
    """Return faults of overrides with the place in the file of the identification that they come from."""
    found = []
    for fault in faults:
        where = fault.where
        for key in sorted(places, key=len, reverse=True):
            where = re.sub(rf"`overrides=` {re.escape(key)}(?![\w.])", lambda _, key=key: places[key], where)  # type: ignore[misc]
        found.append(replace(fault, where=where))
    return found
