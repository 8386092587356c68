"""What all recorded loads have in common: a function of time from a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Self

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.record_checks import file_faults, run_faults
from gapbeam.solver.loads.record_curve import curve_of
from gapbeam.solver.loads.record_warnings import curve_warnings, end_warnings, row_warnings, step_warnings
from gapbeam.solver.loads.record_words import record_words
from gapbeam.solver.loads.recorded_function import MOST_POWER, signal_of
from gapbeam.solver.loads.recorded_table import RecordedTable
from gapbeam.solver.loads.time_function import TimeFunction


class RecordedLoad(RecordedTable):
    """A recorded load, with what its record answers."""

    def time_function(self) -> TimeFunction:
        """Return the curve through the rows of the record, scaled, or its derivative that is an acceleration.

        Raises:
            RecordError: The file cannot be used.
        """
        signal = signal_of(self)
        return TimeFunction(signal.value, signal.mean)

    @property
    def peak(self) -> float:
        """Largest size in the record, N or m/s^2."""
        return signal_of(self).peak

    @property
    def forcing_frequency(self) -> None:
        """None: no period is sought in a record."""

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """The frequency below which 99 % of the power of the record lie, Hz."""
        origin = f"below which {MOST_POWER:.0%} of the power of the load {self.name} lie"
        return signal_of(self).content.below(MOST_POWER), origin

    @property
    def rise_time(self) -> float:
        """Duration of the ramp, s."""
        return self.ramp

    def at_full_amplitude(self) -> Self:
        """Return the load without its ramp."""
        return self.model_copy(update={"ramp": 0.0})

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the frequency of interest, and what the record holds."""
        return record_words(signal_of(self), step)

    def with_checksum(self) -> Self:
        """Return the load with the checksum of its file.

        Raises:
            RecordError: The file cannot be used, or is another one than its checksum says.
        """
        return self.model_copy(update={"checksum": curve_of(self).checksum})

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield what is wrong with the file."""
        yield from file_faults(self, key)

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:
        """Yield a record that does not cover the run, or is scaled beyond all reason."""
        yield from run_faults(self, key, end, step)

    def unusual_values(self) -> Iterator[str]:
        """Yield what is odd in the record."""
        signal = signal_of(self)
        yield from curve_warnings(self, signal)
        yield from row_warnings(signal)

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a record that is far longer than the run, or that jumps where it starts or ends."""
        yield from end_warnings(self, signal_of(self), end)

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a step that is too long for the record."""
        yield from step_warnings(signal_of(self), step)
