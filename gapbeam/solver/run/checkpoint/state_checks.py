"""Consistency of a checkpoint: a correct checksum does not make its contents a state of the model.

    M x, K x of u, v, a;    d = -(g0 + G u);    T, V and Psi of the ledger;    X q = u;    t = n dt

are stored beside what they follow from, so that they are checked by computing them again.

A checkpoint holds the state as arrays that any number of ranks can read. A full model keeps its DOFs at the nodes of a
mesh, numbered anew for every number of ranks: they are matched by place. A model of few DOFs has the same ones on all
ranks, as long as it goes on with the same matrices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.energy_ledger import open_ledger
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.compiled_march import misfit
from gapbeam.solver.march.compiled.plan_arrays import memory_of_friction
from gapbeam.solver.march.stepwise_march import Paused
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.checkpoint_files import BrokenCheckpoint, Contents
from gapbeam.solver.run.checkpoint.diagnostics_text import MALFORMED, restore
from gapbeam.solver.run.checkpoint.kept_model import matrices_of, sum_of
from gapbeam.solver.run.output.parallel_tables import ParallelTable, RankRows, found_rows, matching, rank_by_rank, taken
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, State

if TYPE_CHECKING:
    from mpi4py import MPI

CARRIED = 1.0e-4  # of an image: how far it may have drifted since it was formed anew, iterative solves included
ROUND_OFF = 1.0e6  # of the round-off of a product with K
OF_BALANCE = 1.0e3  # of the round-off of contact and inertia forces of a step
MEASURED = 1.0e-4  # of the energies: how far those of the ledger may be from those of the state
SAME = 1.0e-9  # of the largest value, where the same is stored twice
BEYOND_PEAK = 10.0  # of the largest force of a face so far: what a point may carry, at another instant of a step
OF_A_STEP = 1.0e-3  # how far a time may be from a whole number of steps


def refuse_implausible(paused: Paused, header: dict[str, Any], case: Case, model: Model, comm: MPI.Comm) -> None:
    """Refuse a state that is not one of the model, or that the accounts do not belong to.

    Args:
        paused: The march, on the DOFs of this rank.
        header: Other contents of the checkpoint.
        case: The case.
        model: Its model.
        comm: Its ranks.

    Raises:
        BrokenCheckpoint: Something follows from something else, and is not what follows; all of that is reported.

    Collective.
    """
    state = paused.state
    found = [*_of_accounts(paused, header, Recorder(case, model)), *_of_header(paused, header, model.step)]
    found += [*_of_parts(state, model, case.time.adaptive), *_of_images(state, model), *_of_points(state, model)]
    found += [*_of_modes(paused, model), *_of_ledger(state, header, model)]
    faults = comm.bcast(found)
    if faults:
        raise BrokenCheckpoint("what it holds does not belong together: " + "; ".join(faults))


def _of_header(paused: Paused, header: dict[str, Any], step: float) -> Iterator[str]:
    time = paused.state.time
    if not isfinite(time) or abs(time / step - paused.done) > OF_A_STEP:
        yield f"its time is {time:g} s, expected {paused.done * step:g} s after {paused.done} steps"
    if min(paused.done, paused.since) < 0 or header["records"] < 1:
        yield "a number of steps or records is negative"
    fields = header["fields"]
    times_are = all(isinstance(entry, float) and 0.0 <= entry <= time for entry in [*fields, *header["resumed"]])
    if not times_are or any(not later > earlier for earlier, later in pairwise(fields)):
        yield "the times of its fields are not those of a run up to then"
    values = [value for entry in header["seat"].values() for value in _leaves(entry)]
    if not all(isinstance(value, int | float) and isfinite(value) for value in values):
        yield "its seat holds other things than numbers"


def _leaves(entry: Any) -> list[Any]:
    """Return the leaves of a seat's description: a number, or those of each probe."""
    if not isinstance(entry, dict):
        return [entry]
    return [number for place in entry.values() for number in (place if isinstance(place, list) else [place])]


