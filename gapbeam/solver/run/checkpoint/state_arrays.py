"""The state of a march as arrays that any number of ranks can read."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.solver.march.compiled.carried_state import misfit
from gapbeam.solver.march.paused_march import Paused
from gapbeam.solver.run.checkpoint.checkpoint_files import BrokenCheckpoint, Contents
from gapbeam.solver.run.checkpoint.dof_layout import NODES, POINTS, DofLayout
from gapbeam.solver.run.output.parallel_tables import ParallelTable, taken
from gapbeam.solver.system.semi_discrete import State

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
        layout: Where the DOFs are now.

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
        _check_lengths(small, dict.fromkeys(AT_POINTS, len(points)))
        small |= {name: small[name][points] for name in AT_POINTS if name in small}
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


def _check_lengths(arrays: Stored, lengths: dict[str, int]) -> None:
    """Refuse arrays that are longer than the places that they are taken at."""
    for name, length in lengths.items():
        if name in arrays and arrays[name].shape[:1] != (length,):
            raise ValueError(f"{name} has the shape {arrays[name].shape}, expected {length} places")


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
    if modal and (wrong := misfit(modal, size, points)):
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
