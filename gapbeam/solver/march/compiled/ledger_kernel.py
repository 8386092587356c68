"""Records of every step in kernels: energy ledger, gates, contact episodes and peaks, as arrays.

Kernels measure in modal coordinates and call the functions of `gapbeam.solver.diagnostics` that the step-by-step march
calls: `energy_ledger`, `contact_episodes` and `impact_updates`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.diagnostics.contact_episodes import (
    FaceTouches,
    Peak,
    RunningImpact,
    Watched,
    after_contact,
    after_forces,
    after_gap,
    after_look,
    after_touch,
    approach_speed,
    breaks_gates,
)
from gapbeam.solver.diagnostics.energy_ledger import (
    Energies,
    StepEnergies,
    after_measuring,
    after_step,
    created_energy,
    energy_residual,
    exchanged_energy,
    relative_growth,
    unresolved_energy,
)
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.kernel_tables import KernelState, Records
from gapbeam.solver.system.operators import Array, Indices

SUMS = 10  # rows of one array: several arrays cost time in every step
IMPULSE, CONTACT_TIME, CLOSINGS, APPROACH, SQUARE, CLOSED_NOW, DEPTH, BEGUN, SPEED, DURATION = range(SUMS)
RECORDED = 5  # the first ones go into records
OF_IMPACT = 5  # columns of the list of impacts: face, closing time, approach speed, impulse, duration
EPS = float(np.finfo(float).eps)


class LedgerArrays(NamedTuple):
    """Ledger, gates, episodes and peaks of all steps so far.

    Attributes:
        energies: The ledger, in the order of `Energies`, (12,), J.
        load_work: Work of each load, (loads,), J.
        over_time: Sums over time of each face: impulse, N s, time in contact, s, how often it closed,
            approach speeds, m/s, square of the force, N^2 s, 1 where it is closed now, and the figures of
            `RunningImpact`, (10, faces).
        deepest: Largest penetration so far of each face, (faces,), m.
        peak_force: Largest contact force so far of each face, (faces,), N.
        peak_friction: Largest friction force so far of each face, (faces,), N.
        face: Whether each face is UNKNOWN, CLOSED or OPEN to the gates, (faces,).
        entry: Energy created, and kinetic and strain energy, when each face closed; NaN: not known, (2, faces), J.
        impacts: Impacts that ended, and how many of them broke the gates, (2,).
        impact_change: Largest relative growth and loss in an impact, (2,).
        episode_steps: Steps of the episode of each face, 0: none, (faces,).
        episode_impulse: Its impulse, (faces,), N s.
        episodes: Episodes that ended, and short ones, (2,).
        episodes_impulse: Their impulse, and that of short ones, (2,), N s.
        solves: Iterations since the last record, of the march, and the most in a step, (3,).
    """

    energies: Array
    load_work: Array
    over_time: Array
    deepest: Array
    peak_force: Array
    peak_friction: Array
    face: Indices
    entry: Array
    impacts: Indices
    impact_change: Array
    episode_steps: Indices
    episode_impulse: Array
    episodes: Indices
    episodes_impulse: Array
    solves: Indices


class Limits(NamedTuple):
    """The gates of a case: growth and loss of an impact, growth that ends the march (infinite: none)."""

    impact_growth: float
    impact_loss: float
    total_growth: float


@compiled
def energies_in(ledgers: LedgerArrays) -> Energies:
    """Return the ledger."""
    e = ledgers.energies
    return Energies(e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8], e[9], e[10], e[11])


@compiled
def keep_energies(ledgers: LedgerArrays, energies: Energies) -> None:
    """Keep the ledger."""
    for number, energy in enumerate(energies):
        ledgers.energies[number] = energy


@compiled
def total_work(ledgers: LedgerArrays) -> float:
    """Return the work of all loads."""
    work = 0.0
    for load in range(len(ledgers.load_work)):
        work += ledgers.load_work[load]
    return work


@compiled
def residual(ledgers: LedgerArrays) -> float:
    """Return the residual of the energy balance."""
    return energy_residual(energies_in(ledgers), total_work(ledgers))


@compiled
def growth(ledgers: LedgerArrays) -> float:
    """Return created energy relative to the energy exchanged."""
    energies = energies_in(ledgers)
    created = created_energy(energies, total_work(ledgers))
    return relative_growth(created, exchanged_energy(energies), energies.round_off)


@compiled
def enter_step(ledgers: LedgerArrays, measured: StepEnergies, works: Array) -> None:
    """Enter measured energies of a step, and the works of the loads."""
    keep_energies(ledgers, after_step(energies_in(ledgers), measured))
    for load in range(len(works)):
        ledgers.load_work[load] += works[load]


@compiled
def enter_energies(ledgers: LedgerArrays, contact: float, hidden: float, squares: Array, q: Array) -> None:
    """Enter the potential of the contact measured anew, and the round-off of the balance.

    Args:
        ledgers: Ledger arrays, changed in place.
        contact: Psi, J.
        hidden: Sum of the squared round-off of contact forces times penetrations, J^2.
        squares: s, (n,), 1/s^2.
        q: The state, (n,).
    """
    energies, total = energies_in(ledgers), hidden
    for j in range(len(q)):
        term = EPS * squares[j] * q[j] * q[j]
        total += term * term
    round_off = unresolved_energy(total, energies.strain, contact)
    keep_energies(ledgers, after_measuring(energies, energies.kinetic, energies.strain, contact, round_off))


@compiled
def enter_forces(
    ledgers: LedgerArrays, force: Array, friction: Array, pressed: Array, deepest: Array, dt: float
) -> None:
    """Enter contact and friction of a step, whether faces were pressed, and the penetration at its end, by face."""
    for face in range(len(force)):
        sums = ledgers.over_time
        peaks = ledgers.peak_force[face], ledgers.peak_friction[face], ledgers.deepest[face]
        before = Peak(sums[IMPULSE, face], sums[SQUARE, face], peaks[0], peaks[1], peaks[2])
        peak = after_forces(before, dt, force[face], friction[face], deepest[face])
        sums[IMPULSE, face], sums[SQUARE, face] = peak.impulse, peak.square
        ledgers.peak_force[face], ledgers.peak_friction[face] = peak.force, peak.friction
        ledgers.deepest[face] = peak.depth
        contact, impulse = pressed[face] > 0.0, ledgers.episode_impulse[face]
        added = dt * force[face] if contact else 0.0
        steps, running, ended, short = after_contact(ledgers.episode_steps[face], impulse, contact, added)
        ledgers.episode_steps[face], ledgers.episode_impulse[face] = steps, running
        ledgers.episodes_impulse[0] += added
        if ended:
            ledgers.episodes[0] += 1
        if short:
            ledgers.episodes[1] += 1
            ledgers.episodes_impulse[1] += impulse


@compiled
def enter_touches(ledgers: LedgerArrays, deepest: Array, dt: float, end: float, impacts: Array, listed: int) -> int:
    """Enter which faces are in contact at the end of a step, by their largest penetration, m.

    Args:
        ledgers: Ledger arrays, changed in place.
        deepest: Largest penetration of each face, (faces,), m.
        dt: Size of the step, s.
        end: Its end, s.
        impacts: Room for impacts that end, (rows, 5).
        listed: Rows that are filled.

    Returns:
        The rows that are filled then.
    """
    sums = ledgers.over_time
    for face in range(len(deepest)):
        depth, was_closed = deepest[face], sums[CLOSED_NOW, face] > 0.0
        if not (depth > 0.0 or was_closed):
            sums[DEPTH, face], sums[BEGUN, face] = depth, sums[IMPULSE, face]
            continue
        before = FaceTouches(sums[CONTACT_TIME, face], sums[CLOSINGS, face], sums[CLOSED_NOW, face])
        touch = after_touch(before, dt, depth > 0.0)
        running = RunningImpact(sums[DEPTH, face], sums[BEGUN, face], sums[SPEED, face], sums[DURATION, face])
        speed = approach_speed(running.depth, depth, dt)
        now, ended = after_gap(running, was_closed, depth > 0.0, speed, depth, sums[IMPULSE, face], dt)
        if not was_closed:
            sums[APPROACH, face] += speed
        if ended.ended:
            impacts[listed, 0], impacts[listed, 1] = face, end - ended.lag - now.duration
            impacts[listed, 2], impacts[listed, 3] = running.speed, ended.impulse
            impacts[listed, 4] = now.duration
            listed += 1
        sums[CONTACT_TIME, face], sums[CLOSINGS, face], sums[CLOSED_NOW, face] = (
            touch.time,
            touch.closings,
            touch.closed,
        )
        sums[DEPTH, face], sums[BEGUN, face], sums[SPEED, face] = now.depth, now.begun, now.speed
        sums[DURATION, face] = now.duration if depth > 0.0 else 0.0
    return listed


@compiled
def watch_impacts(ledgers: LedgerArrays, closed: Array, limits: Limits) -> None:
    """Judge impacts that end with a step; see `EnergyGates`."""
    energies = energies_in(ledgers)
    created, energy = created_energy(energies, total_work(ledgers)), energies.kinetic + energies.strain
    for face in range(len(closed)):
        before = Watched(ledgers.face[face], ledgers.entry[0, face], ledgers.entry[1, face])
        seen, ended, change = after_look(before, closed[face] > 0.0, created, energy, energies.round_off)
        ledgers.face[face], ledgers.entry[0, face], ledgers.entry[1, face] = (
            seen.face,
            seen.created,
            seen.energy,
        )
        if ended:
            ledgers.impacts[0] += 1
            ledgers.impact_change[0] = max(ledgers.impact_change[0], change)
            ledgers.impact_change[1] = max(ledgers.impact_change[1], -change)
            if breaks_gates(change, limits.impact_growth, limits.impact_loss):
                ledgers.impacts[1] += 1


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
        peak_friction=peaks.friction.copy(),
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
    """Update accounts from the ledger arrays after some more whole steps that took some seconds.

    Args:
        ledgers: Ledgers after the steps.
        accounts: Accounts, changed in place.
        steps: Whole steps.
        seconds: Their wall time, s.
        records: Records of the steps, with the impacts that ended in them.
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
    peaks.friction = ledgers.peak_friction.copy()
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


def measure_in_modes(accounts: Accounts, squares: Array, motion: KernelState, plastic_set: Array | None) -> None:
    """Measure the energies of a state in modal coordinates, T = v . v / 2, V = sum of s q^2 / 2, Psi of its depths.

    Measured in other coordinates they differ by the round-off of stiff modes, and of penetrations that hold large
    forces, far more than a beam at rest exchanges.
    """
    kinetic, strain = 0.5 * float(motion.v @ motion.v), 0.5 * float(squares @ motion.q**2)
    contact = float(accounts.system.contact.weights @ accounts.law.yielded_by(plastic_set).potential(motion.depth))
    accounts.ledger = accounts.ledger.in_coordinates(kinetic, strain, contact)


def limits_of(accounts: Accounts) -> Limits:
    """Return the gates as numbers."""
    gates = accounts.gates.limits
    total = np.inf if gates.accept_energy_growth else gates.total_growth
    return Limits(float(gates.impact_growth), float(gates.impact_loss), float(total))
