"""Section 2 of the paper: the beam on end springs, its roots, Figs. 4 to 6, and what is not as printed."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Compared,
    ComparisonBlock,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve, Surface
from gapbeam.solver.beam_theory.spring_beam import SpringBeam
from gapbeam.solver.system.operators import Array
from gapbeam.studies.paper.plateaus import Plateau, printed_plateaus
from gapbeam.studies.paper.printed_figures import printed
from gapbeam.studies.paper.seated_beam import seated_blocks

COMMAND = "environment/run gapbeam paper"
GRID_COMMAND = "environment/run python3 -m benchmarks.roots"
POINTS = 61
DRAUGHT, TORSION = (1e0, 1e10), (1e-1, 1e8)  # of the figures, N/m and N m/rad
SPRINGS = (("k1", "N/m"), ("k2", "N m/rad"))
SLICES = (0.0, 1e2, 1e3, 1e4, 1e5, np.inf)  # k2 of the curves, N m/rad
CLOSE, CLOSER = 0.01, 0.001  # of a plateau
SMALLEST, WITHIN = 0.3, 1e-9  # roots that double precision resolves in Eq. 9 as it is printed, and how well
HALF_UNIT = 0.5e-3  # of the last digit printed, and as much for how it was rounded


def section_two(folder: Path) -> ReportSection:
    """Compute section 2 of the paper: roots, plateaus, surfaces, errata, and the finite element model beside them.

    Args:
        folder: Where figures are kept as JSON; made if it is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    whole, overhang = paper_beams()
    blocks: list[Block] = [
        Words(
            "A beam of length l is held at x = 0 by a draught spring k1 and a torsion spring k2 and is free at x = "
            "l. With the roots λ of Eq. 9 its frequencies are λ² / (2π l²) √(E I / ρ A). Eq. 9 is right as printed: "
            "it is half of the determinant of Eq. 8. Here its n-th root is found between two neighbors that hold no "
            "other, for any k1 and k2 from 0 to infinity."
        ),
        _roots(overhang),
        _plateaus(whole),
        Verdict("warning", _errata(whole)),
        _thresholds(whole, overhang),
        *_figures(whole),
        *seated_blocks(folder),
    ]
    return ReportSection("Section 2: the beam on end springs", "section-2", tuple(blocks))


def paper_beams() -> tuple[SpringBeam, SpringBeam]:
    """Return the paper's beam with its whole length, 510 mm, and with its overhang, 460 mm."""
    beam = printed()["beam"]
    area = beam["width"] * beam["thickness"]
    bending, mass = beam["young_modulus"] * area * beam["thickness"] ** 2 / 12.0, beam["density"] * area
    lengths = beam["length"], beam["length"] - beam["support_length"]
    whole, overhang = (SpringBeam(length, bending, mass) for length in lengths)
    return whole, overhang


def _roots(beam: SpringBeam) -> ComparisonBlock:
    rows = []
    for name, springs, text in (("clamped_free", np.inf, "k1, k2 to infinity"), ("free_free", 0.0, "k1, k2 to 0")):
        for mode, value in enumerate(_numbered(name), start=1):
            if value is not None:
                rows.append(Compared(f"λ{mode}, {text}", value, float(beam.roots(mode, springs, springs))))
    return ComparisonBlock(
        "Roots of Eqs. 10 and 11",
        rows,
        notes=(
            "With k1 and k2 to 0 the beam has two rigid motions and two roots that are 0: what the paper calls the "
            "second and third root there are the third and fourth, and so they are in Figs. 5 and 6, which end in 0 "
            "and 4.730.",
        ),
        digits=6,
        command=COMMAND,
    )


def _numbered(name: str) -> Sequence[float | None]:
    """Return printed roots by the number they have when rigid motions are counted."""
    values = printed()["roots"][name]
    return [values[0], None, *values[1:]] if name == "free_free" else values


def _plateaus(beam: SpringBeam) -> ComparisonBlock:
    rows = []
    for plateau in printed_plateaus():
        value = plateau.value(beam)
        wrong = abs(value - plateau.printed) > 2.0 * HALF_UNIT
        note = (
            f"{plateau.name}; at {_springs(plateau)} and l = {beam.length:g} m it is {plateau.at_threshold(beam):.4g}"
        )
        rows.append(
            Compared(
                f"λ{plateau.mode}, {_region(plateau)}",
                plateau.printed,
                value,
                note=f"not as printed; {note}" if wrong else note,
            )
        )
    return ComparisonBlock("Plateaus that the paper reads off Figs. 4 to 6", rows, digits=5, command=COMMAND)


def _errata(beam: SpringBeam) -> str:
    pinned = [plateau for plateau in printed_plateaus() if plateau.name == "pinned"]
    words = ", ".join(
        f"λ{plateau.mode} = {plateau.value(beam):.5g} (printed {plateau.printed:g}, which is "
        f"{100.0 * (1.0 - plateau.printed / plateau.value(beam)):.0f} % less and "
        f"{100.0 * (1.0 - (plateau.printed / plateau.value(beam)) ** 2):.0f} % in frequency)"
        for plateau in pinned
    )
    sliding = float(beam.roots(3, 0.0, np.inf))
    second, third = (float(root) for root in beam.roots(np.array([3, 4]), 0.0, 0.0))
    return (
        f"**Not as printed.** With k1 large and k2 small the end is pinned: {words}. The paper gives it the roots of "
        "the sliding end, as if a stiff draught spring alone and a stiff torsion spring alone were the same. The "
        f"third root of the sliding end is {sliding:.6f}, which rounds to {sliding:.3f} and not to 5.497. With k1 "
        f"and k2 to 0, {second:.4g} and {third:.4g} are the third and fourth root: the first two are 0. (Beyond this "
        "section: Eq. 1 lacks the factor 1/4 of Eq. 2, and in Table 4 the columns of the highest and the lowest "
        "value are swapped.)"
    )


