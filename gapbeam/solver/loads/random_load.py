"""Random loads, forces at points or accelerations of the support: Gaussian noise of given spectra and cross-spectra.

A load may have a cross-spectrum with another one of its type: it is then made of the noise of both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import radians
from typing import Annotated, Any, ClassVar, Literal, Self, TypeGuard

from pydantic import Field

from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.random_function import (
    MOST_LENGTH,
    RandomSignal,
    SharedNoise,
    compared,
    compared_cross_spectrum,
    filter_length,
    noise_key,
    sample_rate,
)
from gapbeam.solver.loads.random_spectra import SpectrumChoice
from gapbeam.solver.loads.recorded_function import MOST_POWER
from gapbeam.solver.loads.step_force import PointOrSupportLoad, UnrepeatedLoad
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, counted, exceeds
from gapbeam.solver.schema.table import Name, NonNegative, Number, Table, Whole

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
            yield Fault(
                key, f"{counted(len(given), 'value')} without frequencies", "a frequency for each value", try_this
            )
        elif count != len(given):
            found = f"{len(given)} for {counted(count, 'frequency')}"
            yield Fault(key, found, "one value for each frequency", "one number holds at all", related=(frequencies,))

    def detail_faults(self, key: Key, interval: float, rate: float) -> Iterator[Fault]:
        """Yield a delay that its samples cannot count, and rows closer, and phases faster, than its filter can show.

        Args:
            key: The way to its table in the case.
            interval: Interval between frequencies of the filter, Hz.
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


PEAK = 3.0  # times the rms; Gaussian noise is beyond for 0.3 % of the time
FEW, ENOUGH = 20, 50  # steps in a period
RECORDS = 10.0  # in a period that records show
FEWEST_PERIODS = 20.0  # of the lowest frequency in a run

Seed = Annotated[Whole, Field(ge=0, lt=2**63)]


