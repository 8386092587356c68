"""Gates on the energy ledger: a run that creates energy does not pass.

* Each impact (a face closing and opening again): the algorithmic loss or growth during it, relative to the
  kinetic and strain energy at its start, shall lie within the gates. Violations are counted and warned about.
* The whole run: created energy above `total_growth` of the energy exchanged ends the run; above `impact_growth`
  at the end, the run has failed.

Source: the default limits are those that CalculiX documents for contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solver.case import Gates
from solver.energy import Ledger
from solver.errors import EnergyCreated, NotFinite
from solver.operators import Array
from solver.system import ContactOperator, Step


@dataclass
class EnergyGates:
    """Watches a ledger from step to step.

    Attributes:
        limits: The gates of the case.
        contact: To tell the faces apart.
        impacts: Impacts that ended so far.
        largest_growth: Largest relative algorithmic growth in one impact.
        largest_loss: Largest relative algorithmic loss in one impact.
        violations: Impacts outside the gates.
        open_faces: Whether each face was open when last seen.
        entries: Energy created, and kinetic and strain energy, when faces closed whose impact has not ended, J.
    """

    limits: Gates
    contact: ContactOperator
    impacts: int = 0
    largest_growth: float = 0.0
    largest_loss: float = 0.0
    violations: int = 0
    open_faces: dict[int, bool] = field(default_factory=dict)
    entries: dict[int, tuple[float, float]] = field(default_factory=dict)

    def check(self, step: Step, ledger: Ledger) -> None:
        """Pass a step, or raise.

        Raises:
            NotFinite: The energy is not a number.
            EnergyCreated: More energy was created than `total_growth` allows, unless the case accepts it.
        """
        finite = bool(np.isfinite(ledger.total) and np.all(np.isfinite(step.new.pressure)))
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
            raise NotFinite(
                f"at t = {time:.6g} s energy or contact pressure is not finite; "
                "try a smaller time.step or the scheme discrete-gradient"
            )
        growth = self.growth(ledger)
        if growth > self.limits.total_growth and not self.limits.accept_energy_growth:
            raise EnergyCreated(
                f"at t = {time:.6g} s the scheme has created {ledger.created:.3g} J, {growth:.1%} of the "
                f"energy exchanged (allowed: {self.limits.total_growth:.1%}); the results are not to be trusted. "
                "Use the scheme discrete-gradient, a smaller time.step or a softer contact.stiffness; "
                "gates.accept_energy_growth = true goes on in spite of it"
            )

    def growth(self, ledger: Ledger) -> float:
        """Return created energy relative to the energy exchanged; 0 where round-off hides it."""
        return _relative(ledger.created, ledger.exchanged, ledger)

    def failed(self, ledger: Ledger) -> bool:
        """Return whether the whole run has created energy beyond the gate of an impact."""
        return self.growth(ledger) > self.limits.impact_growth

    def _watch_impacts(self, pressure: Array, ledger: Ledger) -> None:
        for face in range(len(self.contact.face_names)):
            is_open = not bool(np.any(pressure[self.contact.faces == face] > 0.0))
            was_open = self.open_faces.get(face, is_open)
            if was_open and not is_open:
                self.entries[face] = (ledger.created, ledger.kinetic + ledger.strain)
            elif is_open and not was_open and face in self.entries:
                self._judge(*self.entries.pop(face), ledger)
            self.open_faces[face] = is_open

    def _judge(self, created_before: float, energy: float, ledger: Ledger) -> None:
        self.impacts += 1
        change = _relative(ledger.created - created_before, energy, ledger)
        self.largest_growth = max(self.largest_growth, change)
        self.largest_loss = max(self.largest_loss, -change)
        if change > self.limits.impact_growth or -change > self.limits.impact_loss:
            self.violations += 1


def _relative(created: float, energy: float, ledger: Ledger) -> float:
    if abs(created) <= ledger.round_off:
        return 0.0
    return created / energy if energy > 0.0 else float(np.copysign(np.inf, created))