def _thresholds(whole: SpringBeam, overhang: SpringBeam) -> TableBlock:
    rows: list[tuple[Cell, ...]] = []
    for plateau in printed_plateaus():
        for beam in (whole, overhang):
            off = 100.0 * (plateau.at_threshold(beam) / plateau.value(beam) - 1.0)
            cells = [each for share in (CLOSE, CLOSER) for each in plateau.reached(beam, share)]
            rows.append((f"λ{plateau.mode}, {plateau.name}", beam.length, _springs(plateau), off, *cells))
    shares = [f"{100 * share:g} %" for share in (CLOSE, CLOSER)]
    return TableBlock(
        "From which springs on the plateaus are reached",
        (
            "root", "l (m)", "printed thresholds", "off the plateau there (%)",
            *(f"{name} within {share} ({unit})" for share in shares for name, unit in SPRINGS),
        ),
        rows,
        notes=(
            "Each spring with the other in its limit. With l = 0.51 m the printed thresholds are nearer to the "
            "plateaus than with 0.46 m: the figures were likely made with the whole length.",
        ),
        digits=2,
        command=COMMAND,
    )  # fmt: skip


def _figures(beam: SpringBeam) -> list[Block]:
    """Return Figs. 4 to 6 as surfaces, and curves through them."""
    started = time.perf_counter()
    draught, torsion = (np.asarray(np.geomspace(*ends, POINTS), dtype=np.float64) for ends in (DRAUGHT, TORSION))
    heights: Array = beam.roots(np.arange(1, 4)[:, None, None], draught, torsion[:, None])
    seconds = time.perf_counter() - started
    surfaces = [
        Surface(
            f"Fig. {3 + mode}: λ{mode} over k1 and k2, l = {beam.length:g} m",
            "k1 (N/m)", "k2 (N m/rad)", f"λ{mode}", draught, torsion, heights[mode - 1], COMMAND,
            log_x=True, log_y=True,
        )
        for mode in (1, 2, 3)
    ]  # fmt: skip
    curves = []
    for mode in (1, 2, 3):
        for spring in SLICES:
            name = f"k2 = {spring:g} N m/rad" if np.isfinite(spring) else "k2 infinite"
            curves.append(ChartCurve(name, draught, beam.roots(mode, draught, spring), choice=f"λ{mode}"))
    chart = Chart(
        f"Figs. 4 to 6 cut at some k2, with the limits 0 and infinity; {heights.size} roots of the surfaces took "
        f"{seconds:.1f} s",
        "k1 (N/m)", "λ", curves, COMMAND, log_x=True,
        choices=tuple(f"λ{mode}" for mode in (1, 2, 3)), choice="root",
    )  # fmt: skip
    return [*surfaces, chart, _checked(beam, heights, draught, torsion)]


def _checked(beam: SpringBeam, heights: Array, draught: Array, torsion: Array) -> Words:
    """Return how many roots of the surfaces Eq. 9, in its own words and plain double precision, agrees with."""
    wanted = heights > SMALLEST
    before, after = (
        _equation_nine(beam, side * heights, draught, torsion[:, None]) for side in (1 - WITHIN, 1 + WITHIN)
    )
    agreed = int(np.count_nonzero((before * after < 0.0) & wanted))
    return Words(
        f"Eq. 9 as printed changes its sign within {WITHIN:.0e} of {agreed} of the {np.count_nonzero(wanted)} roots "
        f"of these surfaces above {SMALLEST:g} (below, its terms cancel). That no root is missed, and that the roots "
        f"are right to round-off, is checked at 50 digits against the determinant of Eq. 8: `{GRID_COMMAND}`."
    )


def _equation_nine(beam: SpringBeam, root: Array, draught: Array, torsion: Array) -> Array:
    """Return the left side of Eq. 9, term by term as it is printed, for k1 and k2 above 0."""
    c, s, ch, sh = np.cos(root), np.sin(root), np.cosh(root), np.sinh(root)
    first = 1.0 + c * ch - beam.bending * root / (torsion * beam.length) * (s * ch - c * sh)
    inner = beam.bending * root / (torsion * beam.length) * (1.0 - c * ch) - (s * ch + c * sh)
    return np.asarray(first + beam.bending * root**3 / (draught * beam.length**3) * inner)


def _region(plateau: Plateau) -> str:
    signs = [">" if limit > 0.0 else "<" for limit in plateau.limits]
    return f"k1 {signs[0]} {_power(plateau.draught)} N/m, k2 {signs[1]} {_power(plateau.torsion)} N m/rad"


def _springs(plateau: Plateau) -> str:
    return f"k1 = {_power(plateau.draught)}, k2 = {_power(plateau.torsion)}"


def _power(spring: float) -> str:
    """Return a threshold as in the paper: one digit and a power of ten."""
    digit, exponent = f"{spring:.0e}".split("e")
    return f"{digit}e{int(exponent)}"
