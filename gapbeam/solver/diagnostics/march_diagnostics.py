"""What is kept of every accepted step of a march: energy ledger, gates, contact episodes, peaks, counts."""

from __future__ import annotations

from dataclasses import dataclass

from gapbeam.solver.case.case import Gates
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.contact_episodes import Episodes
from gapbeam.solver.diagnostics.contact_peaks import Peaks
from gapbeam.solver.diagnostics.contact_times import ContactTimes
from gapbeam.solver.diagnostics.energy_gates import EnergyGates
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.diagnostics.impacts import Impacts
from gapbeam.solver.diagnostics.sliding_work import SlidingWork
from gapbeam.solver.diagnostics.step_counts import Tally
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem, State

UNGUARDED = Gates(accept_energy_growth=True)


@dataclass
class Accounts:
    """Everything that consumes each accepted step of a march.

    Attributes:
        system: The system.
        law: The contact law.
        ledger: The energy ledger.
        gates: Watches it.
        episodes: Contact episodes.
        peaks: Impulse and peaks of the faces.
        times: How long and how often they were in contact.
        impacts: Their impacts.
        tally: What the march cost.
        sliding: The work of sliding.
        time: End of the last accepted step, s.
    """

    system: SemiDiscreteSystem
    law: ContactLaw
    ledger: Ledger
    gates: EnergyGates
    episodes: Episodes
    peaks: Peaks
    times: ContactTimes
    impacts: Impacts
    tally: Tally
    sliding: SlidingWork
    time: float

    @classmethod
    def opened(
        cls,
        system: SemiDiscreteSystem,
        law: ContactLaw,
        start: State,
        dt: float,
        limits: Gates = UNGUARDED,
        remedy: str = "Try a smaller time.step",
    ) -> Accounts:
        """Return the accounts at the start of a march in steps of dt, s; by default no growth ends it. Collective."""
        contact, ledger = system.contact, open_ledger(system, law, start)
        watch = (
            EnergyGates(limits, contact, remedy=remedy),
            Episodes(contact),
            Peaks(contact),
            ContactTimes.opened(contact, law, start),
            Impacts.opened(system, law, start),
            Tally(dt),
            SlidingWork.opened(contact, start),
        )
        return cls(system, law, ledger, *watch, start.time)

    def take(self, step: Step, seconds: float = 0.0) -> None:
        """Enter an accepted step that took some seconds.

        Raises:
            NotFinite: The energy is not a number.
            EnergyCreated: More energy was created than the gates allow, unless the case accepts it.

        Collective.
        """
        self.time = step.new.time
        self.ledger = enter_step(self.system, self.law, self.ledger, step)
        if step.refreshed is not None:
            self.ledger = restate(self.system, self.law, self.ledger, step.refreshed)
        depth, closed = self.peaks.see(step, self.system.operators), self.times.closed
        self.episodes.watch(step)
        self.tally.see(step, seconds)
        self.times.see(step)
        self.impacts.see(step, closed, self.times, depth, self.peaks.impulse)
        self.sliding.see(step, self.system.operators)
        self.gates.check(step, self.ledger)
