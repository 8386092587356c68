"""Comparison of the modes of a case with beam theory, and the end springs that reproduce them or measured ones.

Modes are matched by shape: by the modal assurance criterion between the sections of a body and a beam of the theory,

    MAC = (x . y)^2 / ((x . x) (y . y)),    x . y = sum_slices m x y

from the springs to the tip: of a beam that begins at the edge of the base, only the overhang.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from rich.table import Table
from scipy.optimize import linear_sum_assignment

from gapbeam.meshes.tagged_mesh import Section
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam
from gapbeam.solver.seat.contact_modes import CLOSED, FREE, MIXED, SEATED, HeldModes
from gapbeam.solver.supports.support_tables import BaseAndGland
from gapbeam.solver.system.operators import Array
from gapbeam.studies.modes.beam_theory import SpringBeam
from gapbeam.studies.modes.end_springs import EndSpringFit, Estimate, identify_end_springs

ALIKE = 0.5  # the least MAC of a pair


@dataclass(frozen=True)
class TheoryMode:
    """One mode of a beam of the theory, and the mode of the body that looks like it.

    Attributes:
        mode: n.
        root: lambda_n.
        frequency: f_n, Hz.
        matched: Number of that mode among the bending modes of the body, from 1; None: none looks like it.
        mac: Their MAC; 0 without one.
    """

    mode: int
    root: float
    frequency: float
    matched: int | None
    mac: float


def matched_modes(
    body: HeldModes, beam: SpringBeam, springs: tuple[float, float], count: int
) -> tuple[TheoryMode, ...]:
    """Return the first modes of a beam, each with the bending mode of a body that looks most like it.

    Args:
        body: Modes of a body.
        beam: Theory; its free end is the tip of the body, where its springs are follows from its length.
        springs: k1, N/m, and k2, N m/rad, in [0, inf].
        count: Number of modes.
    """
    numbers = np.arange(1, count + 1)
    found = beam.roots(numbers, *springs)
    frequencies, motions = body.bending()
    tip = float(body.length)
    xi = np.asarray((body.places - (tip - beam.length)) / beam.length, dtype=np.float64)
    beyond = xi >= 0.0
    table = np.zeros((count, len(frequencies)))
    for row, mode in enumerate(numbers):
        shape = beam.shape(int(mode), *springs)(xi[beyond])
        table[row] = [assurance(shape, motion[beyond], body.masses[beyond]) for motion in motions]
    rows, columns = linear_sum_assignment(-table)
    pairs = {int(row): int(column) for row, column in zip(rows, columns, strict=True) if table[row, column] >= ALIKE}
    return tuple(
        TheoryMode(
            mode=int(mode),
            root=float(found[row]),
            frequency=float(beam.frequency_unit * found[row] ** 2),
            matched=pairs[row] + 1 if row in pairs else None,
            mac=float(table[row, pairs[row]]) if row in pairs else 0.0,
        )
        for row, mode in enumerate(numbers)
    )


def assurance(x: Array, y: Array, masses: Array) -> float:
    """Return the modal assurance criterion of two shapes, (slices,), 0 to 1."""
    return float((masses @ (x * y)) ** 2 / ((masses @ x**2) * (masses @ y**2)))


FITTED = 3  # modes of the body that springs are fitted to: those of the paper
UNKNOWNS = 2  # k1, k2; the length is a third
OVERHANG, WHOLE, BETWEEN = "overhang", "whole", "fitted"


@dataclass(frozen=True)
class SpringFit:
    """Springs fitted with one choice of the length.

    Attributes:
        source: "seated" or "measured": whose frequencies were fitted.
        choice: "overhang", "whole" or "fitted": what the length is.
        fit: The springs.
        modes: Modes of that beam, matched with those of the seated body.
    """

    source: str
    choice: str
    fit: EndSpringFit
    modes: tuple[TheoryMode, ...]


@dataclass(frozen=True)
class ModesComparison:
    """Everything that `gapbeam modes` reports.

    Attributes:
        count: Number of bending modes.
        states: The body seated, free and closed.
        clamped: Modes of the overhang clamped at the edge of the base, matched with the seated body; with [[support]]
            there are none.
        free: Modes of the whole beam without springs, matched with the free body.
        fits: Springs for the seated body's frequencies and for those measured, a choice of the length each.
        measured: Measured frequencies by mode, Hz.
        burdened: Whether masses or springs of loads move along with the body, which the theory leaves out.
    """

    count: int
    states: Mapping[str, HeldModes]
    clamped: tuple[TheoryMode, ...]
    free: tuple[TheoryMode, ...]
    fits: tuple[SpringFit, ...]
    measured: Mapping[int, float]
    burdened: bool = False

    def best(self, source: str) -> SpringFit | None:
        """Return the fit with a given length that reproduces a source best; None where there was nothing to fit."""
        given = [one for one in self.fits if one.source == source and one.choice != BETWEEN]
        return min(given, key=lambda one: one.fit.misfit, default=None)


def beams_of(case: Case, section: Section | None = None) -> dict[str, SpringBeam]:
    """Return the beams of the theory: the overhang, from the edge of the base to the tip, and the whole beam.

    Args:
        case: The case.
        section: Section of its mesh; None: the section of the case.
    """
    beam = TimoshenkoBeam.of_piece(case, case.profile.pieces[0], case.beam.length, 1)
    if section is not None:
        share = section.second_moment / case.beam.second_moment
        beam = replace(beam, bending=share * beam.bending, mass=section.area / case.beam.area * beam.mass)
    held = isinstance(case.support, BaseAndGland)
    lengths = ({OVERHANG: case.beam.length - case.layout.end} if held else {}) | {WHOLE: case.beam.length}
    return {name: SpringBeam(length, beam.bending, beam.mass) for name, length in lengths.items()}


def compare_modes(
    case: Case,
    states: tuple[HeldModes, HeldModes, HeldModes],
    count: int,
    measured: Mapping[int, float],
    accuracy: float,
    section: Section | None = None,
) -> ModesComparison:
    """Match the modes of a body with those of the theory and identify end springs; on one rank.

    Args:
        case: Its case.
        states: The body seated, free and closed, with at least `FITTED` bending modes each.
        count: Number of compared bending modes.
        measured: Measured frequencies by mode, Hz; empty: none.
        accuracy: Standard deviation of a frequency, relative.
        section: Section of a mesh file; None: the section of the case.
    """
    beams = beams_of(case, section)
    seated, free, closed = states
    fits = []
    held = bool(case.joint) or not case.profile.prismatic  # the theory has neither joints nor steps
    overhang = isinstance(case.support, BaseAndGland) and not held
    if overhang and seated.closed > 0:
        frequencies = seated.bending()[0][:FITTED]
        own = {mode: float(frequency) for mode, frequency in enumerate(frequencies, start=1)}
        fits += _fits(SEATED, own, beams, seated, count, accuracy)
    if overhang and measured:
        fits += _fits("measured", measured, beams, seated, count, accuracy)
    return ModesComparison(
        count=count,
        states={SEATED: seated, FREE: free, CLOSED: closed},
        clamped=matched_modes(seated, beams[OVERHANG], (np.inf, np.inf), count) if overhang else (),
        free=() if held else matched_modes(free, beams[WHOLE], (0.0, 0.0), count),
        fits=tuple(fits),
        measured=measured,
        burdened=bool(moving_along(case)),
    )


def moving_along(case: Case) -> list[str]:
    """Return the names of loads, masses and fluids that move along with the body, which the theory leaves out."""
    added = [(load.name, load.attachment) for load in case.load]
    return [name for name, one in added if one is not None and one.mass + one.stiffness > 0.0] + [
        one.name for one in (*case.mass, *case.fluid)
    ]


def _fits(
    source: str,
    frequencies: Mapping[int, float],
    beams: Mapping[str, SpringBeam],
    seated: HeldModes,
    count: int,
    accuracy: float,
) -> list[SpringFit]:
    if len(frequencies) < UNKNOWNS:
        return []
    choices: dict[str, tuple[SpringBeam, tuple[float, float] | None]] = {
        name: (beam, None) for name, beam in beams.items()
    }
    if len(frequencies) > UNKNOWNS:
        choices[BETWEEN] = beams[OVERHANG], (beams[OVERHANG].length, beams[WHOLE].length)
    found = []
    for choice, (beam, lengths) in choices.items():
        fit = identify_end_springs(beam, tuple(frequencies), tuple(frequencies.values()), lengths, accuracy)
        found.append(SpringFit(source, choice, fit, matched_modes(seated, fit.beam, fit.springs, count)))
    return found


SHOWN = 12  # other modes that are named
FAR = 0.05  # of the frequency of a free beam
EXACT = 1.0e-9  # below it a misfit is round-off
WORDS = {
    "identified": "identified",
    "at least": "stiffer does as well",
    "at most": "softer does as well",
    "not identifiable": "not identifiable",
}


def frequency_table(found: ModesComparison) -> Table:
    """Return the frequencies of the body and of the theory, a bending mode a row."""
    table = Table("n", title="Bending modes, Hz (in brackets: MAC)", title_justify="left", box=None, pad_edge=False)
    columns: list[tuple[str, list[str]]] = [
        (f"{name} model", _numbers(state, found.count)) for name, state in found.states.items() if name != FREE
    ]
    best = found.best(SEATED)
    if found.clamped:
        columns.append(("clamped overhang", _theory(found.clamped)))
    if best is not None:
        columns.append((f"on springs, l = {best.fit.beam.length:.4g} m", _theory(best.modes)))
    if found.measured:
        columns.append(("measured", [_hertz(found.measured.get(mode)) for mode in range(1, found.count + 1)]))
        measured = found.best("measured")
        if measured is not None:
            columns.append((f"on its springs, l = {measured.fit.beam.length:.4g} m", _theory(measured.modes)))
    columns.append(("free model", _numbers(found.states[FREE], found.count)))
    if found.free:
        columns.append(("free beam", _theory(found.free)))
    for heading, _ in columns:
        table.add_column(heading, justify="right")
    for row in range(found.count):
        table.add_row(str(row + 1), *(cells[row] for _, cells in columns))
    return table


def spring_table(fits: Sequence[SpringFit]) -> Table:
    """Return the springs that were identified, with their intervals of 95 % and their misfits."""
    table = Table(
        "frequencies of", "l, m", "k1, N/m", "k2, N m/rad", "misfit", "k1", "k2",
        title="End springs that reproduce them (95 %)", title_justify="left", box=None, pad_edge=False,
    )  # fmt: skip
    for one in fits:
        fit = one.fit
        length = f"{fit.beam.length:.4g} ({one.choice})" if fit.length is None else _with_interval(fit.length)
        misfit = f"{100.0 * fit.misfit:.2g} %" if fit.misfit > EXACT else "0 %"
        if fit.reproduces:
            cells = [*map(_with_interval, (fit.draught, fit.torsion)), misfit]
            table.add_row(one.source, length, *cells, WORDS[fit.draught.verdict], WORDS[fit.torsion.verdict])
        else:
            table.add_row(one.source, length, "none", "none", f"{misfit}: does not reproduce them", "", "")
    return table


def other_modes(state: HeldModes) -> str:
    """Return the modes that are not bending, in one line."""
    others = [
        f"{motion.kind} {frequency:.4g}"
        for frequency, motion in zip(state.frequencies, state.motions, strict=True)
        if motion.kind not in ("bending", MIXED)
    ]
    more = f" and {len(others) - SHOWN} more" if len(others) > SHOWN else ""
    return f"other modes, {state.name}, Hz: " + (", ".join(others[:SHOWN]) or "none found") + more


def remarks(found: ModesComparison) -> list[str]:
    """Return the remarks beyond the tables."""
    seated = found.states[SEATED]
    words = [f"seated on {seated.closed} of {seated.points} contact points"]
    if seated.closed == 0:
        words.append("nothing presses the beam on its support: seated is free of contact")
    words += _far_from_theory(found)
    unmatched = [str(one.mode) for one in found.clamped if one.matched is None]
    if unmatched:
        words.append(f"no mode of the seated model looks like the clamped overhang's {', '.join(unmatched)}")
    for one in found.fits:
        for draught, torsion in one.fit.others:
            words.append(
                f"{one.source}, l = {one.fit.beam.length:.4g} m: k1 = {draught:.4g} N/m with "
                f"k2 = {torsion:.4g} N m/rad does as well; another mode would decide"
            )
    return words


def _far_from_theory(found: ModesComparison) -> list[str]:
    """Return a warning where the first elastic mode of the free model is not that of a beam.

    None where masses or springs of loads move along: their frequencies are not those of the beam alone.
    """
    theory = next((one for one in found.free if one.frequency > 0.0), None)
    if theory is None or theory.matched is None:
        return []
    frequency = float(found.states[FREE].bending()[0][theory.matched - 1])
    off = frequency / theory.frequency - 1.0
    if abs(off) <= FAR or found.burdened:
        return []
    why = "the mesh is too coarse or locks" if off > 0.0 else "the beam is not slender"
    return [f"warning: free, the model has {frequency:.4g} Hz, {100.0 * off:+.0f} % from the theory's: {why}"]


def as_data(found: ModesComparison) -> dict[str, Any]:
    """Return everything as `modes.json` holds it, in SI units."""
    return {
        "count": found.count,
        "states": [_state(state) for state in found.states.values()],
        "clamped": [asdict(one) for one in found.clamped],
        "free": [asdict(one) for one in found.free],
        "measured": {str(mode): frequency for mode, frequency in found.measured.items()},
        "springs": [_fit(one) for one in found.fits],
        "remarks": remarks(found),
    }


def _state(state: HeldModes) -> dict[str, Any]:
    return {
        "name": state.name,
        "closed": state.closed,
        "contact_points": state.points,
        "x": state.places.tolist(),
        "modes": [
            {"frequency": float(frequency), "kind": motion.kind, "share": motion.share}
            | ({"motion": _unit(motion.bending).tolist()} if motion.kind == "bending" else {})
            for frequency, motion in zip(state.frequencies, state.motions, strict=True)
        ],
    }


def _fit(one: SpringFit) -> dict[str, Any]:
    fit = one.fit
    length = fit.length or Estimate(fit.beam.length, fit.beam.length, fit.beam.length, "m")
    named = {"length": length, "k1": fit.draught, "k2": fit.torsion}
    return {
        "source": one.source,
        "length_is": one.choice,
        **{name: asdict(estimate) | {"verdict": estimate.verdict} for name, estimate in named.items()},
        "fitted": {str(mode): float(frequency) for mode, frequency in zip(fit.modes, fit.given, strict=True)},
        "misfit": fit.misfit,
        "accuracy": fit.accuracy,
        "reproduces": fit.reproduces,
        "others": [list(springs) for springs in fit.others],
        "modes": [asdict(mode) for mode in one.modes],
    }


def _unit(motion: np.ndarray) -> np.ndarray:
    return np.asarray(motion / motion[np.argmax(np.abs(motion))])


def _numbers(state: HeldModes, count: int) -> list[str]:
    frequencies, _ = state.bending()
    return [_hertz(float(frequency)) for frequency in frequencies[:count]]


def _theory(modes: Sequence[TheoryMode]) -> list[str]:
    return [
        f"{_hertz(one.frequency)} ({one.mac:.3f})" if one.matched else f"{_hertz(one.frequency)} (-)" for one in modes
    ]


def _hertz(frequency: float | None) -> str:
    return "" if frequency is None else f"{frequency:.2f}"


def _with_interval(one: Estimate) -> str:
    if one.verdict == "at least":
        return f"> {one.low:.3g}"
    if one.verdict == "at most":
        return f"< {one.high:.3g}"
    if one.verdict == "not identifiable":
        return "any"
    return f"{one.value:.4g} ({one.low:.3g} to {one.high:.3g})"
