"""Results of an ensemble: features of each member, with the member as last axis."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from gapbeam.solver.system.operators import Array

OF_CONTACTS = ("peak_force", "impulse", "impacts", "closed", "work", "force")
OPEN = 1e-8
"""Energy out of balance, over all energy that passed, beyond which a member is not trusted."""


@dataclass(frozen=True, eq=False)
class Members:
    """Results of an ensemble; the last axis is the member, and values of a member that failed are NaN.

    Features count from `settle` on, energies from the start of the march.

    Attributes:
        q: Coordinates at the end, (n, members).
        v: Velocities at the end.
        z: States of the feedback at the end.
        span: Time over which features count, (members,), s.
        peak: By point, the largest displacement in absolute value, (members,), or (motions, members), m.
        rms: By point, the root of the mean square of the displacement, m.
        harmonics: By point, complex amplitudes a_j of x = sum_j Re(a_j exp(2 pi i j t / period)), j = 0, 1, ...:
            (harmonics + 1, members), or (harmonics + 1, motions, members), m.
        peak_force: By contact, the largest force in absolute value, (members,), N.
        impulse: By contact, the integral of the absolute value of the force, N s.
        impacts: By contact, how often it closed.
        closed: By contact, time in contact, s.
        work: By contact, energy lost by its law and by friction, J.
        energy: As of `step.energy`, by name, (members,), J.
        balance: Energy that the scheme made or lost, (members,), J.
        strobes: States (q, v) at the ends of the last periods, (strobes, 2 n, members).
        displacement: By point, histories of every so many steps, (times, members), or (times, motions, members).
        force: By contact, likewise, N.
        failed: Members whose contact forces did not converge in some step.
        untrusted: Members that failed, or whose energy is out of balance by more than 1e-8 of what passed: created, or
            also lost where the scheme keeps the balance.
    """

    q: Array
    v: Array
    z: Array
    span: Array
    peak: dict[str, Array]
    rms: dict[str, Array]
    harmonics: dict[str, Any]
    peak_force: dict[str | int, Array]
    impulse: dict[str | int, Array]
    impacts: dict[str | int, Array]
    closed: dict[str | int, Array]
    work: dict[str | int, Array]
    energy: dict[str, Array]
    balance: Array
    strobes: Array
    displacement: dict[str, Array]
    force: dict[str | int, Array]
    failed: Any
    untrusted: Any

    @property
    def impact_rate(self) -> dict[str | int, Array]:
        """Impacts a second, by contact."""
        return {name: count / self.span for name, count in self.impacts.items()}

    def flat(self) -> dict[str, Any]:
        """Return all arrays by a name, "peak/tip": what a file keeps."""
        found: dict[str, Any] = {}
        for one in fields(self):
            value = getattr(self, one.name)
            pairs = value.items() if isinstance(value, dict) else (("", value),)
            found |= {f"{one.name}/{key}" if isinstance(value, dict) else one.name: array for key, array in pairs}
        return found


def filled(arrays: dict[str, Any], contacts: list[str | int]) -> Members:
    """Return members from arrays as of `flat`, with the names of the contacts."""
    parts: dict[str, Any] = {one.name: {} for one in fields(Members)}
    names = {str(name): name for name in contacts}
    for path, array in arrays.items():
        name, inside, key = path.partition("/")
        if inside:
            parts[name][names[key] if name in OF_CONTACTS else key] = array
        else:
            parts[name] = array
    return Members(**parts)


def joined(parts: list[Members], order: Any) -> Members:
    """Return blocks one after the other, their members in the order that is asked for."""
    every = [part.flat() for part in parts]
    arrays = {key: np.concatenate([one[key] for one in every], axis=-1)[..., order] for key in every[0]}
    return filled(arrays, list(parts[0].work))


def untrusted(energy: dict[str, Array], balance: Array, first: Array, keeps: bool) -> Any:
    """Judge the balance of each member; `keeps`: whether the scheme keeps it."""
    passed: Any = np.abs(first) + sum(np.abs(one) for one in energy.values())
    off: Any = np.abs(balance) if keeps else np.maximum(balance, 0.0)
    return ~(off <= OPEN * passed)
