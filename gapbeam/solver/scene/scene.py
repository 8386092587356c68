"""Scenes: structures with contacts, loads and feedback; condensed for a time step, a scene is ready to march."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as sl

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, for_each, positive
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.feedback import Feedback, Place, aligned, feedback_loop, joined, motions_once, parts_of
from gapbeam.solver.scene.linear_scheme import Linear, LinearScheme, Slabs, exact_modes, low_rank_factor
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.scene_load import Load
from gapbeam.solver.scene.scene_table import scene_html, scene_words
from gapbeam.solver.scene.structure import Structure, StructurePoint, dense
from gapbeam.solver.scene.touch_kernel import ROWS, STICKING, VALUES, WIDTH
from gapbeam.solver.system.operators import Array

FACTOR = "damping_factor"


@dataclass(eq=False)
class SceneState:
    """The motion of a scene at one time, in its coordinates; members are lanes.

    Attributes:
        t: s.
        q: Coordinates, (n, lanes).
        v: Velocities.
        z: States of the feedback.
        F: Contact forces, the mean over the last step, (motions, lanes).
        a: Accelerations, where the scheme needs them.
        memory: Memory of contact laws, such as that a snubber is locked, (values, lanes); default nothing.
    """

    __repr__ = result_words

    t: float
    q: Array
    v: Array
    z: Array
    F: Array
    a: Array | None = None
    memory: Array | None = None

    @property
    def x(self) -> Array:
        """Coordinates, velocities and states of the feedback below each other, (2 n + states, lanes)."""
        return np.vstack([self.q, self.v, self.z])

    def spread(self, lanes: int) -> SceneState:
        """Return the state for so many lanes: repeated where it has one."""

        def many(x: Array) -> Array:
            return np.repeat(x, lanes, axis=1) if x.shape[1] == 1 else x.copy()

        a, memory = (None if one is None else many(one) for one in (self.a, self.memory))
        return SceneState(self.t, many(self.q), many(self.v), many(self.z), many(self.F), a, memory)


class Scene:
    """Structures, their contacts and loads. A scene knows neither files nor output.

    Args:
        structures: The linear bodies.
        contacts: Contacts of the bodies with the frame or each other.
        loads: Loads on them.
        feedbacks: Linear forces that follow the motion.
        joints: Springs and dampers between points.
        masses: Point masses, (point, kg) each: they move with all motions of the point, and weigh.

    Raises:
        UserError: A point belongs to another structure, or a name is not unique.
    """

    @checked
    def __init__(
        self,
        *structures: Structure,
        contacts: Sequence[Contact] = (),
        loads: Sequence[Load] = (),
        feedbacks: Sequence[Feedback] = (),
        joints: Sequence[Feedback] = (),
        masses: Sequence[tuple[StructurePoint, float]] = (),
    ) -> None:
        if not structures:
            raise UserError("scene: expected one structure or more")
        self.given = structures
        self.contacts, self.loads, self.feedbacks = list(contacts), list(loads), [*feedbacks, *joints]
        for kind, expected, entries in (
            ("structure", Structure, structures), ("contact", Contact, self.contacts), ("load", Load, self.loads),
            ("feedback or joint", Feedback, self.feedbacks),
        ):  # fmt: skip
            for entry in entries:
                if not isinstance(entry, expected):
                    raise UserError(f"scene: found {entry!r} as a {kind}, expected {expected.__name__}")
        self.first = np.cumsum([0] + [one.motions for one in self.contacts])
        self.motions = int(self.first[-1])
        self.structures = self._loaded(masses)
        self._check_names()
        self._check_points()
        self.start = np.cumsum([0] + [one.size for one in structures])
        self.size = int(self.start[-1])
        self.damping_factors = np.ones(len(self.structures))
        self.is_large = any(one.is_large for one in structures)
        self._rows: dict[StructurePoint, Array] = {}

    __repr__, _repr_html_ = scene_words, scene_html

    def _loaded(self, masses: Sequence[tuple[StructurePoint, float]]) -> tuple[Structure, ...]:
        """Return the structures with their point masses."""
        found = list(self.given)
        for entry in masses:
            if not (isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[0], StructurePoint)):
                raise UserError(f'scene: found {entry!r} as a mass, expected (point, kg), such as (beam["tip"], 0.3)')
            point, kg = entry
            place = self.place_of(point.structure, f"mass at {point.name or '?'}")
            found[place] = found[place].with_masses({point: kg})
        return tuple(found)

    def place_of(self, structure: Structure | str, what: str) -> int:
        """Return the number of a structure of the scene, or of its name.

        Raises:
            UserError: The structure is not in the scene; the message names `what`.
        """
        for k, one in (pair for group in (self.given, getattr(self, "structures", ())) for pair in enumerate(group)):
            if one is structure or one.name == structure:
                return k
        name, known = getattr(structure, "name", structure) or "?", ", ".join(one.name or "?" for one in self.given)
        raise UserError(f"scene: {what} is at structure {name}, which is not of this scene; its structures: {known}")

    def _check_names(self) -> None:
        named = [one.name for group in (self.contacts, self.loads, self.feedbacks) for one in group if one.name]  # type: ignore[attr-defined]
        named += [one.name for one in self.structures if one.name]
        twice = sorted({name for name in named if named.count(name) > 1})
        if twice:
            raise UserError(
                f"scene: the name {twice[0]!r} is given twice; structures, contacts, loads and feedback share names"
            )
        if len(set(map(id, self.given))) < len(self.given):
            raise UserError("scene: a structure is given twice; make two")

    def _check_points(self) -> None:
        used: list[tuple[Any, Structure]] = [(one, p.structure) for one in self.contacts for p in one.points]
        used += [(one, p.structure) for one in self.feedbacks for p in one.points]
        used += [(one, one.structure) for one in self.loads]
        for one, structure in used:
            self.place_of(structure, f"{type(one).__name__.lower()} {getattr(one, 'name', '') or '(without a name)'}")

    @checked
    def with_(self, changes: Mapping[str, Any]) -> Scene:
        """Return the scene with other values.

        Args:
            changes: Changes by path, "name.value": a contact's "left.clearance", "left.stiffness", "left.friction", or
                "left.stiffness_factor" over the present one; a load's
                "shaker.value", or one of its parameters; "beam.damping_factor": the damping matrix of a structure times
                a number; the "velocity" or "density" of a flow. A star stands for any letters: "gland *.stiffness" are
                all contacts of that face. Arrays are for `ensemble`.

        Raises:
            UserError: Nothing has that name, or it has no such value; all faults at once.
        """
        contacts, loads, feedbacks = list(self.contacts), list(self.loads), list(self.feedbacks)
        faults, factors = [], self.damping_factors.copy()
        for path, value in changes.items():
            name, _, key = str(path).partition(".")
            bodies = [i for i, one in enumerate(self.structures) if one.name and fnmatchcase(one.name, name)]
            if bodies and key == FACTOR:
                factors[bodies] = positive(value, path, zero=True)
                continue
            groups: tuple[list[Any], ...] = (contacts, loads, feedbacks)
            found = [
                (group, i)
                for group in groups
                for i, one in enumerate(group)
                if one.name and fnmatchcase(one.name, name)
            ]
            if not found or not key:
                names = ", ".join(one.name for group in groups for one in group if one.name) or "none"
                owners = "".join(f", {one.name}.{FACTOR}" for one in self.structures if one.name)
                faults.append(
                    f"{path!r}: expected name.value with the name of a contact, load or feedback: {names}{owners}"
                )
                continue
            try:
                for group, place in found:
                    group[place] = group[place].replaced(key, value)
            except UserError as fault:
                faults.append(f"{path!r}: {fault}")
        if faults:
            raise UserError("\n".join(faults))
        other = self.with_parts(contacts, loads, feedbacks)
        if not np.array_equal(factors, self.damping_factors):
            other.damping_factors = factors
            other.__dict__.pop("damping", None)
        return other

    def is_condensed(self, path: str) -> bool:
        """Return True for a path of `with_` that changes the condensed scene: a damping factor or a feedback value."""
        name, _, key = path.partition(".")
        return key == FACTOR or any(one.name and fnmatchcase(one.name, name) for one in self.feedbacks)

    def with_parts(
        self, contacts: list[Contact], loads: list[Load], feedbacks: list[Feedback] | None = None
    ) -> Scene:  # fmt: skip
        """Return the scene with other contacts, loads and feedback at the same points; its structures stay."""
        other = object.__new__(Scene)
        other.__dict__.update(self.__dict__)
        other.contacts, other.loads = contacts, loads
        other.feedbacks = self.feedbacks if feedbacks is None else feedbacks
        other.__dict__.pop("offsets", None)
        return other

    def point(self, key: StructurePoint | str) -> StructurePoint:
        """Return a point, also by its name where that is unique in the scene, or by "structure.name".

        Raises:
            UserError: The scene has no such point, or several.
        """
        if isinstance(key, StructurePoint):
            return key
        owner, _, name = key.rpartition(".")
        bodies = [one for one in self.structures if not owner or one.name == owner]
        found = [one.points[name] for one in bodies if name in one.points]
        if len(found) != 1:
            known = ", ".join(self.point_names) or "none"
            raise UserError(f"scene: {len(found) or 'no'} points are called {key!r}; its points: {known}")
        return found[0]

    @cached_property
    def point_names(self) -> dict[str, StructurePoint]:
        """All points of the scene by name; with the name of their structure before it where several share one."""
        every = [(one, name) for one in self.structures for name in one.points]
        names = [name for _, name in every]
        return {
            name if names.count(name) == 1 else f"{one.name or self.structures.index(one)}.{name}": one.points[name]
            for one, name in every
        }

    def short_name(self, name: str) -> str:
        """Return the name in `point_names` of a point that is given as there or as "structure.name"; others stay."""
        return {f"{one.structure.name}.{one.name}": short for short, one in self.point_names.items()}.get(name, name)

    @cached_property
    def contact_names(self) -> tuple[str, ...]:
        """A name for each contact: its own, or "contact" with its number."""
        return tuple(one.name or f"contact {number}" for number, one in enumerate(self.contacts, 1))

    @property
    def watched(self) -> int:
        """Number of motions of all points."""
        return sum(len(point.rows) for point in self.point_names.values())

    @cached_property
    def probe_width(self) -> int:
        """Components of the records of points: 2 where all have two motions, else 1."""
        return 2 if {len(point.rows) for point in self.point_names.values()} == {2} else 1

    @cached_property
    def probe_names(self) -> tuple[str, ...]:
        """Names of the points in records; of points of several motions beside others, of each motion."""
        width = self.probe_width
        return tuple(
            name if width == len(point.rows) else f"{name} {number}"
            for name, point in self.point_names.items()
            for number in range(1, len(point.rows) // width + 1)
        )

    def rows_of(self, structure: Structure, rows: Array) -> Array:
        """Return rows of a structure's DOFs as rows of the scene's coordinates."""
        place = self.place_of(structure, "a point")
        found = np.zeros((len(rows), self.size))
        across = rows if self.is_large else rows @ self.structures[place].modes[2]
        found[:, self.start[place] : self.start[place + 1]] = across
        return found

    def rows(self, places: Iterable[Place]) -> Array:
        """Return the rows of points; those of a pair are of the motion of the first relative to the second."""
        found: list[Array] = [np.zeros((0, self.size))]
        for first, *others in (part for place in places for part in parts_of(place)):
            found.append(self.rows_at(first) - sum(self.rows_at(one) for one in others))
        return np.vstack(found)

    def rows_at(self, point: StructurePoint) -> Array:
        """Return the rows of a point, (motions, n), computed once."""
        if point not in self._rows:
            self._rows[point] = self.rows_of(point.structure, point.rows)
        return self._rows[point]

    @cached_property
    def contact_rows(self) -> Array:
        """B: rows of all contact motions, (motions, n)."""
        parts = [(self.rows([one.between]), np.zeros((int(one.grows), self.size))) for one in self.contacts]
        return np.vstack([np.zeros((0, self.size)), *(rows for part in parts for rows in part)])

    @cached_property
    def offsets(self) -> Array:
        """Places of the contacts at rest, (motions, members), or (motions, 1) where all members share them."""
        parts = [one.place_at_rest for one in self.contacts]
        lanes = max((part.shape[1] for part in parts), default=1)
        return np.vstack([np.zeros((0, lanes)), *(np.broadcast_to(part, (len(part), lanes)) for part in parts)])

    @cached_property
    def squares(self) -> Array:
        """Squared angular frequencies of all modes, (n,)."""
        return np.concatenate([one.modes[0] for one in self.structures])

    @cached_property
    def damping(self) -> Array:
        """Modal damping: (1, n) where it is diagonal, else (n, n)."""
        pairs = zip(self.structures, self.damping_factors, strict=True)
        C = sl.block_diag(*(factor * one.modes[1] for one, factor in pairs))
        off = np.abs(C - np.diag(np.diag(C))).max(initial=0.0)
        return np.diag(C)[None].copy() if off <= 1e-12 * np.abs(C).max(initial=0.0) else C

    @cached_property
    def load_columns(self) -> Array:
        """Patterns of the loads, (n, loads); one of zeros if there are none."""
        places = (self.place_of(one.structure, f"load {one.name or '?'}") for one in self.loads)
        patterns = [one.pattern_on(self.structures[place]) for one, place in zip(self.loads, places, strict=False)]
        pairs = zip(self.loads, patterns, strict=True)
        columns = [self.rows_of(one.structure, pattern[None])[0] for one, pattern in pairs]
        return np.column_stack(columns or [np.zeros(self.size)])

    @cached_property
    def is_moving(self) -> bool:
        """True where contacts are at points that move along structures."""
        return any(point.is_moving for one in self.contacts for point in one.points)

    def condensed(self, h: float, scheme: LinearScheme) -> Linear:
        """Return the arrays of the scene, in its modes, for a step of h.

        Raises:
            UserError: Points move along structures: their rows change from step to step.
        """
        if self.is_moving:
            moved = next(one.name or "?" for one in self.contacts for point in one.points if point.is_moving)
            raise UserError(
                f"scene: found contact {moved} at a point that moves along a structure, expected points that stay; "
                "such scenes are marched one by one: gapbeam.march, history and run"
            )
        w, C, i0, d0 = self.squares, self.damping, scheme.inertia[0] / h * np.ones(self.size), scheme.drag[0]
        root: Array = np.ones(self.size)
        if scheme.exact:
            mass, drag = exact_modes(w, C[0] if len(C) == 1 else np.zeros(len(w)), h)
            i0, root, C = i0 * mass, np.sqrt(mass), drag[None] if len(C) == 1 else C
        if len(C) == 1:
            weight, inverse = np.asarray(1 / (i0 + d0 * C[0] + scheme.level * h * w), dtype=float), np.zeros((0, 0))
            return self.linear(h, scheme, weight, inverse, w, C, root, lambda R: weight[:, None] * R)
        whole = np.asarray(np.linalg.inv(np.diag(i0 + scheme.level * h * w) + d0 * C), dtype=float)
        return self.linear(h, scheme, np.ones(len(w)), whole, w, C, root, lambda R: whole @ R)

    def linear(
        self, h: float, scheme: LinearScheme, weight: Array, inverse: Array, squares: Array, damping: Array,
        root: Array, solve: Callable[[Array], Array],
    ) -> Linear:  # fmt: skip
        """Eliminate feedback and contact, given a solver of the effective operator."""
        B, patterns, m = self.contact_rows, self.load_columns.T, self.motions
        sense, act = self.rows([one.sense for one in self.feedbacks]), self.rows([one.act for one in self.feedbacks])
        fed, places = motions_once(np.vstack([sense, act]))
        port = (m + len(patterns) + places).astype(np.uint64)
        ports = np.vstack([B, patterns, fed])
        X = solve(np.vstack([B, ports[port[len(sense) :]]]).T)
        G = ports @ X
        feed, met = feedback_loop(joined(self.feedbacks, h, scheme.level), fed, X.T[m:], G, port)
        numbers = np.array([scheme.inertia, scheme.drag, scheme.velocity, scheme.acceleration])
        watch = self.rows(self.point_names.values())
        arrays = (
            weight, inverse, squares, damping, ports[: m + len(patterns)], X.T[:m], patterns, met[:m].T,
            low_rank_factor(met[:m].T, self.is_moving), met[m:].T, watch, root, numbers,
        )  # fmt: skip
        kept: Any = (aligned(np.asarray(one, dtype=float)) for one in arrays)
        return Linear._make([*kept, feed])

    def slabs(
        self, lanes: int = 1, h: float = 1.0, delassus: Array | None = None, level: float = 0.0, rough: bool = True
    ) -> Slabs:
        """Return the touches of the contacts with workspaces that hold their values, contacts of one kind side by side.

        Args:
            lanes: Members side by side.
            h: Step, s.
            delassus: Delassus operator of the condensed scene, against which friction that sticks is stiff.
            level: Level of the step at which laws are asked.
            rough: False leaves out friction.

        Raises:
            UserError: A contact has values for another number of members.
        """
        for one in self.contacts:
            one.check_members(lanes)
        kinds: dict[tuple[int, int], list[int]] = {}
        for i, one in enumerate(self.contacts):
            kinds.setdefault((one.compiled(level, rough), one.motions), []).append(i)
        size = WIDTH // lanes
        parts = [(key, some[i : i + size]) for key, some in kinds.items() for i in range(0, len(some), size)]
        work, order = np.zeros((len(parts), ROWS, size, lanes)), [i for _, some in parts for i in some]
        mobility = np.zeros(self.motions) if delassus is None else np.diag(delassus)
        for room, (_, some) in zip(work, parts, strict=True):
            for k, i in enumerate(some):
                most = h * mobility[self.first[i] : self.first[i + 1]].max()
                stick = STICKING / most if most > 0.0 else 1.0
                for row, value in enumerate(self.contacts[i].values(stick), VALUES - 2):
                    room[row, k] = value

        def integers(values: Any) -> Any:
            return np.array(values, dtype=np.int64)

        places = work.ctypes.data + 8 * ROWS * WIDTH * np.arange(len(parts), dtype=np.int64)
        starts = np.cumsum([0] + [len(some) for _, some in parts])
        return Slabs(
            integers([key[0] for key, _ in parts]), places, integers(starts), integers([key[1] for key, _ in parts]),
            self.first[integers(order)].astype(np.int64), work,
            np.zeros((len(order), lanes)), any((one.is_rough and rough) or one.is_impulsive for one in self.contacts),
            integers([self.contacts[some[0]].sticks for _, some in parts]),
            integers([self.contacts[some[0]].memory[0] for _, some in parts]),
            integers([self.contacts[some[0]].memory[1:] for _, some in parts]).reshape(-1, 2),
        )  # fmt: skip

    def walls(self, times: Array, lanes: int = 1) -> Array:
        """Return the given motions of the regions, (times, motions, lanes), m."""
        found = np.zeros((len(times), self.motions, lanes))
        moving = [(one, at) for one, at in zip(self.contacts, self.first, strict=False) if one.is_moved]
        for k, t in enumerate(times if moving else ()):  # walls that move together may compute their motion once a time
            for one, at in moving:
                found[k, at : at + one.motions] = one.moved(float(t))[:, None]
        return found

    @checked
    def state(
        self, displacement: Mapping[Any, Any] | None = None, velocity: Mapping[Any, Any] | None = None, t: float = 0.0
    ) -> SceneState:  # fmt: skip
        """Return a state from DOFs of structures, {structure or its name: number or (DOFs,)}; at rest elsewhere.

        Raises:
            UserError: A structure is not of the scene, or values are neither a number nor one for each DOF.
        """
        q, v = np.zeros(self.size), np.zeros(self.size)
        for target, given in ((q, displacement or {}), (v, velocity or {})):
            for structure, value in given.items():
                place = self.place_of(structure, "the state")
                body = self.structures[place]
                u = for_each(value, body.size, f"state: structure {body.name or '?'}")
                own = u if self.is_large else body.modes[2].T @ (dense(body.M) @ u)
                target[self.start[place] : self.start[place + 1]] = own
        return SceneState(t, q[:, None], v[:, None], np.zeros((self.states, 1)), np.zeros((self.motions, 1)))

    def refuse_memory(self, what: str) -> None:
        """Refuse contacts whose laws remember, where a state is displacements, velocities and states of the feedback.

        Raises:
            UserError: A contact has such a law.
        """
        found = [one.name or "?" for one in self.contacts if one.law.kind.memory]
        if found:
            raise UserError(
                f"{what}: found {found[0]}, which remembers its past, expected contacts without memory; march the scene"
            )

    def check_feedback(self, z: Array, span: float) -> None:
        """Refuse forces that a march does not represent.

        Args:
            z: States of the feedback at the start, (states, lanes).
            span: Span of the march, s.

        Raises:
            UserError: A law does not hold at a frequency of interest, or a force that lags by more than the march
                begins without a past.
        """
        for one in self.feedbacks:
            one.check()
            if one.delay > span and not z.any():
                raise UserError(
                    f"flow {one.name or '?'}: its delay of {one.delay:.4g} s is longer than the march of {span:.4g} s, "
                    "so its force never begins; march longer"
                )

    @property
    def states(self) -> int:
        """Number of states of the feedback."""
        return sum(len(one.A) for one in self.feedbacks)

    def inputs(self, q: Array) -> Array:
        """Return the displacements that the feedback reads."""
        return self.rows([one.sense for one in self.feedbacks]) @ q

    def places(self, q: Array, t: float) -> Array:
        """Return the places of the contact points relative to their regions, (motions, lanes), m."""
        found: Array = self.contact_rows @ q + self.offsets - self.walls(np.array([t]))[0]
        return found
