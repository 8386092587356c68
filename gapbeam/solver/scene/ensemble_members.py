"""Results of an ensemble, with the member as last axis, and the folder by which a killed ensemble continues.

Figures of one's own of the members of an ensemble, gathered block by block as they march: no history is kept.

Between steps a quantity is a straight line, and figures are those of the history of a run with a record at every step:
sums of h (a + b) / 2, h (a^2 + a b + b^2) / 3 and h p, the part above a limit, and the largest and smallest values. The
square is taken of the change since the start, so that little is lost beside a large mean.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.case.figure_table import Figure, part_above, parts_of
from gapbeam.solver.messages.errors import NotWritten, UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.object_code import fingerprint
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.reaction_rows import ReactionRows
from gapbeam.solver.scene.recorded_places import components_of, struck_places
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array

OF_CONTACTS = ("peak_force", "impulse", "impacts", "closed", "work", "force")
OPEN = 1e-8
"""Energy out of balance, over all energy that passed, beyond which a member is not trusted."""


@dataclass(frozen=True, eq=False)
class Members:
    """Results of an ensemble; the last axis is the member, and values of a member that failed are NaN.

    Features count from `settle` on, energies from the start of the march. Contacts "gland 1", "gland 2", ... are those
    of the face "gland", whose own entry in `peak_force`, `impulse`, `impacts` and `closed` is of all of them together.

    Attributes:
        q: Coordinates at the end, (n, members).
        v: Velocities at the end.
        z: States of the feedback at the end, 0 beyond those of a member.
        span: Time over which features count, (members,), s.
        peak: Largest displacement in absolute value by point, (members,), or (motions, members), m.
        rms: Root of the mean square of the displacement by point, m.
        harmonics: Complex amplitudes a_j of x = sum_j Re(a_j exp(2 pi i j t / period)) by point, j = 0, 1, ...:
            (harmonics + 1, members), or (harmonics + 1, motions, members), m.
        peak_force: Largest force in absolute value by contact, (members,), N; NaN of impulses, which have no force.
        impulse: Integral of the absolute value of the force by contact, N s.
        impacts: Number of closings by contact.
        closed: Time in contact of each contact, s.
        work: Energy lost by the law and by friction of each contact, J.
        energy: As of `step.energy`, by name, (members,), J.
        balance: Energy that the scheme made or lost, (members,), J.
        strobes: States (q, v) at the ends of the last periods, (strobes, 2 n, members).
        displacement: Histories of every so many steps by point, (times, members), or (times, motions, members).
        force: Histories of the force by contact, likewise, N.
        figures: Figures of one's own, by name, (members,).
        failed: Members whose contact forces did not converge in some step.
        untrusted: Members that failed, or whose energy is out of balance by more than 1e-8 of what passed: created, or
            also lost where the scheme keeps the balance.
    """

    __repr__ = result_words

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
        """Return all arrays by their names in a file, such as "peak/tip"."""
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
            parts[name][names.get(key, key) if name in OF_CONTACTS else key] = array
        else:
            parts[name] = array
    return Members(**parts)


def joined(parts: list[Members], order: Any) -> Members:
    """Return blocks one after the other, their members in the order that is asked for."""
    every = [part.flat() for part in parts]
    states = max(len(one["z"]) for one in every)  # members at different velocities have delays of different orders
    for one in every:
        one["z"] = np.pad(one["z"], ((0, states - len(one["z"])), (0, 0)))
    arrays = {key: np.concatenate([one[key] for one in every], axis=-1)[..., order] for key in every[0]}
    return filled(arrays, list(parts[0].work))


def untrusted(energy: dict[str, Array], balance: Array, first: Array, keeps: bool) -> Any:
    """Judge the balance of each member; `keeps`: whether the scheme keeps it."""
    passed: Any = np.abs(first) + sum(np.abs(one) for one in energy.values())
    off: Any = np.abs(balance) if keeps else np.maximum(balance, 0.0)
    return ~(off <= OPEN * passed)


SAMPLES = 50
"""Times at which loads and walls are compared with those of the blocks that are there."""


def arrays_in(path: Path) -> dict[str, Any]:
    """Return the arrays of a file.

    Raises:
        ValueError: The file cannot be read, was cut or overwritten, or is none of arrays.
    """
    try:
        with np.load(path) as arrays:
            return dict(arrays)
    except Exception as error:  # numpy, zipfile, zlib and tokenize have no error in common
        raise ValueError(str(error)) from error


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
            if found == key:
                return
            if any(path.glob("*.npz")):
                raise UserError(
                    f"ensemble: {path} has blocks of another ensemble (scene, values, steps or features differ); "
                    "choose another `output=`, or remove this folder to begin anew"
                )
        elif path.exists() and (not path.is_dir() or any(path.iterdir())):
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
        arrays = self.read(f"block_{number:06d}.npz")
        return None if arrays is None else filled(arrays, [one.name or i for i, one in enumerate(scene.contacts)])

    def read(self, name: str) -> dict[str, Any] | None:
        """Return the arrays of a finished file; None where it is missing, or damaged, so that it is computed again."""
        path = self.path / name
        if not path.exists():
            return None
        try:
            return arrays_in(path)
        except ValueError as error:
            LOG.warning("%s is damaged (%s): its members march again", path, error)
            return None

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
    digest = hashlib.sha256(f"with faces {numbers!r}".encode())

    def feed(array: Any) -> None:
        digest.update(np.ascontiguousarray(array, dtype=float).tobytes())

    for path, value in sorted(values.items()):
        digest.update(path.encode())
        feed(value)
    for array in (scene.squares, scene.damping, scene.contact_rows, scene.load_columns, start.q, start.v, start.z):
        feed(array)
    for one in scene.contacts:
        digest.update(fingerprint(one.name, one.region.kind, one.law.kind).encode())
        for value in (*one.values(1.0), one.place_at_rest):
            feed(value)
    for each in scene.feedbacks:
        for array in (each.A, each.B, each.C, each.D):
            feed(array)
    for load in scene.loads:
        feed(load.table(times, count))
        digest.update(fingerprint(load.value, load.parameters).encode())  # of pulses between these times
    feed(scene.walls(times))
    return digest.hexdigest()


MOTIONS = ("displacement", "velocity")
FORCE = "contact_force"
KEPT_BY_HISTORIES = ("quantile", "probability")
"""Statistics that need the whole history."""
TIMED = ("value", "time-of-maximum", "time-of-minimum")


def lane_figure_faults(scene: Scene, figures: Sequence[Figure]) -> Iterator[tuple[Figure, str]]:
    """Yield figures that cannot be gathered in lock-step, with reason and advice."""
    pairs = zip(scene.contact_names, scene.contacts, strict=True)
    signed = {name for name, one in pairs if one.is_rough or one.law.kind.adhesive}
    struck = struck_places(scene, ReactionRows(scene))
    for one in figures:
        if one.quantity not in (*MOTIONS, FORCE):
            yield one, f"quantity = {one.quantity!r}; expected {', '.join(MOTIONS)} or {FORCE}; or run one member"
        elif one.statistic in KEPT_BY_HISTORIES:
            yield one, f"statistic = {one.statistic!r}, which needs a history; expected another, or run one member"
        elif one.quantity == FORCE and (
            one.place in _labels_of(scene, one, signed) or parts_of(one.place or "", signed)
        ):
            yield one, "a contact with friction, or that pulls; expected one that presses, or run one member"
        elif one.quantity == FORCE and one.place in struck and not one.is_stepless:
            yield one, "impulses, whose force follows the step; expected the mean, or a displacement or velocity"
        else:
            try:
                _series(scene, one, np.zeros((1, scene.watched, 1)), np.zeros((1, len(scene.contacts), 1)))
            except UserError as error:
                yield one, str(error).removeprefix(f"figure {one.name}: ")


def response_figure_faults(scene: Scene, figures: Sequence[Figure]) -> Iterator[tuple[Figure, str]]:
    """Yield figures that responses cannot have, with why: those of `lane_figure_faults`, and those at a time."""
    for one in figures:
        if one.statistic in TIMED or one.start > 0.0 or one.end is not None:
            yield one, "it has a time, and figures of a response are over whole periods; expected none; or try a sweep"
        else:
            yield from lane_figure_faults(scene, [one])


def _labels_of(scene: Scene, figure: Figure, names: Iterable[str]) -> list[str]:
    """Return names of contacts; "gland 1", "gland 2", ... are those of "gland" where a figure is of that face."""
    if figure.place in scene.contact_names:
        return list(names)
    return [f"{figure.place}" if name.rstrip("0123456789") == f"{figure.place} " else name for name in names]


def _series(scene: Scene, figure: Figure, moved: Array, sizes: Array) -> Array:
    """Return the quantity of a figure, (steps, lanes), from motions of points and sizes of forces."""
    given = sizes if figure.quantity == FORCE else moved
    steps, _, lanes = given.shape
    flat = given.transpose(0, 2, 1).reshape(steps * lanes, -1)
    if figure.quantity == FORCE:
        found = figure.series({FORCE: flat}, {"face": _labels_of(scene, figure, scene.contact_names)})
    else:
        records = {figure.quantity: flat.reshape(steps * lanes, len(scene.probe_names), scene.probe_width)}
        labels = {"probe": scene.probe_names, "component": components_of(scene)}
        found = figure.series(records, labels)
    return np.asarray(found.reshape(steps, lanes))


class LaneFigures:
    """Figures of the lanes of one march.

    Args:
        scene: The scene.
        figures: Figures that `lane_figure_faults` accepts.
        lanes: Members side by side.
    """

    def __init__(self, scene: Scene, figures: Sequence[Figure], lanes: int) -> None:
        self.scene, self.t = scene, 0.0
        self.parts = [_Gathered(one, lanes) for one in figures]
        self.before: list[Array] = []

    def begin(self, t: float, seen: Array, speeds: Array, sizes: Array) -> None:
        """Begin at a time, s, with displacements and velocities (watched, lanes), and forces (contacts, lanes)."""
        self.t = t
        self.before = [one[0] for one in self._all(seen[None], speeds[None], sizes[None])]

    def add(self, h: float, seen: Array, speeds: Array, sizes: Array) -> None:
        """Take in a block of steps of h: (steps, watched, lanes) twice, (steps, contacts, lanes)."""
        times = self.t + h * np.arange(len(seen) + 1)
        for place, (one, x) in enumerate(zip(self.parts, self._all(seen, speeds, sizes), strict=True)):
            one.add(times, np.concatenate([self.before[place][None], x]))
            self.before[place] = x[-1].copy()
        self.t = float(times[-1])

    def values(self) -> dict[str, Array]:
        """Return the figures by name, (lanes,); NaN where the march ended before them."""
        return {one.figure.name: one.value() for one in self.parts}

    def _all(self, seen: Array, speeds: Array, sizes: Array) -> list[Array]:
        return [
            _series(self.scene, one.figure, speeds if one.figure.quantity == "velocity" else seen, sizes)
            for one in self.parts
        ]


class _Gathered:
    """Sums and extremes of one figure so far, (lanes,) each."""

    def __init__(self, figure: Figure, lanes: int) -> None:
        self.figure, self.span, self.reached = figure, 0.0, -inf
        self.high, self.low = np.full(lanes, -inf), np.full(lanes, inf)
        self.high_at, self.low_at = np.zeros(lanes), np.zeros(lanes)
        self.first: Array | None = None
        self.last, self.area, self.square, self.above = (np.zeros(lanes) for _ in range(4))

    def add(self, t: Array, x: Array) -> None:
        """Take in values (n, lanes) at times (n,), of which the first are known already."""
        one = self.figure
        until = inf if one.last is None else one.last
        low = max(until if one.statistic == "value" else one.start, float(t[0]))
        high = min(until, float(t[-1]))
        if low > high:
            return
        inside = (t > low) & (t < high)
        t, x = np.array([low, *t[inside], high]), np.vstack([_at(low, t, x), x[inside], _at(high, t, x)])
        h, lanes = np.diff(t), np.arange(x.shape[1])
        for sign, best, at in ((1.0, self.high, self.high_at), (-1.0, self.low, self.low_at)):
            place = np.argmax(sign * x, axis=0)
            better = sign * x[place, lanes] > sign * best
            best[better], at[better] = x[place, lanes][better], t[place][better]
        self.first = x[0].copy() if self.first is None else self.first
        a, b = x[:-1] - self.first, x[1:] - self.first
        self.area += h @ (0.5 * (a + b))
        self.square += h @ (a * a + a * b + b * b) / 3.0
        if one.statistic == "share":
            self.above += h @ part_above(x, one.limit or 0.0)
        self.span, self.reached, self.last = self.span + float(h.sum()), high, x[-1].copy()

    def value(self) -> Array:
        """Return the figure, (lanes,)."""
        one = self.figure
        if self.first is None or (one.last is not None and self.reached < one.last * (1.0 - 1e-9)):
            return np.full(len(self.last), np.nan)
        span, point = self.span, self.span == 0.0
        mean = np.asarray(self.last if point else self.first + self.area / span)
        match one.statistic:
            case "value":
                return self.last
            case "maximum" | "minimum":
                return self.high if one.statistic == "maximum" else self.low
            case "time-of-maximum" | "time-of-minimum":
                return self.high_at if one.statistic == "time-of-maximum" else self.low_at
            case "peak-to-peak":
                return np.asarray(self.high - self.low)
            case "mean":
                return mean
            case "rms":
                spread = self.square * 0.0 if point else self.square / span - (mean - self.first) ** 2
                return np.asarray(np.sqrt(np.maximum(spread, 0.0)))
            case _:
                limit = one.limit or 0.0
                return np.asarray(np.where(self.last > limit, 1.0, 0.0) if point else self.above / span)


def _at(time: float, t: Array, x: Array) -> Array:
    """Return values (n, lanes) at a time between the times (n,), on straight lines, (lanes,)."""
    place = min(max(int(np.searchsorted(t, time)), 1), len(t) - 1)
    part = (time - t[place - 1]) / (t[place] - t[place - 1])
    return np.asarray((1.0 - part) * x[place - 1] + part * x[place])
