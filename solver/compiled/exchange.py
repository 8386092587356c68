"""Between the books of kernels and the accounts of a march."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.accounts import Accounts
from solver.compiled.books import CLOSED, OPEN, UNKNOWN, Books, Limits
from solver.energy import Ledger
from solver.operators import Array

_ENERGIES = (
    "kinetic",
    "strain",
    "contact",
    "start",
    "structural",
    "contact_loss",
    "algorithmic",
    "largest_kinetic",
    "absolute_work",
    "round_off",
    "contact_gain",
    "friction_loss",
)  # of Ledger, in the order of Books.energies


def books_of(accounts: Accounts) -> Books:
    """Return the books that go on from accounts."""
    ledger, gates, episodes, peaks, tally = (
        accounts.ledger,
        accounts.gates,
        accounts.episodes,
        accounts.peaks,
        accounts.tally,
    )
    faces = range(len(peaks.impulse))
    seen = {None: UNKNOWN, False: CLOSED, True: OPEN}
    running = [episodes.running.get(face, (0, 0.0)) for face in faces]
    return Books(
        energies=np.array([getattr(ledger, name) for name in _ENERGIES]),
        load_work=ledger.load_work.copy(),
        impulse=peaks.impulse.copy(),
        deepest=peaks.deepest.copy(),
        peak_force=peaks.force.copy(),
        face=np.array([seen[gates.open_faces.get(face)] for face in faces]),
        entry=np.array([gates.entries.get(face, (np.nan, np.nan)) for face in faces]).T.copy(),
        impacts=np.array([gates.impacts, gates.violations]),
        impact_change=np.array([gates.largest_growth, gates.largest_loss]),
        episode_steps=np.array([steps for steps, _ in running]),
        episode_impulse=np.array([impulse for _, impulse in running]),
        episodes=np.array([episodes.count, episodes.short]),
        episodes_impulse=np.array([episodes.impulse, episodes.short_impulse]),
        solves=np.array([peaks.iterations, tally.iterations, tally.most_iterations]),
    )


def enter_books(books: Books, accounts: Accounts, steps: int, seconds: float) -> None:
    """Bring accounts to what books hold after some more whole steps that took some seconds."""
    gates, episodes, peaks, tally = accounts.gates, accounts.episodes, accounts.peaks, accounts.tally
    accounts.ledger = ledger_of(books.energies, books.load_work)
    faces = range(len(peaks.impulse))
    gates.open_faces = {face: bool(books.face[face] == OPEN) for face in faces if books.face[face] != UNKNOWN}
    gates.entries = {
        face: (float(books.entry[0, face]), float(books.entry[1, face]))
        for face in faces
        if not np.isnan(books.entry[0, face])
    }
    gates.impacts, gates.violations = (int(count) for count in books.impacts)
    gates.largest_growth, gates.largest_loss = (float(change) for change in books.impact_change)
    episodes.running = {
        face: (int(books.episode_steps[face]), float(books.episode_impulse[face]))
        for face in faces
        if books.episode_steps[face] > 0
    }
    episodes.count, episodes.short = (int(count) for count in books.episodes)
    episodes.impulse, episodes.short_impulse = (float(impulse) for impulse in books.episodes_impulse)
    peaks.impulse, peaks.deepest, peaks.force = books.impulse.copy(), books.deepest.copy(), books.peak_force.copy()
    peaks.iterations, tally.iterations, tally.most_iterations = (int(count) for count in books.solves)
    tally.steps += steps
    tally.shortest = min(tally.shortest, tally.dt) if steps else tally.shortest
    tally.advance += seconds


def ledger_of(energies: Array, load_work: Array) -> Ledger:
    """Return the ledger that books hold, or one row of records."""
    values = {name: float(value) for name, value in zip(_ENERGIES, energies, strict=True)}
    ledger = Ledger(load_work=load_work.copy(), **values)
    return replace(ledger, exchanged=ledger.absolute_work + ledger.largest_kinetic)


def limits_of(accounts: Accounts) -> Limits:
    """Return the gates as numbers."""
    gates = accounts.gates.limits
    total = np.inf if gates.accept_energy_growth else gates.total_growth
    return Limits(float(gates.impact_growth), float(gates.impact_loss), float(total))
