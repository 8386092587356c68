"""The state of a march as arrays that any number of ranks can read."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshes.rank_zero import on_rank_zero
from solver.analyses.paused import Paused
from solver.checkpoint.files import BrokenCheckpoint, Contents
from solver.checkpoint.layout import NODES, POINTS, Layout
from solver.compiled.carried import misfit
from solver.system import VALUE, State, imaged

AT_NODES = ("u", "v", "a", "lagged")
AT_POINTS = ("depth", "pressure", "touch_speed", "traction")
OF_FACES = "closed_since"
MODAL, OF_MESH = "modal_", "mesh_"  # before the names of arrays

Stored = dict[str, NDArray[Any]]


def stored(paused: Paused, layout: Layout) -> Stored:
    """Return the arrays of a march that was left, on rank 0; images with them. Collective."""
    state, model = paused.state, layout.model
    arrays: Stored = {NODES: layout.nodes, POINTS: layout.places}
    for name in AT_NODES:
        x = getattr(state, name)
        if x is None:
            continue
        arrays[name] = layout.gathered(x) if layout.spread_out else x
        if layout.basis and x.ndim > 1:
            arrays[OF_MESH + name] = layout.gathered(model.expand(x[VALUE]))
    for name in (*AT_POINTS, OF_FACES):
        if getattr(state, name) is not None:
            arrays[name] = getattr(state, name)
    for number, array in enumerate(paused.modal or ()):
        arrays[f"{MODAL}{number}"] = array
    return arrays


def restored(contents: Contents, layout: Layout) -> tuple[Paused, bool]:
    """Return a march as it was left, and whether it is so to the last bit.

    Args:
        contents: The checkpoint; its arrays matter on rank 0 only.
        layout: Where the DOFs are now.

    Raises:
        BrokenCheckpoint: The arrays are not those of such a model.

    Collective.
    """
    header, comm = contents.header, layout.comm
    same_basis = header.get("basis") == layout.basis
    spread_out = set(AT_NODES) if layout.spread_out else {OF_MESH + name for name in AT_NODES}
    large: Stored = {}  # on rank 0

    def put_in_order() -> tuple[Stored, list[str], bool]:
        arrays = contents.arrays
        try:
            nodes, points = layout.matched(arrays)
            large.update({name: np.take(arrays[name], nodes, axis=-2) for name in spread_out & arrays.keys()})
            small = {name: array for name, array in arrays.items() if name not in spread_out | {NODES, POINTS}}
            small |= {name: small[name][points] for name in AT_POINTS if name in small}
            _check(small, large, layout)
        except (KeyError, ValueError, IndexError, TypeError) as error:
            raise BrokenCheckpoint(f"its arrays do not fit the model: {error}") from error
        same = all(np.array_equal(order, np.arange(len(order))) for order in (nodes, points))
        return small, [name for name in AT_NODES if name in arrays], same

    small, names, same_order = on_rank_zero(comm, put_in_order)
    found = {name: small.get(name) for name in (*AT_POINTS, OF_FACES)}
    for name in names:
        if layout.spread_out:
            found[name] = layout.scattered(large.get(name, np.zeros(0)))
        elif same_basis:
            found[name] = small[name]
        else:
            moved = layout.scattered(large.get(OF_MESH + name, np.zeros(0)))
            found[name] = imaged(layout.model.system.operators, layout.coordinates(moved))
    state = State(time=float(header["time"]), **found)  # type: ignore[arg-type]
    same_modes = same_order and same_basis and header.get("modes") == layout.modes
    modal = _modal(small)
    paused = Paused(state, int(header["done"]), int(header["since"]), modal if modal and same_modes else None)
    return paused, same_modes and header.get("ranks") == comm.size


def _modal(small: Stored) -> tuple[NDArray[Any], ...]:
    return tuple(small[f"{MODAL}{number}"] for number in range(sum(name.startswith(MODAL) for name in small)))


def _check(small: Stored, large: Stored, layout: Layout) -> None:
    """Refuse arrays that are not those of the model; rank 0."""
    for name, array in (small | large).items():
        if array.dtype != np.float64 or (name not in OF_FACES and not np.all(np.isfinite(array))):
            raise ValueError(f"{name} holds other things than finite numbers")
    size, points = layout.model.system.operators.size, layout.model.system.contact.size
    for name in ("u", "v", "depth", "pressure"):
        if name not in small and name not in large:
            raise ValueError(f"{name} is missing")
    modal = _modal(small)
    if modal and (wrong := misfit(modal, size, points)):
        raise ValueError(wrong)
    for name in AT_NODES:
        if name in small and small[name].shape != (3, size):
            raise ValueError(f"{name} has the shape {small[name].shape}, expected {(3, size)}")
    for name in AT_POINTS:
        if name in small and small[name].shape[0] != points:
            raise ValueError(f"{name} has {small[name].shape[0]} points, expected {points}")
