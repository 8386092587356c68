"""The paper's beam in finite elements, seated with play and pressed by an interference fit, beside section 2."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from mpi4py import MPI

from gapbeam.postprocess.report.blocks import Block, Cell, TableBlock, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.model import build_model
from gapbeam.solver.modes.contact_modes import SEATED, held_modes
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.solver.system.operators import Array
from gapbeam.studies.modes.mode_tables import as_data
from gapbeam.studies.modes.theory_comparison import OVERHANG, ModesComparison, beams_of, compare_modes
from gapbeam.studies.paper.printed_figures import printed

COUNT = 4
ACCURACY = 0.01
PLAY = "play of 0.107 mm"
CLEARANCES = {PLAY: 0.107e-3, "interference of 0.006 mm": -0.006e-3}
MESH = {"dimension": 2, "size": 0.0115, "support_size": 4.2e-3, "cells_through_thickness": 4}
COMMAND = "environment/run gapbeam modes cases/li2013-2d.toml"
COMMANDS = (COMMAND, f"{COMMAND} --set support.clearance=-0.006e-3")


def paper_case(clearance: float) -> Case:
    """Return the paper's beam at rest on its support, a slice in plane stress with the mesh of li2013-2d.toml."""
    beam = printed()["beam"]
    return Case.model_validate(
        {
            "beam": {name: beam[name] for name in ("length", "width", "thickness")},
            "material": {name: beam[name] for name in ("young_modulus", "poisson_ratio", "density")},
            "support": {"length": beam["support_length"], "clearance": clearance},
            "mesh": MESH,
            "load": [{"type": "gravity"}],
            "time": {"end": 1.0, "step": 1e-4},
        }
    )


def seated_blocks(folder: Path) -> list[Block]:
    """Return the modes of the finite element model beside the theory, and write them to `modes-*.json` in a folder."""
    found: dict[str, ModesComparison] = {}
    for (name, clearance), place in zip(CLEARANCES.items(), ("play", "interference"), strict=True):
        case = paper_case(clearance)
        states = held_modes(build_model(case, MPI.COMM_SELF), COUNT)
        found[name] = compare_modes(case, states, COUNT, {}, ACCURACY)
        write_beside(folder / f"modes-{place}.json", json.dumps(finite(as_data(found[name])), indent=1) + "\n")
    case = paper_case(0.0)
    stiffness = 3.0 * beams_of(case)[OVERHANG].bending / case.layout.length
    best = found[PLAY].best(SEATED)
    assert best is not None
    draught, torsion = best.fit.draught, best.fit.torsion
    return [
        Words(
            "The model of section 2 has two springs that the paper leaves open. Here they are identified: those with "
            "which the overhang, 460 mm, has the first three frequencies of the finite element model of the seated "
            "beam. With play, the beam rests on the two edges of its seat; in statics the span a between them is a "
            f"torsion spring 3 E I / a = {stiffness:.4g} N m/rad, and no draught spring gives way. Identified is "
            f"k2 = {torsion.value:.4g} ({torsion.low:.3g} to {torsion.high:.3g}) N m/rad; k1 is on its plateau, where "
            f"frequencies determine a lower limit only, {draught.low:.3g} N/m."
        ),
        _frequencies(found, stiffness),
        _springs(found),
        _shapes(found),
    ]


def _frequencies(found: dict[str, ModesComparison], stiffness: float) -> TableBlock:
    overhang = beams_of(paper_case(0.0))[OVERHANG]
    modes = np.arange(1, COUNT + 1)
    columns: list[tuple[str, Sequence[float] | Array]] = [
        ("clamped, theory (Hz)", overhang.frequencies(modes, np.inf, np.inf)),
        ("on its edges, theory (Hz)", overhang.frequencies(modes, np.inf, stiffness)),
    ]
    edges = columns[-1][1]
    seated = found[PLAY].states[SEATED].bending()[0][:COUNT]
    lower = [100.0 * (1.0 - own / theory) for own, theory in zip(seated, edges, strict=True)]
    for name, one in found.items():
        best = one.best(SEATED)
        assert best is not None
        columns.append((f"{name}, finite elements (Hz)", one.states[SEATED].bending()[0][:COUNT]))
        columns.append((f"{name}, on identified springs (Hz)", [mode.frequency for mode in best.modes]))
    return TableBlock(
        "Bending frequencies of the seated beam",
        ("mode", *(heading for heading, _ in columns)),
        tuple((int(mode), *(float(values[row]) for _, values in columns)) for row, mode in enumerate(modes)),
        notes=(
            "Springs are identified from modes 1 to 3; mode 4 is predicted.",
            "Finite elements give way to shear and at their edges, which the theory of Euler and Bernoulli does "
            f"not: with play they are {lower[0]:.1f} % below the beam on its edges in mode 1 and {lower[-1]:.1f} % "
            f"in mode {COUNT}.",
        ),
        command="\n".join(COMMANDS),
    )


def _springs(found: dict[str, ModesComparison]) -> TableBlock:
    rows: list[tuple[Cell, ...]] = []
    for name, one in found.items():
        for each in one.fits:
            fit = each.fit
            springs = (fit.draught, fit.torsion)
            cells = [text for spring in springs for text in (_range_words(spring.low, spring.high), spring.verdict)]
            if not fit.reproduces:
                cells = ["none", "", "none", ""]
            rows.append((name, each.choice, fit.beam.length, *cells, round(100.0 * fit.misfit, 6)))
    return TableBlock(
        "End springs that reproduce the first three frequencies, intervals of 95 %",
        ("state", "length is", "l (m)", "k1 (N/m)", "k1 is", "k2 (N m/rad)", "k2 is", "misfit (%)"),
        rows,
        notes=(
            f"A frequency counts as reproduced within {200 * ACCURACY:g} %. With the whole beam, 510 mm, as the length "
            "no springs do: even clamped it is too slow.",
            "Where the length is fitted as well, three frequencies meet three unknowns: they are always met.",
        ),
        command="\n".join(COMMANDS),
    )


def _range_words(low: float, high: float) -> str:
    if low > 0.0 and np.isfinite(high):
        return f"{low:.3g} to {high:.3g}"
    return f"above {low:.3g}" if low > 0.0 else f"below {high:.3g}"


def _shapes(found: dict[str, ModesComparison]) -> Chart:
    name, one = PLAY, found[PLAY]
    seated, best = one.states[SEATED], one.best(SEATED)
    assert best is not None
    beam, springs = best.fit.beam, best.fit.springs
    start = seated.length - beam.length
    xi = np.asarray(np.linspace(0.0, 1.0, 121), dtype=np.float64)
    curves, choices = [], [f"mode {mode}" for mode in range(1, COUNT + 1)]
    for number, choice in enumerate(choices):
        motion = seated.bending()[1][number]
        shape = beam.shape(number + 1, *springs)
        scale = float(shape(np.array((seated.places[-1] - start) / beam.length))) / motion[-1]
        curves.append(ChartCurve("finite elements", seated.places, scale * motion, "markers", choice))
        curves.append(ChartCurve("beam on identified springs", start + beam.length * xi, shape(xi), "lines", choice))
    return Chart(
        f"Mode shapes of the seated beam, {name}, and of the overhang on the springs identified",
        "x (m)", "deflection (1)", curves, COMMAND, choices=choices, choice="mode",
    )  # fmt: skip
