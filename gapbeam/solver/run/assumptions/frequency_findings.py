"""Findings on the frequencies that carry energy in the motion of the probes, compared with step, mesh and basis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import hypot, isfinite, pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import h5py
import numpy as np

from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.beam_profile import BeamPiece
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_choice import bending_wavelength, longest_element
from gapbeam.solver.case.solution_tables import RIGID_SHARE, THICKNESS_OF_WAVE, BeamModel, ReducedModel, RigidModel
from gapbeam.solver.diagnostics.assumption import PARTS, Assumption, Finding, FrequencyContent, content_of_history
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.integrators.time_scheme import carried_error, scheme_error
from gapbeam.solver.loads.load_choice import forcing_frequencies, load_direction
from gapbeam.solver.models.model import Model
from gapbeam.solver.schema.record_table import HISTORY_FILE
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem

if TYPE_CHECKING:
    from mpi4py import MPI

Rate = TypeVar("Rate", float, Array)

IN_TIME = Assumption(
    "step beside the frequencies", "mean error of periods by the scheme, by energy", "1", 0.01, None,
    "resonances lie that much too low, and phases drift; try a smaller time.step",
)  # fmt: skip
UNDAMPED = Assumption(
    "damping of the scheme", "share of the amplitude that the scheme itself takes, by energy", "1", 0.05, None,
    "the scheme damps motion that the beam would keep; try a smaller time.step, or the scheme discrete-gradient, "
    "which has no damping of its own",
)  # fmt: skip
RESONANT = Assumption(
    "resonance beside the scheme", "share of a resonant amplitude that the scheme takes by damping and detuning", "1",
    0.05, 0.5, "the scheme damps and detunes more than the damping of the resonance allows; try a smaller time.step",
)  # fmt: skip
UNRESOLVED = 0.1  # error of the period by the scheme: a mode with more is no part of the figures
UNRESOLVED_MEANING = (
    "do not use figures that such modes decide, as accelerations and forces of single steps; impulses, durations and "
    "displacements of slower motion do not depend on them. A smaller time.step resolves more modes"
)
RESONATES = 0.5  # of the frequency of a resonance: slower loads do not drive it
RATTLING = 0.1  # contacts that end in a cycle; with more, contact bends and moves the resonance as well
STORED = 0.5  # of the largest kinetic energy: a cycle that exchanges less feeds a resonance
ON_MESH = Assumption(
    "mesh beside the wavelengths", "distance of nodes along the beam over the wavelength", "1", 0.125, None,
    "waves of these frequencies are not resolved; try a smaller mesh.size",
)  # fmt: skip
NO_MODES = "the basis holds no modes of these frequencies; try {}"
IN_BASIS = Assumption(
    "basis beside the frequencies", "highest frequency with energy over the highest of the basis", "1", 1.0, None,
    NO_MODES.format(ReducedModel.more_modes),
)  # fmt: skip
SLENDER = Assumption(
    "beam model beside the wavelengths", "thickness over the wavelength", "1", THICKNESS_OF_WAVE,
    None,
    "a beam model moves whole sections alone and knows neither squeezing nor waves through the thickness; "
    'compare contact forces with model.type = "reduced"',
)  # fmt: skip
RIGID = Assumption(
    "rigid model beside the frequencies", "highest frequency that carries energy over the first of the beam", "1",
    RIGID_SHARE, None, 'a rigid body does not deform; compare with model.type = "reduced"',
)  # fmt: skip


def of_frequencies(
    case: Case, model: Model, content: FrequencyContent | None, ledger: Ledger, contacts: int
) -> Iterator[Finding]:
    """Yield the findings on a motion with a frequency content; none where nothing moves.

    Args:
        case: The case.
        model: Its model.
        content: Energy content of the probes.
        ledger: The energies of the run.
        contacts: Number of contacts that ended.

    Collective.
    """
    if content is None or ledger.at_rest:
        return
    highest = content.highest
    detail = f"half of the energy lies below {content.middle:.4g} Hz, 99 % below {highest:.4g} Hz"
    damping, error = of_scheme(case, model, content)
    yield of_step(model, content, error, detail)
    yield Finding(UNDAMPED, damping, estimate=damping, detail=detail)
    yield of_resonance(case, model, content, ledger, contacts)
    if isinstance(case.model, RigidModel):
        yield of_rigid(case, content)
        return
    highest = max([highest, *forcing_frequencies(case.load)])
    wave = shortest_wave(case, content)
    if isinstance(case.model, BeamModel):
        spacing = longest_element(case, case.model)
        yield Finding(SLENDER, wave.thickness, detail=wave.words)
        finer = replace(ON_MESH, meaning=ON_MESH.meaning.replace("a smaller mesh.size", "more elements in [model]"))
    else:
        spacing, finer = node_distance(case, model.space.mesh), ON_MESH
    yield Finding(finer, spacing / wave.length, detail=wave.words)
    basis, held = model.body.basis, replace(IN_BASIS, meaning=NO_MODES.format(case.model.more_modes))
    if basis is not None and basis.highest_mode > 0.0:
        yield Finding(held, highest / basis.highest_mode, detail=f"{highest:.4g} Hz, {basis.highest_mode:.4g} Hz")


class Wave(NamedTuple):
    """The shortest wave that carries energy: its length, m, the thickness of the beam over it, and it in words."""

    length: float
    thickness: float
    words: str


def shortest_wave(case: Case, content: FrequencyContent) -> Wave:
    """Return the shortest of the bending waves and of the waves along the beam, of the speed sqrt(E / density).

    Args:
        case: The case.
        content: Energy content of the probes; loads that repeat add their frequencies to the waves that they drive.
    """
    bending, along = content.bending, content.along
    for load in case.load if forcing_frequencies(case.load) else ():
        frequency, direction = load.forcing_frequency or 0.0, load_direction(load, case.mesh.dimension)
        bending = max(bending, frequency) if np.any(direction[1:]) else bending
        along = max(along, frequency) if direction[0] else along
    waves = list[Wave]()
    for piece in case.profile.pieces:
        lengths = dict[str, float]()
        if bending > 0.0:
            lengths[f"{bending:.4g} Hz, bending"] = bending_wavelength(piece, bending)
        if along > 0.0:
            lengths[f"{along:.4g} Hz, along the beam"] = bar_speed(piece) / along
        waves += [Wave(one, piece.beam.thickness / one, f"{one:.3g} m at {words}") for words, one in lengths.items()]
    return min(waves)


def bar_speed(piece: BeamPiece) -> float:
    """Return sqrt(E / density), the speed of waves along the beam, m/s."""
    return sqrt(piece.material.young_modulus / piece.material.density)


def of_rigid(case: Case, content: FrequencyContent) -> Finding:
    """Return the finding on a rigid model: frequencies over the first ones of bending and of a bar with free ends."""
    stretched = 0.5 * min(bar_speed(piece) for piece in case.profile.pieces) / case.beam.length
    kinds = ((content.bending, overhang_frequency(case)), (content.along, stretched))
    moved, own = max(kinds, key=lambda kind: kind[0] / kind[1])
    return Finding(RIGID, moved / own, detail=f"{moved:.4g} Hz, {own:.4g} Hz")


def of_scheme(case: Case, model: Model, content: FrequencyContent) -> tuple[float, float]:
    """Return the share of the amplitude that the scheme takes, and its mean period error, by energy.

    Of a motion that structural damping of ratio z_s holds down, numerical damping z takes z / (z + z_s); of one that
    goes on for T without it, 1 - exp(-z w T). The smaller of both counts, and of both the share that vibrates.
    """
    omega = 2.0 * pi * content.frequencies
    weights = np.full(PARTS, 1.0 / PARTS)
    ratios = np.abs(scheme_error(case.time.scheme, omega * model.step).damping_ratio)
    own = rayleigh_ratio(model.system, omega) + (case.damping.ratio or 0.0)
    _, error = carried_error(case.time.scheme, omega * model.step, weights)
    return content.share * float(weights @ _taken(ratios, own, omega * case.time.end)), content.share * error


def of_step(model: Model, content: FrequencyContent, error: float, detail: str) -> Finding:
    """Return the period error of the scheme on a motion, and the modes that the step does not resolve.

    Args:
        model: The model.
        content: Energy content of the probes.
        error: Mean error of all periods.
        detail: The content in words.
    """
    errors = scheme_error(model.scheme, 2.0 * pi * content.frequencies * model.step).period_error
    resolved = np.abs(errors) <= UNRESOLVED
    if resolved.all() or not resolved.any():
        return Finding(IN_TIME, error, estimate=error, detail=detail)
    first = float(content.frequencies[~resolved].min())
    words = f"{detail}; modes from {first:.3g} Hz on, which carry {1.0 - resolved.mean():.0%} of it, are not resolved"
    return Finding(
        replace(IN_TIME, meaning=UNRESOLVED_MEANING), error, estimate=float(np.abs(errors[resolved]).mean()),
        detail=words, of="figures of the others",
    )  # fmt: skip


def of_resonance(case: Case, model: Model, content: FrequencyContent, ledger: Ledger, contacts: int) -> Finding:
    """Return the scheme's reduction of the amplitude of a resonance, where the run is at one.

        1 - z_o / sqrt((z_o + z)^2 + e^2),    at most w T (z + e)

    z and e are damping ratio and period error of the scheme at the frequency w below which half of the energy lies, z_o
    the damping ratio without the scheme: that of Rayleigh damping or, where it is larger, of what was lost in a cycle,
    over 4 pi times the largest kinetic energy. A run is at a resonance where loads have brought the energy that is
    stored, and a cycle exchanges little of it. Free motion is at none, such as what rings after a step of force, or
    after contacts where loads are slower and the step does not resolve it, nor is motion that round-off hides. Where
    faces open and close in cycles of the loads, the formula is no more than a hint, and ends no run: contact limits the
    amplitude, too.
    """
    omega = 2.0 * pi * content.middle
    cycles, driven = max(content.middle * case.time.end, 1.0), forcing_frequencies(case.load)
    stored = ledger.largest_kinetic
    exchanged = ledger.absolute_work / cycles / stored if stored > 0.0 else np.inf
    detail = f"{content.middle:.4g} Hz; a cycle exchanges {100.0 * exchanged:.2g} % of the largest kinetic energy"
    rings = all(load.static or load.settles for load in case.load)
    if rings or not ledger.fed(isinstance(case.analysis, Transient) and case.analysis.state is None):
        return Finding(RESONANT, 0.0, detail=f"no resonance: loads do not feed the motion; {content.middle:.4g} Hz")
    if exchanged >= STORED:
        return Finding(RESONANT, 0.0, detail=f"no resonance: {detail}")
    found = scheme_error(case.time.scheme, np.array([omega * model.step]))
    ratio, error = abs(float(found.damping_ratio[0])), abs(float(found.period_error[0]))
    if error > UNRESOLVED and driven and max(driven) < RESONATES * content.middle:
        return Finding(RESONANT, 0.0, detail=f"no resonance: loads are slower than {content.middle:.4g} Hz")
    ratio_of_beam = rayleigh_ratio(model.system, omega) + (case.damping.ratio or 0.0)
    own = max(ratio_of_beam, ledger.lost / cycles / (4.0 * pi * stored))
    share = 1.0 - own / hypot(own + ratio, error) if isfinite(ratio + error) and ratio + error > 0.0 else 1.0
    share = min(share, omega * case.time.end * (ratio + error)) if isfinite(ratio + error) else 1.0
    if contacts > RATTLING * min([cycles, *(one * case.time.end for one in driven)]):
        hint = replace(RESONANT, failure=None)
        return Finding(hint, share, detail=f"{detail}; damping ratio {own:.2g}; contact limits the amplitude, too")
    return Finding(RESONANT, share, estimate=share, detail=f"{detail}; damping ratio {own:.2g}")


def rayleigh_ratio(system: SemiDiscreteSystem, omega: Rate) -> Rate:
    """Return the fraction of critical damping of C = a M + b K at angular frequencies, (a / w + b w) / 2."""
    return 0.5 * (system.mass_damping / omega + system.stiffness_damping * omega)


def _taken(ratios: Array, own: Array, turns: Array) -> Array:
    whole = np.isinf(ratios)
    ratios = np.where(whole, 1.0, ratios)
    held = np.divide(ratios, ratios + own, out=np.zeros_like(ratios), where=ratios > 0.0)
    return np.asarray(np.where(whole, 1.0, np.minimum(held, -np.expm1(-ratios * turns))))


def node_distance(case: Case, mesh: Any) -> float:
    """Return the distance of nodes along the beam where cells of a mesh are longest, m. Collective."""
    if case.mesh.file is None:
        return (case.mesh.size or case.profile.thickest) / case.mesh.degree
    cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)
    longest: list[float] = mesh.comm.allgather(float(np.max(mesh.h(mesh.topology.dim, cells), initial=0.0)))
    return max(longest) / sqrt(mesh.topology.dim) / case.mesh.degree


def recorded_content(model: Model, folder: Path, comm: MPI.Comm) -> FrequencyContent | None:
    """Return the energy content of the probes; None where no probe has moved, or too few records are there.

    Args:
        model: The model.
        folder: The results folder, its history closed.
        comm: The ranks; rank 0 reads.

    Collective.
    """
    found: FrequencyContent | None = None
    if comm.rank == 0:
        try:
            with h5py.File(folder / HISTORY_FILE, "r") as file:
                found = content_of_history(file, [load.static for load in model.system.loads])
        except (OSError, RuntimeError, KeyError):
            found = None  # a history that cannot be read is reported by what reads it
    shared: FrequencyContent | None = comm.bcast(found)
    return shared
