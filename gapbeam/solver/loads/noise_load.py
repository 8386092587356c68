"""What random loads have in common, wherever they act: Gaussian noise of a given spectrum."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.generated_spectrum import compared
from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.random_function import MOST_LENGTH, RandomSignal, filter_length
from gapbeam.solver.loads.spectra.spectrum_choice import SpectrumChoice
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.loads.unrepeated_load import UnrepeatedLoad
from gapbeam.solver.table import Name, Whole

PEAK = 3.0  # times the rms; Gaussian noise is beyond for 0.3 % of the time
MOST_POWER = 0.99  # of which the frequencies are of interest
FEW, ENOUGH = 20, 50  # steps in a period
RECORDS = 10.0  # in a period that records show
FEWEST_PERIODS = 20.0  # of the lowest frequency in a run

Seed = Annotated[Whole, Field(ge=0, lt=2**63)]


class NoiseLoad(UnrepeatedLoad):
    """Gaussian noise of a given spectrum."""

    noise: ClassVar[bool] = True

    name: Name = Field(
        default="noise",
        description="name in results and messages, different for every load; loads of different names are independent",
    )
    seed: Seed = Field(default=0, description="whole number that chooses one of many signals of the spectrum")
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
        """Return the spectrum of the signal up to a time, s, beside the one asked for."""
        return {
            "name": self.name,
            "unit": self.unit,
            "seed": self.seed,
            **compared(self.at_full_amplitude().signal, end),
        }

    def faults(self, key: Key) -> Iterator[Fault]:
        """Yield what is wrong with the spectrum, and a band that is too wide to make noise in."""
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
