"""Results of an ensemble, with the member as last axis, and the folder by which a killed ensemble continues."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import NotWritten, UserError
from gapbeam.solver.scene.scene import Scene, SceneState
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
        figures: Of one's own, by name, (members,).
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
    figures: dict[str, Array]
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


SAMPLES = 50
"""Times at which loads and walls are compared with those of the blocks that are there."""


class EnsembleFolder:
    """Blocks of members as files, each written whole or not at all.

    Args:
        path: The folder; made where it is missing.
        key: Hash of all that the results follow from.

    Raises:
        UserError: The folder has blocks of another ensemble.
        NotWritten: The disk takes no file.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path, note = path, path / "ensemble.json"
        if note.exists():
            found = json.loads(note.read_text()).get("key")
            if found != key:
                raise UserError(
                    f"ensemble: {path} has blocks of another ensemble (scene, values, steps or features differ); "
                    "give another folder, or remove this one"
                )
            return
        if path.exists() and any(path.iterdir()):
            raise UserError(f"ensemble: {path} is not empty and holds no ensemble; give another folder")
        self._write(note, lambda file: file.write(json.dumps({"key": key}).encode()))

    def _write(self, path: Path, write: Any) -> None:
        part = path.with_name(path.name + ".part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with part.open("wb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
        except OSError as error:
            with suppress(OSError):
                part.unlink()
            raise NotWritten(
                f"{path} could not be written: {error.strerror}; make room, and call again: finished blocks are kept"
            ) from error

    def block(self, number: int, scene: Scene) -> Members | None:
        """Return a finished block, or None."""
        path = self.path / f"block_{number:06d}.npz"
        if not path.exists():
            return None
        with np.load(path) as arrays:
            return filled(dict(arrays), [one.name or i for i, one in enumerate(scene.contacts)])

    def keep(self, number: int, members: Members) -> None:
        """Write a block."""
        self.write(f"block_{number:06d}.npz", lambda file: np.savez(file, **members.flat()))

    def write(self, name: str, write: Any) -> None:
        """Write another file, whole or not at all: `write` takes the open file.

        Raises:
            NotWritten: The disk takes no file.
        """
        self._write(self.path / name, write)


def ensemble_key(
    scene: Scene, values: dict[str, Any], count: int, start: SceneState, times: Any, *numbers: Any
) -> str:  # fmt: skip
    """Return a hash of scene, values, start and numbers: two ensembles of one key have the same results."""
    digest = hashlib.sha256(repr(numbers).encode())

    def feed(array: Any) -> None:
        digest.update(np.ascontiguousarray(array, dtype=float).tobytes())

    for path, value in sorted(values.items()):
        digest.update(path.encode())
        feed(value)
    for array in (scene.squares, scene.damping, scene.contact_rows, scene.load_columns, start.q, start.v, start.z):
        feed(array)
    for one in scene.contacts:
        digest.update(f"{one.name} {one.region.kind.name} {one.law.kind.names} {one.law.kind.name}".encode())
        functions: Any = (one.region.kind.face, one.law.kind.spring, one.law.kind.potential, one.law.kind.damper)
        for function in functions:
            digest.update(b"" if function is None else function.py_func.__code__.co_code)
        for value in (*one.values(1.0), one.place_at_rest):
            feed(value)
    for each in scene.feedbacks:
        for array in (each.A, each.B, each.C, each.D):
            feed(array)
    for load in scene.loads:
        feed(load.table(times, count))
    feed(scene.walls(times))
    return digest.hexdigest()
