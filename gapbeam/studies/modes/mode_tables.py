"""Tables of `gapbeam modes` for the terminal, and records for `modes.json`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.solver.modes.contact_modes import FREE, MIXED, SEATED, HeldModes
from gapbeam.studies.modes.end_springs import Estimate
from gapbeam.studies.modes.theory_comparison import ModesComparison, SpringFit, TheoryMode

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
    """Return the springs that were identified, with their intervals of 95 % and what they are worth."""
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