class NoiseLoad(UnrepeatedLoad):
    """Gaussian noise of a given spectrum."""

    noise: ClassVar[bool] = True

    name: Name = Field(
        default="noise",
        description="unique name",
    )
    seed: Seed = Field(default=0, description="chooses one of many signals of the spectrum")
    spectrum: SpectrumChoice

    @property
    def signal(self) -> RandomSignal:
        """The noise as a function of time."""
        return RandomSignal(self.spectrum.spectrum(), self.seed, self.name, self.ramp)

    def with_other_noise(self, number: int) -> Self:
        """Return the load with a seed that is so many times 1000 higher: seeds that users count up are not met."""
        return self.model_copy(update={"seed": self.seed + 1000 * number})

    def time_function(self) -> TimeFunction:
        """Return the noise."""
        signal = self.signal
        return TimeFunction(signal.value, signal.mean, signal=signal)

    @property
    def frequency_of_interest(self) -> tuple[float, str]:
        """The frequency below which 99 % of the power lie, Hz."""
        origin = f"below which {MOST_POWER:.0%} of the power of the load {self.name} lie"
        return self.signal.spectrum.below(MOST_POWER), origin

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the frequency below which 99 % of the power lie, the rms, and the steps in a period."""
        frequency, asked = self.signal.spectrum.below(MOST_POWER), self.signal.spectrum
        words = f"below which {MOST_POWER:.0%} of its power lie, {1.0 / (frequency * step):.4g} steps per period"
        words += f"; {asked.low:.4g} to {asked.high:.4g} Hz, rms {asked.rms:.4g} {self.unit}, seed {self.seed}"
        return f"{frequency:.4g} Hz", words

    def with_checksum(self) -> Self:
        """Return the load with the checksum of the file of its spectrum.

        Raises:
            RecordError: The file cannot be used, or is another one than its checksum says.
        """
        return self.model_copy(update={"spectrum": self.spectrum.with_checksum()})

    def generated(self, end: float, loads: Sequence[LoadTable] = ()) -> Mapping[str, Any]:  # noqa: ARG002
        """Return the generated and the requested spectrum of the signal up to a time, s."""
        return {
            "name": self.name,
            "unit": self.unit,
            "seed": self.seed,
            **compared(self.at_full_amplitude().signal, end),
        }

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield the faults of the spectrum, and of a band that is too wide to make noise in."""
        yield from super().faults(key)
        place = (*key, "spectrum")
        found = list(self.spectrum.faults(place))
        yield from found
        if found:
            return
        asked = self.spectrum.spectrum()
        if (length := filter_length(asked)) > MOST_LENGTH:
            yield Fault(
                place,
                f"from {asked.low:g} to {asked.high:g} Hz, with details that take {length} samples to show",
                f"at most {MOST_LENGTH} samples",
                "a higher lowest frequency, a lower highest one, or rows that are farther apart",
            )

    def faults_in_run(self, key: Key, end: float, step: float | None) -> Iterator[Fault]:
        """Yield a step that is too long for the frequencies of the noise."""
        yield from super().faults_in_run(key, end, step)
        if step is None or any(self.spectrum.faults(key)):
            return
        frequency = self.signal.spectrum.below(MOST_POWER)
        if step >= 0.5 / frequency:
            yield Fault(
                ("time", "step"),
                f"{step:g} s, with noise of which {MOST_POWER:.0%} lie below {frequency:.4g} Hz",
                f"far less than half the period of {1.0 / frequency:.3g} s; {ENOUGH} steps in it are good",
                f"step = {1.0 / (ENOUGH * frequency):.3g}, or a lower highest frequency",
                ((*key, "spectrum"),),
            )

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a run that is too short for the lowest frequency."""
        yield from super().unusual_in_run(end)
        low = self.signal.spectrum.low
        if low * end < FEWEST_PERIODS and low > 0.0:
            yield (
                f"has {low * end:.3g} periods of its lowest frequency, {low:.4g} Hz, in the run: what happens there is "
                f"left to chance; {FEWEST_PERIODS:g} periods are the least"
            )

    def unusual_steps(self, step: float) -> Iterator[str]:
        """Yield a step that is too long for the highest frequencies."""
        frequency = self.signal.spectrum.below(MOST_POWER)
        if frequency * step > 1.0 / FEW:
            yield (
                f"{1.0 / (frequency * step):.3g} steps in a period of {frequency:.4g} Hz, and {ENOUGH} are good; below "
                f"lie {MOST_POWER:.0%} of the power of the load {self.name}"
            )

    def unusual_records(self, interval: float) -> Iterator[str]:
        """Yield records that are too far apart to show the motion at the highest frequencies."""
        frequency = self.signal.spectrum.below(MOST_POWER)
        if frequency * interval > 1.0 / RECORDS:
            yield (
                f"keeps {1.0 / (frequency * interval):.3g} records in a period of {frequency:.4g} Hz, below which lie "
                f"{MOST_POWER:.0%} of the power of the load {self.name}"
            )


class PairedNoiseLoad(NoiseLoad):
    """Gaussian noise that may have a cross-spectrum with another load of the same type."""

    cross_spectrum: CrossSpectrum | None = Field(
        default=None, description="correlation with another load of the same type; default none"
    )

    @property
    def signal(self) -> RandomSignal:
        """The noise as a function of time, with the part that it shares with another load."""
        return self._with_shared(super().signal)

    def _with_shared(self, signal: RandomSignal, part: str = "") -> RandomSignal:
        """Return a signal with its share of the other load's signal.

        Args:
            signal: Signal of the load alone.
            part: Suffix to the names of both loads in the names of their signals.
        """
        cross = self.cross_spectrum
        return signal if cross is None else replace(signal, shared=cross.shared(self.seed, part))

    def generated(self, end: float, loads: Sequence[LoadTable] = ()) -> Mapping[str, Any]:
        """Return the generated and the requested spectrum and cross-spectrum up to a time, s."""
        found, cross = super().generated(end, loads), self.cross_spectrum
        if cross is None:
            return found
        (other,) = (load for load in loads if self._is_paired(load) and vars(load)["name"] == cross.load)
        signals = self.at_full_amplitude().signal, other.at_full_amplitude().signal
        bands = compared_cross_spectrum(*signals, cross.shared(self.seed), end)
        return {**found, "cross_spectrum": {"load": cross.load, "delay": cross.delay, "bands": bands}}

    def frequency_words(self, step: float) -> tuple[str, str]:
        """Return the frequency below which 99 % of the power lie, the rms, the steps in a period, and the coherence."""
        frequency, words = super().frequency_words(step)
        return frequency, words if self.cross_spectrum is None else f"{words}, {self.cross_spectrum.words()}"

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield the faults of the cross-spectrum, and all others."""
        found = list(super().faults(key))
        yield from found
        cross, place = self.cross_spectrum, (*key, "cross_spectrum")
        if cross is None:
            return
        wrong = list(cross.faults(place))
        yield from wrong
        if not found and not wrong:
            spectrum = self.spectrum.spectrum()
            rate = sample_rate(spectrum)
            yield from cross.detail_faults(place, rate / filter_length(spectrum), rate)

    def unusual_in_run(self, end: float) -> Iterator[str]:
        """Yield a delay that is longer than the run, such as one in ms."""
        yield from super().unusual_in_run(end)
        cross = self.cross_spectrum
        if cross is not None and exceeds(abs(cross.delay), end):
            delay, run = apart(cross.delay, end)
            yield (
                f"has a delay of {delay} s to {cross.load}, longer than the run of {run} s, in which they "
                "have nothing in common then: is it in s?"
            )

    def faults_among(self, key: Key, loads: Mapping[int, LoadTable]) -> Iterator[Fault]:
        """Yield another load of the cross-spectrum that is not there, or whose noise cannot be shared."""
        cross = self.cross_spectrum
        if cross is None:
            return
        place = (*key, "cross_spectrum", "load")
        by_name = {str(vars(load)["name"]): (number, load) for number, load in loads.items()}
        paired = [load for load in loads.values() if load is not self and self._is_paired(load)]
        fit = [load.name for load in paired if load.cross_spectrum is None]
        kind = str(vars(self)["type"])
        try_this = f'load = "{fit[0]}"' if fit else f'add another [[load]] of type = "{kind}", and name it here'
        if cross.load == self.name:
            yield Fault(place, f'"{cross.load}", the load itself', f"the name of another load of type {kind}", try_this)
        elif cross.load not in by_name:
            found = f'"{cross.load}", which no load is called'
            yield Fault(place, found, "the name of another load", try_this, lacks=("load",))
        else:
            number, other = by_name[cross.load]
            named = ("load", number, "name")
            if not isinstance(other, PairedNoiseLoad) or vars(other)["type"] != kind:
                found, expected = f'"{cross.load}", a load of type "{vars(other)["type"]}"', f"a load of type {kind}"
                yield Fault(place, found, expected, try_this, (named,))
            elif other.cross_spectrum is not None:
                yield self._chain_fault(place, other, other.cross_spectrum, number)
            else:
                yield from self._noise_faults(key, other, number)

    def _chain_fault(self, place: Key, other: PairedNoiseLoad, beyond: CrossSpectrum, number: int) -> Fault:
        """Return the fault of another load that has a cross-spectrum itself, with this load or a third one."""
        if beyond.load == self.name:
            try_this = f"leave the cross_spectrum of {self.name} or of {other.name} out: one of them says it for both"
        else:
            try_this = f'load = "{beyond.load}"; the coherence of the other two is then the product of theirs with it'
        return Fault(
            place,
            f'"{other.name}", which has a cross_spectrum with "{beyond.load}" itself',
            "a load without a cross_spectrum",
            try_this,
            (("load", number, "cross_spectrum"),),
        )

    def _noise_faults(self, key: Key, other: PairedNoiseLoad, number: int) -> Iterator[Fault]:
        """Yield another seed, and spectra that are made of other samples."""
        if self.seed != other.seed:
            yield Fault(
                (*key, "seed"),
                f"{self.seed}, with seed = {other.seed} of {other.name}",
                "the same seed: both loads are made of the same noise",
                f"seed = {other.seed}",
                (("load", number, "seed"),),
            )
        if any(self.spectrum.faults(key)) or any(other.spectrum.faults(key)):
            return
        own, theirs = self.spectrum.spectrum(), other.spectrum.spectrum()
        expected, related = "the same in both: both loads are made of the same samples", (("load", number, "spectrum"),)
        if sample_rate(own) != sample_rate(theirs):
            high, other_high = apart(own.high, theirs.high)
            found = f"up to {high} Hz, with {other.name} up to {other_high} Hz"
            larger = high if own.high > theirs.high else other_high
            try_this = f"both up to {larger} Hz; a table may be as low as you like where nothing acts"
            yield Fault((*key, "spectrum"), found, f"a highest frequency that is {expected}", try_this, related)
        elif filter_length(own) != filter_length(theirs):
            found = (
                f"details that take {filter_length(own)} samples to show, with {filter_length(theirs)} of {other.name}"
            )
            try_this = "the same lowest frequency, and rows that are as far apart"
            yield Fault((*key, "spectrum"), found, f"details that are {expected}", try_this, related)

    def _is_paired(self, load: LoadTable) -> TypeGuard[PairedNoiseLoad]:
        """Return whether a load is of this type."""
        return isinstance(load, PairedNoiseLoad) and vars(load)["type"] == vars(self)["type"]


class RandomLoad(PairedNoiseLoad, PointOrSupportLoad):
    """Gaussian noise of a given spectrum as a force at a point or an acceleration of the support."""

    type: Literal["random"] = Field(description="kind of load")
    spectrum: SpectrumChoice = Field(
        description="spectral density of the load over frequency",
        examples=[{"type": "white", "density": 0.01, "high": 500.0}],
    )

    @property
    def peak(self) -> float:
        """Three times the rms, N or m/s^2."""
        return PEAK * self.signal.spectrum.rms
