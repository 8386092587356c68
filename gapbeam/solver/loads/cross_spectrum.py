"""The cross-spectrum of a random load with another one: coherence, phase and delay, at all or over frequencies."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import radians
from typing import Annotated

from pydantic import Field

from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.loads.random_function import SharedNoise, noise_key
from gapbeam.solver.table import Name, NonNegative, Number, Table
from gapbeam.solver.wording.short_words import apart, exceeds

MOST = 1000  # rows
LONGEST_DELAY = 2**40  # samples of the noise: whose number, and 1e-4 of a sample more, a float still holds
FASTEST_PHASE = (
    360.0 / 64.0
)  # degrees in an interval of the filter's grid; its smoothing takes 2 % of the coherence then

Rows = Annotated[tuple[Number, ...], Field(min_length=2, max_length=MOST)]
Frequencies = Annotated[tuple[NonNegative, ...], Field(min_length=2, max_length=MOST)]


class CrossSpectrum(Table):
    """Correlation of a random load with another one of the same type, seed and highest frequency."""

    load: Name = Field(
        description="name of the other load of the same type, which has no cross_spectrum", examples=["drag"]
    )
    coherence: Number | Rows = Field(
        description="abs(S12) / sqrt(S11 S22), 0 to 1: one number, or one for each of `frequencies`, no unit",
        examples=[0.6],
    )
    phase: Number | Rows = Field(
        default=0.0,
        description="angle by which the load is ahead: one number, or one for each of `frequencies`, degrees",
        examples=[90.0],
    )
    delay: Number = Field(
        default=0.0, description="time by which the load follows the other one, in addition to `phase`, s"
    )
    frequencies: Frequencies | None = Field(
        default=None,
        description="ascending frequencies of the rows of `coherence` and `phase`, straight lines in between, constant "
        "beyond, Hz; default one value of each at all frequencies",
        examples=[[10.0, 100.0]],
    )

    def shared(self, seed: int, part: str = "") -> SharedNoise:
        """Return the noise that is shared, of a seed; `part`: of a load of several signals, behind its name."""
        frequencies = self.frequencies or (0.0,)
        phases = tuple(radians(phase) for phase in self._rows(self.phase))
        return SharedNoise(
            noise_key(seed, self.load + part), frequencies, self._rows(self.coherence), phases, self.delay
        )

    def words(self) -> str:
        """Return coherence and partner in words."""
        given = self._rows(self.coherence)
        values = f"{given[0]:g}" if len(set(given)) == 1 else f"{min(given):g} to {max(given):g}"
        return f"coherence {values} with {self.load}"

    def _rows(self, given: float | tuple[float, ...]) -> tuple[float, ...]:
        return given if isinstance(given, tuple) else (given,) * len(self.frequencies or (0.0,))

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield rows that do not pair or ascend, and coherences beyond 0 and 1.

        Args:
            key: The way to its table in the case.
        """
        for name, given in (("coherence", self.coherence), ("phase", self.phase)):
            yield from self._row_faults((*key, name), given, (*key, "frequencies"))
        for one, following in pairwise(self.frequencies or ()):
            if one >= following:
                found = "{} Hz after {} Hz".format(*apart(following, one))
                yield Fault((*key, "frequencies"), found, "frequencies that ascend", "sort the rows")
                break
        given = self._rows(self.coherence)
        if wrong := [value for value in given if not 0.0 <= value <= 1.0]:
            yield Fault(
                (*key, "coherence"),
                f"{wrong[0]:g}",
                "a coherence from 0 (nothing in common) to 1 (all)",
                _instead_of(wrong[0]),
            )

    def _row_faults(self, key: Key, given: float | tuple[float, ...], frequencies: Key) -> Iterator[Fault]:
        """Yield several values without frequencies, or for another number of them."""
        if not isinstance(given, tuple):
            return
        count = len(self.frequencies or ())
        if count == 0:
            try_this = "frequencies = [...], or one number for all frequencies"
            yield Fault(key, f"{len(given)} values without frequencies", "a frequency for each value", try_this)
        elif count != len(given):
            found = f"{len(given)} for {count} frequencies"
            yield Fault(key, found, "one value for each frequency", "one number holds at all", related=(frequencies,))

    def detail_faults(self, key: Key, interval: float, rate: float) -> Iterator[Fault]:
        """Yield a delay that its samples cannot count, and rows closer, and phases faster, than its filter can show.

        Args:
            key: The way to its table in the case.
            interval: Between frequencies of the filter, Hz.
            rate: Samples of the noise in a second.
        """
        if abs(self.delay) * rate > LONGEST_DELAY:
            delay, longest = apart(abs(self.delay), LONGEST_DELAY / rate)
            sign = "-" if self.delay < 0.0 else ""
            expected = f"at most {longest} s, 2^40 samples of noise at {rate:g} Hz"
            yield Fault((*key, "delay"), f"{sign}{delay} s", expected, "is it in another unit?")
            return
        fastest = FASTEST_PHASE / interval
        phases = self._rows(self.phase)
        for (one, following), (low, high) in zip(pairwise(self.frequencies or ()), pairwise(phases), strict=True):
            if exceeds(interval, following - one, following):
                found, least = apart(following - one, interval)
                yield Fault(
                    (*key, "frequencies"),
                    f"{one:g} and {following:g} Hz, {found} Hz apart",
                    f"rows at least {least} Hz apart: noise of this spectrum shows no more detail",
                    "fewer rows, or a spectrum of the load with a lower lowest frequency",
                )
                return
            if abs(high - low) > fastest * (following - one):
                yield Fault(
                    (*key, "phase"),
                    f"{low:g} degrees at {one:g} Hz, and {high:g} degrees at {following:g} Hz",
                    f"a phase that changes by at most {fastest:.3g} degrees per Hz",
                    f"delay = {(low - high) / (360.0 * (following - one)):.3g}, with the phase that remains; or "
                    "rows that are farther apart",
                    ((*key, "frequencies"),),
                )
                return


def _instead_of(value: float) -> str:
    """Return the probable meaning of a coherence beyond its limits."""
    if value < 0.0:
        return f"coherence = {-value:g} with phase = 180" if value >= -1.0 else "phase = 180 for opposite signals"
    return f"coherence = {value / 100.0:g}, if it is in %" if 2.0 < value <= 100.0 else "coherence = 1"
