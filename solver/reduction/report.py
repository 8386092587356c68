"""What a reduced basis holds, and what it neglects."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BasisReport:
    """A reduced basis in figures.

    Attributes:
        modes: Vibration modes in it, rigid ones included.
        highest_mode: The highest of their frequencies, Hz; 0 without modes.
        contact_shapes: Shapes that contact forces gave it.
        load_shapes: Shapes that loads gave it.
        size: DOFs that are marched.
        left_out: Modes that neither loads nor symmetric contact can move, and that are not marched.
        highest: Highest frequency of the reduced model, Hz.
        neglected: Share of the static flexibility of the contact faces that is neglected, for pressures that vary from
            point to point.
        neglected_smooth: The same for pressures that vary over half a shape.
    """

    modes: int
    highest_mode: float
    contact_shapes: int
    load_shapes: int
    size: int
    left_out: int
    highest: float
    neglected: float
    neglected_smooth: float
