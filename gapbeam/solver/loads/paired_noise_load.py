"""A random load that may have a cross-spectrum with another one of its type: it is made of noise of both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeGuard

from pydantic import Field

from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.cross_spectrum import CrossSpectrum
from gapbeam.solver.loads.generated_cross_spectrum import compared_cross_spectrum
from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.noise_load import NoiseLoad
from gapbeam.solver.loads.random_function import RandomSignal, filter_length, sample_rate
from gapbeam.solver.wording.compared_numbers import apart, exceeds


class PairedNoiseLoad(NoiseLoad):
    """Gaussian noise that may have a cross-spectrum with another load of the same type."""

    cross_spectrum: CrossSpectrum | None = Field(
        default=None, description="what it has in common with another load of the same type; default nothing"
    )

    @property
    def signal(self) -> RandomSignal:
        """The noise as a function of time, with what it shares with another load."""
        return self._with_shared(super().signal)

    def _with_shared(self, signal: RandomSignal, part: str = "") -> RandomSignal:
        """Return a signal with what it shares with that of the other load.

        Args:
            signal: Of its own.
            part: What is behind the names of both loads in the names of their signals.
        """
        cross = self.cross_spectrum
        return signal if cross is None else replace(signal, shared=cross.shared(self.seed, part))

    def generated(self, end: float, loads: Sequence[LoadTable] = ()) -> Mapping[str, Any]:
        """Return the spectrum up to a time, s, and what the load has in common with another one, beside those asked."""
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
        """Yield what is wrong with the cross-spectrum, and with all else."""
        found = list(super().faults(key))
        yield from found
        cross, place = self.cross_spectrum, (*key, "cross_spectrum")
        if cross is None:
            return
        wrong = list(cross.faults(place))
        yield from wrong
        if not found and not wrong:
            spectrum = self.spectrum.spectrum()
            yield from cross.detail_faults(place, sample_rate(spectrum) / filter_length(spectrum))

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
        fit = [name for name, (_, load) in by_name.items() if load is not self and self._may_share(load)]
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

    def _may_share(self, load: LoadTable) -> bool:
        """Return whether a load is of this type and shares no noise of others."""
        return self._is_paired(load) and load.cross_spectrum is None

    def _is_paired(self, load: LoadTable) -> TypeGuard[PairedNoiseLoad]:
        """Return whether a load is of this type."""
        return isinstance(load, PairedNoiseLoad) and vars(load)["type"] == vars(self)["type"]
