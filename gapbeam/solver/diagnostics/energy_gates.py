"""Gates on the energy ledger: a run that creates energy does not pass.

* Each impact (a face closing and opening again): the algorithmic loss or growth during it, relative to the
  kinetic and strain energy at its start, shall lie within the gates. Violations are counted and warned about.
* The whole run: created energy above `total_growth` of the energy exchanged ends the run; above `impact_growth`
  at the end, the run has failed; so it has where the scheme itself took more than `total_loss`, in impacts or away from
  them.

Source: the default limits are those that CalculiX documents for contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gapbeam.solver.case.case import Case, Gates
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.diagnostics.face_updates import CLOSED, OPEN, UNKNOWN, Watched, after_look, breaks_gates
from gapbeam.solver.diagnostics.ledger_update import relative_growth
from gapbeam.solver.errors import EnergyCreated, NotFinite
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

SAFE_WITHOUT_POTENTIAL = "implicit-midpoint"  # a scheme that only loses energy at impacts


def remedy_for(case: Case) -> str:
    """Return what helps a case whose scheme creates energy, in a sentence: never the scheme that it has."""
    ways = list[str]()
    scheme, formulation = case.time.scheme, case.contact.formulation
    if formulation.without_potential and scheme.type != SAFE_WITHOUT_POTENTIAL:
        ways.append(f"the scheme {SAFE_WITHOUT_POTENTIAL}")
    elif not formulation.without_potential and not scheme.conserves_energy:
        ways.append("the scheme discrete-gradient")
    ways.append("a smaller time.step")
    if formulation.follows_the_law:
        ways.append("a softer contact.stiffness")
    return f"Try {', '.join(ways[:-1])} or {ways[-1]}" if len(ways) > 1 else f"Try {ways[0]}"


@dataclass
class EnergyGates:
    """Watches a ledger from step to step.

    Attributes:
        limits: The gates of the case.
        contact: To distinguish the faces.
        impacts: Impacts that ended so far.
        largest_growth: Largest relative algorithmic growth in one impact.
        largest_loss: Largest relative algorithmic loss in one impact.
        violations: Impacts outside the gates.
        open_faces: Whether each face was open when last seen.
        entries: Energy created, and kinetic and strain energy, when faces closed whose impact has not ended, J.
        remedy: What helps where energy is created, in a sentence.
    """

    limits: Gates
    contact: ContactOperator
    impacts: int = 0
    largest_growth: float = 0.0
    largest_loss: float = 0.0
    violations: int = 0
    open_faces: dict[int, bool] = field(default_factory=dict)
    entries: dict[int, tuple[float, float]] = field(default_factory=dict)
    remedy: str = "Try a smaller time.step"

    def check(self, step: Step, ledger: Ledger) -> None:
        """Pass a step, or raise.

        Raises:
            NotFinite: The energy is not a number.
            EnergyCreated: More energy was created than `total_growth` allows, unless the case accepts it.
        """
        finite = bool(np.isfinite(ledger.total) and np.isfinite(step.new.pressure).all())
        if finite:
            self._watch_impacts(step.new.pressure, ledger)
        self.let_pass(step.new.time, finite, ledger)

    def let_pass(self, time: float, finite: bool, ledger: Ledger) -> None:
        """Pass a step that ended at a time, or raise as `check` does.

        Args:
            time: End of the step, s.
            finite: Whether energy and contact pressure are.
            ledger: The ledger after it.
        """
        if not finite:
            raise NotFinite(f"at t = {time:.6g} s energy or contact pressure is not finite. {self.remedy}")
        growth = self.growth(ledger)
        if growth > self.limits.total_growth and not self.limits.accept_energy_growth:
            raise EnergyCreated(
                f"at t = {time:.6g} s the scheme has created {ledger.created:.3g} J, {growth:.1%} of the "
                f"energy exchanged (allowed: {self.limits.total_growth:.1%}); the results are not to be trusted. "
                f"{self.remedy}; gates.accept_energy_growth = true goes on in spite of it"
            )

    def growth(self, ledger: Ledger) -> float:
        """Return created energy relative to the energy exchanged; 0 where round-off hides it."""
        return relative_growth(ledger.created, ledger.exchanged, ledger.round_off)

    def failed(self, ledger: Ledger) -> bool:
        """Return whether the whole run has created energy beyond the gate of an impact."""
        return self.growth(ledger) > self.limits.impact_growth

    def loss(self, ledger: Ledger) -> float:
        """Return what the scheme took in the whole run relative to the energy exchanged; 0 where round-off hides it."""
        return max(relative_growth(ledger.algorithmic, ledger.exchanged, ledger.round_off), 0.0)

    def watched(self, face: int) -> Watched:
        """Return a face as it was last seen."""
        seen = UNKNOWN if face not in self.open_faces else OPEN if self.open_faces[face] else CLOSED
        return Watched(seen, *self.entries.get(face, (np.nan, np.nan)))

    def keep(self, face: int, seen: Watched) -> None:
        """Keep a face as it is seen now."""
        if seen.face != UNKNOWN:
            self.open_faces[face] = seen.face == OPEN
        if not np.isnan(seen.created):
            self.entries[face] = (seen.created, seen.energy)
        else:
            self.entries.pop(face, None)

    def _watch_impacts(self, pressure: Array, ledger: Ledger) -> None:
        created, energy = ledger.created, ledger.kinetic + ledger.strain
        for face, closed in enumerate(self.contact.faces_with(pressure > 0.0)):
            seen, ended, growth = after_look(self.watched(face), bool(closed), created, energy, ledger.round_off)
            self.keep(face, seen)
            if ended:
                self.impacts += 1
                self.largest_growth = max(self.largest_growth, growth)
                self.largest_loss = max(self.largest_loss, -growth)
                self.violations += breaks_gates(growth, self.limits.impact_growth, self.limits.impact_loss)
