"""An identification as it is computed: unknowns on their scales, experiments, measurements."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.studies.identification.identification_tables import Figure, Identification, Measurement, Unknown

FloatArray = np.ndarray
Values = tuple[float, ...]
DIGITS = 12  # of a value that is tried: as it is written, so that it can be tried again


@dataclass(frozen=True)
class Coordinate:
    """An unknown on its scale: 0 at its lower bound, 1 at its upper one.

    Attributes:
        unknown: Key and bounds.
        unit: Of its values.
        entries: Length of the list that the key holds; None: a number.
    """

    unknown: Unknown
    unit: str
    entries: int | None = None

    @property
    def logarithmic(self) -> bool:
        """Whether the scale is that of the logarithm."""
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
        """Return what the key is set to."""
        return value if self.entries is None else [value] * self.entries

    def _ends(self) -> tuple[float, float]:
        low, high = self.unknown.lower, self.unknown.upper
        return (math.log10(low), math.log10(high)) if self.logarithmic else (low, high)


@dataclass(frozen=True)
class Experiment:
    """What is run once for every measurement that shares its settings.

    Attributes:
        settings: What differs from the case, by key.
        figures: What its measurements ask for.
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
        """Return what the keys of the unknowns are set to."""
        return {one.unknown.key: one.setting(value) for one, value in zip(self.coordinates, values, strict=True)}

    @property
    def start(self) -> FloatArray:
        """Where the file says to start, on the scales, (n,)."""
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
