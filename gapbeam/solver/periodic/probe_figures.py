"""What the probes do over a period of the response: means, peaks and harmonics in the bending direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.solver.models.model import Model
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State

HARMONICS_REPORTED = 5


@dataclass
class ProbeFigures:
    """Listens to the steps of a period.

    Attributes:
        model: Whose probes they are.
        places: Displacement of every probe in the bending direction at the end of every step, m.
    """

    model: Model
    places: list[list[float]] = field(default_factory=list)

    def listening(self, steps: Iterator[Step]) -> Iterator[Step]:
        """Yield the steps. Collective."""
        for step in steps:
            if step.completes:
                self._read(step.new)
            yield step

    def figures(self, periods: int) -> dict[str, Any]:
        """Return mean, peak to peak and harmonics 1-5 of the forcing of every probe, m.

        Args:
            periods: Forcing periods that were listened to.
        """
        if not self.places or not self.model.probes:
            return {}
        return {
            name: {"mean": float(np.mean(place)), "peak_to_peak": float(np.ptp(place))}
            | {"harmonics": harmonic_amplitudes(place, periods), "unit": "m"}
            for name, place in zip(self.model.probes, np.array(self.places).T, strict=True)
        }

    def _read(self, state: State) -> None:
        operators = self.model.system.operators
        self.places.append([float(row.evaluate(state.u[VALUE], operators)[-1]) for row in self.model.probes.values()])


def harmonic_amplitudes(values: Array, periods: int) -> list[float]:
    """Return the amplitudes of harmonics 1-5 of the forcing in equal samples of some of its periods."""
    spectrum = 2.0 * np.abs(np.fft.rfft(values)) / len(values)
    orders = range(periods, (HARMONICS_REPORTED + 1) * periods, periods)
    return [float(spectrum[k]) for k in orders if k < len(spectrum)]
