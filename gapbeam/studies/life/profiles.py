"""Worn profiles: wear of the faces from a march of contact points, and the depth at each point."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gapbeam.solver.run.output.wear_file import angles
from gapbeam.solver.system.semi_discrete import ContactOperator
from gapbeam.studies.life.worn_march import Array, DepthRates, Worn, WornState

PROFILES_FILE = "profiles.csv"
HEADS = ("face", "x (m)", "y (m)", "angle (deg)", "area (m^2)")


@dataclass(frozen=True)
class Profiles:
    """The depths of all contact points over a life.

    Attributes:
        contact: Their places and faces.
        states: Of the march, with depths of points.
    """

    contact: ContactOperator
    states: Sequence[WornState]

    def as_csv(self) -> str:
        """Return a line a point: where it is, and its depth at the end of each block."""
        text, contact = io.StringIO(), self.contact
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*HEADS, *(f"depth at {state.time!r} s (m)" for state in self.states)])
        places = np.column_stack([contact.positions[:, :2], angles(contact), contact.weights])
        depths = np.column_stack([state.depths for state in self.states])
        for face, place, depth in zip(contact.faces, places, depths, strict=True):
            writer.writerow([contact.face_names[face], *map(float, place), *map(float, depth)])
        return text.getvalue()

    def as_data(self) -> dict[str, Any]:
        """Return the last depths by face, with places, as plain data."""
        contact, turned, last = self.contact, angles(self.contact), self.states[-1]
        return {
            name: {
                "x": contact.positions[mine, 0].tolist(),
                "angle": turned[mine].tolist(),
                "depth": last.depths[mine].tolist(),
            }
            for number, name in enumerate(contact.face_names)
            for mine in [contact.faces == number]
        }


def of_faces(worn: Worn, owners: Array) -> Worn:
    """Return a march of points as one of faces, each as its deepest point; of points as deep, that which wears fastest.

    Args:
        worn: Of points.
        owners: Index of the face of each point, (m,).
    """
    first = None if worn.first is None else int(owners[worn.first])
    return replace(worn, states=tuple(_deepest(state, owners) for state in worn.states), first=first)


def _deepest(state: WornState, owners: Array) -> WornState:
    order = np.lexsort((state.rates.values, state.depths))
    chosen = np.array([order[owners[order] == face][-1] for face in range(int(owners.max()) + 1)])
    rates = state.rates
    found = DepthRates(
        rates.values[chosen], rates.low[chosen], rates.high[chosen], tuple(rates.verdicts[point] for point in chosen)
    )
    return WornState(state.time, state.depths[chosen], found, state.errors[chosen])
