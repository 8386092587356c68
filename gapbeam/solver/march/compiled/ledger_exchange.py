"""Copies between the ledger arrays of kernels and the accounts of a march."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.diagnostics.contact_episodes import Watched
from gapbeam.solver.diagnostics.energy_ledger import Energies
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Records
from gapbeam.solver.march.compiled.ledger_kernel import LedgerArrays, Limits
from gapbeam.solver.system.operators import Array


def ledger_arrays_of(accounts: Accounts) -> LedgerArrays:
    """Return ledger arrays that continue from accounts."""
    ledger, gates, episodes, peaks, tally = (
        accounts.ledger,
        accounts.gates,
        accounts.episodes,
        accounts.peaks,
        accounts.tally,
    )
    faces, times, impacts = range(len(peaks.impulse)), accounts.times, accounts.impacts
    watched = [gates.watched(face) for face in faces]
    running = [episodes.running.get(face, (0, 0.0)) for face in faces]
    return LedgerArrays(
        energies=np.array(ledger.energies),
        load_work=ledger.load_work.copy(),
        over_time=np.array(
            [
                peaks.impulse,
                times.time,
                times.closings,
                impacts.approach,
                peaks.square,
                times.closed,
                impacts.depth,
                impacts.begun,
                impacts.speed,
                impacts.duration,
            ]
        ),
        deepest=peaks.deepest.copy(),
        peak_force=peaks.force.copy(),
        face=np.array([one.face for one in watched]),
        entry=np.array([(one.created, one.energy) for one in watched]).T.copy(),
        impacts=np.array([gates.impacts, gates.violations]),
        impact_change=np.array([gates.largest_growth, gates.largest_loss]),
        episode_steps=np.array([steps for steps, _ in running]),
        episode_impulse=np.array([impulse for _, impulse in running]),
        episodes=np.array([episodes.count, episodes.short]),
        episodes_impulse=np.array([episodes.impulse, episodes.short_impulse]),
        solves=np.array([peaks.iterations, tally.iterations, tally.most_iterations]),
    )


def enter_arrays(
    ledgers: LedgerArrays, accounts: Accounts, steps: int, seconds: float, records: Records, origin: float
) -> None:
    """Bring accounts to what the ledger arrays hold after some more whole steps that took some seconds.

    Args:
        ledgers: After the steps.
        accounts: Changed in place.
        steps: Whole steps.
        seconds: Their wall time, s.
        records: Of the steps, with the impacts that ended in them.
        origin: Start of the march, s.
    """
    _enter_impacts(records, accounts, origin)
    gates, episodes, peaks, tally = accounts.gates, accounts.episodes, accounts.peaks, accounts.tally
    accounts.ledger = accounts.ledger.with_energies(Energies(*map(float, ledgers.energies)), ledgers.load_work.copy())
    faces = range(len(peaks.impulse))
    for face in faces:
        gates.keep(
            face,
            Watched(int(ledgers.face[face]), float(ledgers.entry[0, face]), float(ledgers.entry[1, face])),
        )
    gates.impacts, gates.violations = (int(count) for count in ledgers.impacts)
    gates.largest_growth, gates.largest_loss = (float(change) for change in ledgers.impact_change)
    episodes.running = {
        face: (int(ledgers.episode_steps[face]), float(ledgers.episode_impulse[face]))
        for face in faces
        if ledgers.episode_steps[face] > 0
    }
    episodes.count, episodes.short = (int(count) for count in ledgers.episodes)
    episodes.impulse, episodes.short_impulse = (float(impulse) for impulse in ledgers.episodes_impulse)
    times, impacts = accounts.times, accounts.impacts
    (
        peaks.impulse, times.time, times.closings, impacts.approach, peaks.square, times.closed,
        impacts.depth, impacts.begun, impacts.speed, impacts.duration,
    ) = (sums.copy() for sums in ledgers.over_time)  # fmt: skip
    peaks.deepest, peaks.force = ledgers.deepest.copy(), ledgers.peak_force.copy()
    peaks.iterations, tally.iterations, tally.most_iterations = (int(count) for count in ledgers.solves)
    tally.steps += steps
    tally.shortest = min(tally.shortest, tally.dt) if steps else tally.shortest
    tally.advance += seconds


def _enter_impacts(records: Records, accounts: Accounts, origin: float) -> None:
    """Enter the impacts that ended in a block, whose closing times count from the start of the march at `origin`, s."""
    listed = records.impacts[: records.listed[0]]
    for face, kept in enumerate(accounts.impacts.ended):
        rows = listed[listed[:, 0] == face, 1:]
        rows[:, 0] += origin
        kept.add(rows)


def measure_in_modes(accounts: Accounts, squares: Array, motion: KernelState) -> None:
    """Measure the energies of a state in modal coordinates, T = v . v / 2, V = sum of s q^2 / 2, Psi of its depths.

    Measured in other coordinates they differ by the round-off of stiff modes, and of penetrations that hold large
    forces, far more than a beam at rest exchanges.
    """
    kinetic, strain = 0.5 * float(motion.v @ motion.v), 0.5 * float(squares @ motion.q**2)
    contact = float(accounts.system.contact.weights @ accounts.law.potential(motion.depth))
    accounts.ledger = accounts.ledger.in_coordinates(kinetic, strain, contact)


def limits_of(accounts: Accounts) -> Limits:
    """Return the gates as numbers."""
    gates = accounts.gates.limits
    total = np.inf if gates.accept_energy_growth else gates.total_growth
    return Limits(float(gates.impact_growth), float(gates.impact_loss), float(total))