def _of_accounts(paused: Paused, header: dict[str, Any], recorder: Recorder) -> Iterator[str]:
    """Fill accounts that nobody keeps from a checkpoint."""
    model = recorder.model
    accounts = Accounts.opened(model.system, model.law, paused.state, model.step)
    try:
        restore(accounts, recorder, header["accounts"])
    except MALFORMED as error:
        yield f"its accounts cannot be read ({error!r})"
        return
    state, weights = paused.state, model.system.contact.weights
    if accounts.time != state.time:
        yield f"its accounts are of {accounts.time:g} s, expected {state.time:g} s"
    if not recorder.agrees_with(state.time, state.v[VALUE], CARRIED):
        yield "the probes do not move as in the last record"
    largest = BEYOND_PEAK * _largest(accounts.peaks.force)
    if not _largest(weights * state.pressure) <= largest:
        yield "a contact pressure is far beyond the largest force so far"
    if state.traction is not None and not _largest(weights[:, None] * state.traction) <= largest:
        yield "a friction traction is far beyond the largest force so far"


def _of_parts(state: State, model: Model, adaptive: bool) -> Iterator[str]:
    """Check the parts of a state that a march of the case carries along."""
    friction = model.law.friction
    sticks = friction is not None and friction.static_coefficient is not None
    needed = {
        "a": model.scheme.carries_acceleration,
        "touch_speed": model.law.touch_product is not None,
        "closed_since": adaptive,
        "plastic_set": model.law.keeps_set,
        "slip": sticks,
        "slides": sticks,
    }
    for name, carried in needed.items():
        if carried and getattr(state, name) is None:
            yield f"{name} is missing"


def _of_images(state: State, model: Model) -> Iterator[str]:
    operators = model.system.operators
    contact, forces, rate = model.system.contact, np.zeros(operators.size), 2.0 / model.step
    contact = contact.at(contact.interface.trace(state.u[VALUE], operators), state.time)
    contact.interface.add(forces, contact.resultant(contact.weights * state.pressure))
    # K x follows from the balance of a step: what hardly deforms has no more digits of it than its other terms leave
    left = OF_BALANCE * np.finfo(float).eps * (np.abs(forces) + rate * np.abs(state.v[MASS]))
    inertia = {"u": left, "v": rate * left}
    for name in ("u", "v", "a"):
        x = getattr(state, name)
        if x is None:
            continue
        mass, stiffness = operators.apply_mass(x[VALUE]), operators.apply_stiffness(x[VALUE])
        noise = ROUND_OFF * operators.stiffness_round_off(x[VALUE])
        if name in inertia:
            noise = np.hypot(noise, inertia[name])
        for image, product, other in ((x[MASS], mass, 0.0 * noise), (x[STIFFNESS], stiffness, noise)):
            off = image - product
            square, size, rough = operators.sum(np.array([off @ off, product @ product, other @ other]))
            if not square <= CARRIED**2 * size + rough:
                yield f"{name} and what mass and stiffness make of it differ"


def _of_points(state: State, model: Model) -> Iterator[str]:
    contact, operators = model.system.contact, model.system.operators
    depth = contact.depth(contact.interface.trace(state.u[VALUE], operators), state.time)
    largest = max(_largest(depth), _largest(contact.initial_gap))
    if not _largest(state.depth - depth) <= CARRIED * largest:
        yield "the depth of the contact points is not that of u"
    if state.plastic_set is not None and not np.all(state.plastic_set >= 0.0):
        yield "a plastic set is negative"
    if state.slides is not None and not np.all((state.slides == 0.0) | (state.slides == 1.0)):
        yield "points neither stick nor slide"
    closed = state.closed_since
    if closed is not None and not np.all((closed <= state.time) & (closed >= 0.0) | (closed == inf)):
        yield "faces closed at times that are none"


