"""Size and error of a reduced basis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

MODES_ABOVE = 3.0  # times the highest frequency of interest
NOTABLE_SMOOTH = 1.0e-3  # of the flexibility, for pressures that vary over half a shape
NOTABLE_SECTIONS = 1.0e-2  # of the flexibility, for pressures on half of a section that is rigid


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
        neglected_smooth: The same for pressures that vary over half a shape; for rigid sections, that press on half of
            the circumference.
        modes_left: Error of the mode shapes in the energy norm, where round-off left more than was asked for; else 0.
        section_flexibility: By how much a section deforms under a force of 1 N on half of its circumference, which
            rigid sections leave out, m/N; None: sections deform.
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
    modes_left: float = 0.0
    section_flexibility: float | None = None


def basis_remarks(basis: BasisReport | None, frequency: float) -> Iterator[str]:
    """Yield the remarks on a basis before its use, one sentence each.

    Args:
        basis: The basis; None: there is none.
        frequency: Highest frequency of interest, Hz.
    """
    if basis is None:
        return
    if basis.highest_mode < MODES_ABOVE * frequency:
        yield (
            f"the modes of the basis reach to {basis.highest_mode:.4g} Hz, the frequencies of interest to "
            f"{frequency:.4g} Hz: try more modes in [model], up to {MODES_ABOVE:g} times that"
        )
    if basis.section_flexibility is not None:
        if basis.neglected_smooth > NOTABLE_SECTIONS:
            yield (
                f"rigid sections leave out {100 * basis.neglected_smooth:.2g} % of the static flexibility of the beam "
                f"under a pressure on half of a section ({basis.section_flexibility:.2g} m/N): "
                'sections = "deformable" in [model] keeps it'
            )
    elif basis.neglected_smooth > NOTABLE_SMOOTH:
        yield (
            f"the basis misses {100 * basis.neglected_smooth:.2g} % of the contact faces' static flexibility even "
            'where the pressure is smooth: try more modes and shapes in [model], or contact = "all"'
        )
    if basis.modes_left > 0.0:
        yield (
            f"round-off left errors of {basis.modes_left:.1e} in the mode shapes of the basis (in the energy norm; "
            'their frequencies are off by its square): solver.effective = "factor" finds them to round-off'
        )