def _of_modes(paused: Paused, model: Model) -> Iterator[str]:
    state, operators = paused.state, model.system.operators
    modal = modal_system(model.system) if paused.modal and isinstance(operators, DenseOperators) else None
    if modal is None or paused.modal is None:
        return
    q, v, a, depth, pressure, touched, rubbed = paused.modal[:7]
    pairs = [(modal.dofs(q), state.u[VALUE]), (modal.dofs(v), state.v[VALUE]), (depth, state.depth)]
    pairs.append((pressure, state.pressure))
    if state.a is not None:
        pairs.append((modal.dofs(a), state.a[VALUE]))
    if state.touch_speed is not None:
        pairs.append((touched, state.touch_speed))
    if state.traction is not None:
        pairs.append((rubbed[:, : rubbed.shape[1] // 2], state.traction))
    for one, other in pairs:
        if not _largest(one - other) <= SAME * max(_largest(other), _largest(one)):
            yield "the state of the compiled loop is another one"
            return


def _of_ledger(state: State, header: dict[str, Any], model: Model) -> Iterator[str]:
    law = model.law.touched_at(state.touch_speed)
    now, words = open_ledger(model.system, law, state), header["accounts"].get("ledger")
    if not isinstance(words, dict):
        yield "its energies are missing"
        return
    scale = MEASURED * (now.kinetic + abs(now.strain) + now.contact) + now.round_off
    for name in ("kinetic", "strain", "contact"):
        value = words.get(name)
        if not isinstance(value, float) or not abs(value - getattr(now, name)) <= scale:
            yield f"its {name} energy is {value!r} J, expected {getattr(now, name):g} J"


def _largest(x: Array) -> float:
    return float(np.max(np.abs(x), initial=0.0))


NODES, POINTS = "nodes", "points"


@dataclass(frozen=True)
class DofLayout:
    """Layout of the DOFs of a model on the ranks.

    Attributes:
        model: The model.
        comm: Its ranks.
        nodes: Coordinates of the nodes of this rank, (n, 3), m.
        rows: Numbers of these rows among all nodes, rank by rank.
        basis: Checksum of the matrices of a model of few DOFs; empty where DOFs are at the nodes of a mesh.
        modes: Checksum of the modal coordinates of compiled loops; empty where there are none.
    """

    model: Model
    comm: MPI.Comm
    nodes: Array
    rows: RankRows
    basis: str
    modes: str

    @property
    def spread_out(self) -> bool:
        """True where every rank has DOFs of its own."""
        return self.model.body.expansion is None

    @property
    def places(self) -> Array:
        """Contact points with a coordinate more that distinguishes the faces, (m, 4), m."""
        contact = self.model.system.contact
        return np.column_stack([contact.positions, self.model.length * contact.faces])

    @property
    def node_table(self) -> ParallelTable:
        """The coordinates of all nodes, (N, 3), m."""
        return ParallelTable(self.rows, self.nodes)

    def table(self, x: Array) -> ParallelTable:
        """Return rows (..., n) of vectors on the DOFs of this rank as a table (..., N, components)."""
        return ParallelTable(self.rows, x.reshape(*x.shape[:-1], -1, self.components), layered=x.ndim > 1)

    def found_in(self, contents: Contents | None) -> RankRows:
        """Return the places of this rank's nodes in a checkpoint, which is there on rank 0.

        Raises:
            ValueError: The places differ.

        Collective.
        """

        def pieces() -> Iterator[Array]:
            assert contents is not None  # on rank 0
            if contents.shapes[NODES][1:] != self.nodes.shape[1:]:
                raise ValueError(f"nodes of the shape {contents.shapes[NODES]}")
            return contents.pieces(NODES)

        return found_rows(self.comm, self.nodes, pieces)

    def points_in(self, contents: Contents) -> Indices:
        """Return the contact points of a checkpoint that match those here; on rank 0.

        Raises:
            ValueError: The places differ.
        """
        return matching(contents.array(POINTS), self.places)

    @property
    def components(self) -> int:
        """Components of the displacement."""
        return int(self.model.space.dofmap.index_map_bs)


def layout_of(model: Model, comm: MPI.Comm) -> DofLayout:
    """Return the layout of the DOFs of a model. Collective."""
    space = model.space
    owned = space.dofmap.index_map.size_local
    nodes = np.ascontiguousarray(space.tabulate_dof_coordinates()[:owned])
    basis = "" if model.body.expansion is None else sum_of(matrices_of(model.body))
    modal = modal_system(model.system) if isinstance(model.system.operators, DenseOperators) else None
    modes = "" if modal is None else sum_of({"shapes": modal.shapes})
    return DofLayout(model, comm, nodes, rank_by_rank(comm, owned), comm.bcast(basis), comm.bcast(modes))


AT_NODES = ("u", "v", "a", "lagged")
AT_POINTS = ("depth", "pressure", "touch_speed", "traction", "plastic_set", "slip", "slides")
OF_FACES = "closed_since"
MODAL = "modal_"  # before the names of arrays

Stored = dict[str, NDArray[Any]]


def stored(paused: Paused, layout: DofLayout) -> dict[str, NDArray[Any] | ParallelTable]:
    """Return the arrays of a march that was left, images with them; tables where they lie on all ranks. Collective."""
    state = paused.state
    arrays: dict[str, NDArray[Any] | ParallelTable] = {NODES: layout.node_table, POINTS: layout.places}
    for name in AT_NODES:
        x = getattr(state, name)
        if x is not None:
            arrays[name] = layout.table(x) if layout.spread_out else x
    for name in (*AT_POINTS, OF_FACES):
        if getattr(state, name) is not None:
            arrays[name] = getattr(state, name)
    for number, array in enumerate(paused.modal or ()):
        arrays[f"{MODAL}{number}"] = array
    return arrays


def restored(contents: Contents | None, header: dict[str, Any], layout: DofLayout) -> tuple[Paused, bool]:
    """Return a march as it was left, and whether it is so to the last bit.

    Args:
        contents: The checkpoint, of the same matrices where they are few; on rank 0.
        header: Its header.
        layout: Present layout of the DOFs.

    Raises:
        BrokenCheckpoint: The arrays are not those of such a model.

    Collective.
    """
    try:
        return _restored(contents, header, layout)
    except (KeyError, ValueError, IndexError, TypeError) as error:  # the same on all ranks
        raise BrokenCheckpoint(f"its arrays do not fit the model: {error}") from error


def _restored(contents: Contents | None, header: dict[str, Any], layout: DofLayout) -> tuple[Paused, bool]:
    comm = layout.comm
    rows = layout.found_in(contents)
    spread_out = set(AT_NODES) if layout.spread_out else set()

    def look() -> tuple[Stored, dict[str, tuple[int, ...]], bool]:
        assert contents is not None
        points = layout.points_in(contents)
        shapes = contents.shapes
        small = {name: contents.array(name) for name in shapes.keys() - spread_out - {NODES, POINTS}}
        for name in (one for one in AT_POINTS if one in small):
            if small[name].shape[:1] != (len(points),):
                raise ValueError(f"{name} has the shape {small[name].shape}, expected {len(points)} places")
            small[name] = small[name][points]
        large = {name: shapes[name] for name in AT_NODES if name in spread_out & shapes.keys()}
        _check(small, large, layout)
        return small, large, np.array_equal(points, np.arange(len(points)))

    small, large, same_order = on_rank_zero(comm, look)
    same_order = (rows.in_order or not layout.spread_out) and same_order
    found = {name: small.get(name) for name in (*AT_NODES, *AT_POINTS, OF_FACES)}
    for name, shape in large.items():
        layered = len(shape) == 3
        x = taken(rows, shape, partial(_pieces, contents, name, layered), layered)
        found[name] = x.reshape(*x.shape[:-2], -1)
    state = State(time=float(header["time"]), **found)  # type: ignore[arg-type]
    same_modes = same_order and header.get("modes") == layout.modes
    modal = _modal(small)
    paused = Paused(state, int(header["done"]), int(header["since"]), modal if modal and same_modes else None)
    return paused, same_modes and (header.get("ranks") == comm.size or not layout.spread_out)


def _pieces(contents: Contents | None, name: str, layered: bool) -> Iterator[NDArray[Any]]:
    assert contents is not None  # on rank 0
    return contents.pieces(name, layered)


def _modal(small: Stored) -> tuple[NDArray[Any], ...]:
    return tuple(small[f"{MODAL}{number}"] for number in range(sum(name.startswith(MODAL) for name in small)))


def _check(small: Stored, large: dict[str, tuple[int, ...]], layout: DofLayout) -> None:
    """Refuse arrays, and shapes of tables, that are not those of the model; rank 0."""
    for name, array in small.items():
        if array.dtype != np.float64 or (name not in OF_FACES and not np.all(np.isfinite(array))):
            raise ValueError(f"{name} holds other things than finite numbers")
    size, points = layout.model.system.operators.size, layout.model.system.contact.size
    for name in ("u", "v", "depth", "pressure"):
        if name not in small and name not in large:
            raise ValueError(f"{name} is missing")
    modal = _modal(small)
    if modal and (wrong := misfit(modal, size, points, memory_of_friction(layout.model.system.contact))):
        raise ValueError(wrong)
    nodes, components = layout.rows.count, layout.components
    shapes: dict[str, tuple[int, ...]] = dict.fromkeys(AT_NODES, (3, size)) | {"lagged": (size,)}
    if layout.spread_out:
        shapes = dict.fromkeys(AT_NODES, (3, nodes, components)) | {"lagged": (nodes, components)}
    shapes |= dict.fromkeys(AT_POINTS, (points,))
    contact = layout.model.system.contact
    along = (points, 0 if contact.rubbed is None else contact.rubbed.shape[0] // points)
    shapes |= {"traction": along, "slip": along}
    shapes[OF_FACES] = (len(contact.face_names),)
    for name, shape in ({name: array.shape for name, array in small.items()} | large).items():
        if name in shapes and shape != shapes[name]:
            raise ValueError(f"{name} has the shape {shape}, expected {shapes[name]}")
