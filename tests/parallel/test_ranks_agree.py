"""One, two and three ranks compute the same motion, and write it in the same form."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import meshio
import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.results.results import Results
from tests.shared.command import DEMO, PROJECT, RATTLE, alone, on_ranks_in_turn, settings

pytestmark = [alone, pytest.mark.versions]

COUNTS = (1, 2, 3)
# Strong damping and a contact no stiffer than needed: impacts multiply round-off by less.
SHORT = (*RATTLE, "damping.ratios=[0.1, 0.1]", "contact.stiffness=2e12", "time.end=0.02", "output.fields_interval=5e-3")
PLANE = (*SHORT, "mesh.cell=triangle")
SOLID = (
    *SHORT,
    "mesh.dimension=3",
    "mesh.cell=hexahedron",
    "mesh.degree=1",
    "mesh.cells_across_width=2",
    "restraint.lateral=1e6",
)
REDUCED = (*SOLID, "model.type=reduced", "model.modes=10", "model.shapes=5")
RUBBED = (*SOLID, "contact.friction.coefficient=0.3", "contact.friction.slip_velocity=1e-3")

MASSLESS = (*SHORT, "contact.mass=redistributed")
ITERATIVE = (*PLANE, "solver.effective=iterative", "solver.tolerance=1e-12", "time.end=0.0025")
# Until base and gland were both left and met again, in few steps: ranks wait busily for each other in every one.
BRIEF = ("time.end=0.011", "time.step=2e-4", "output.history_interval=2e-4", "output.fields_interval=4e-3")
KINDS = {name: (*kind, *BRIEF) for name, kind in {"2D": PLANE, "friction": RUBBED, "massless": MASSLESS}.items()}
PAIRS = ("massless", "iterative")  # kinds that one and two ranks compare: how a third one is cut off, others show
CLOSE = 2e-8  # of the largest magnitude of a variable; 1.2e-8 was seen: contact energy, massless contact nodes
# Sums of round-off in a conserving scheme without contact damping: zero but for what the energies leave of it.
ROUND_OFF = {"energy_residual", "algorithmic_dissipation", "contact_dissipation"}


Kind = tuple[str, ...]


def run_on_ranks(
    case: Path, kinds: Mapping[str, Kind], folder: Path, pairs: Collection[str] = ()
) -> dict[str, list[Results]]:
    """Run kinds of a case, which differ in their overrides, on every number of ranks; one rank is this process.

    Those in `pairs` are run on one rank and on two.
    """
    counts = {name: COUNTS[:2] if name in pairs else COUNTS for name in kinds}
    for name, overrides in kinds.items():
        assert gapbeam.run(case, overrides, folder / name / "1").exit_status == 0
    for count in COUNTS[1:]:
        calls = [
            ("run", case, "--output", folder / name / str(count), *settings(*overrides))
            for name, overrides in kinds.items()
            if count in counts[name]
        ]
        for done in on_ranks_in_turn(count, *calls):
            assert done.returncode == 0, done.stderr
    found = {}
    for name in kinds:
        results = [gapbeam.open_results(folder / name / str(count)) for count in counts[name]]
        assert [one.summary["model"]["ranks"] for one in results] == list(counts[name])
        assert [len(one.summary["memory"]["peak_per_rank"]) for one in results] == list(counts[name])
        for one, count in zip(results, counts[name], strict=True):
            facets = one.summary["model"]["contact_facets_per_rank"]
            assert len(facets) == count
            assert 0 < max(facets) <= 2 * min(facets)
        found[name] = results
    return found


def disagreements(results: list[Results]) -> dict[str, float]:
    """Return the largest difference of every variable from one rank, relative to its size."""
    first, *others = (one.history for one in results)
    energy = float(np.abs(first["load_work"]).max())
    found: dict[str, float] = {}
    for other in others:
        assert set(other.variables) == set(first.variables)
        for name in first.variables:
            if first[name].dtype == object:
                assert first[name].values.tolist() == other[name].values.tolist()
                continue
            size = energy if name in ROUND_OFF else float(np.abs(first[name]).max())
            apart = float(np.abs(first[name].values - other[name].values).max())
            found[str(name)] = max(found.get(str(name), 0.0), apart / size if size > 0.0 else apart)
    return found


def too_far(results: list[Results], loosened: float = 1.0) -> dict[str, float]:
    """Return the variables that disagree by more than they should."""
    return {name: apart for name, apart in disagreements(results).items() if not apart <= loosened * CLOSE}


def series(folder: Path, field: str = "displacement") -> tuple[np.ndarray, np.ndarray, list[float], list[np.ndarray]]:
    """Return points, cell centers, times and values of a field, in an order that ranks do not change."""
    with meshio.xdmf.TimeSeriesReader(folder / "fields.xdmf") as reader:
        points, cells = reader.read_points_cells()
        order = np.lexsort(np.round(points, 9).T)
        centers = np.concatenate([points[block.data].mean(axis=1) for block in cells])
        centers = centers[np.lexsort(np.round(centers, 9).T)]
        times, values = [], []
        for number in range(reader.num_steps):
            time, data, _ = reader.read_data(number)
            times.append(time)
            values.append(data[field][order])
    return points[order], centers, times, values


def check_fields(results: list[Results], tolerance: float, field: str = "displacement") -> None:
    points, centers, times, values = series(results[0].folder, field)
    size = max(np.abs(value).max() for value in values)
    for other in results[1:]:
        other_points, other_centers, other_times, other_values = series(other.folder, field)
        np.testing.assert_allclose(other_points, points, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(other_centers, centers, rtol=0.0, atol=1e-12)
        assert other_times == times
        for value, other_value in zip(values, other_values, strict=True):
            np.testing.assert_allclose(other_value, value, rtol=0.0, atol=tolerance * size)


@pytest.fixture(scope="module")
def all_results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Results]]:
    return run_on_ranks(DEMO, {**KINDS, "iterative": ITERATIVE}, tmp_path_factory.mktemp("ranks"), PAIRS)


@pytest.fixture(params=KINDS)
def results(request: pytest.FixtureRequest, all_results: dict[str, list[Results]]) -> list[Results]:
    return all_results[request.param]


@pytest.mark.slow(minutes=0.3)
def test_both_faces_open_and_close(results: list[Results]) -> None:
    """The comparison means something: on one rank, base and gland are both left and met again."""
    closed = results[0].history["active_points"].values > 0.0
    assert (np.abs(np.diff(closed.astype(int), axis=0)).sum(axis=0) >= 2).all()


@pytest.mark.slow(minutes=0.4)
def test_histories_agree(results: list[Results], request: pytest.FixtureRequest) -> None:
    """Every variable of history.h5, contact iterations included, against one rank.

    Within 2e-8 of its largest magnitude; quantities that the face or 1/dt makes stiff within 1e-7; sums of
    round-off relative to the work of the loads. With friction, round-off decides on the last iteration.
    """
    rubs = request.node.callspec.params["results"] == "friction"
    assert set(too_far(results)) <= ({"iterations"} if rubs else set())
    counts = [one.history["iterations"].values.astype(int) for one in results]
    assert max(np.abs(count - counts[0]).max() for count in counts) <= int(rubs)


@pytest.mark.slow(minutes=0.1)
def test_fields_agree(results: list[Results]) -> None:
    """fields.xdmf as meshio reads it: points, cells, times, and the displacement at the same place."""
    check_fields(results, CLOSE)


@pytest.mark.slow(minutes=0.1)
def test_seats_agree(results: list[Results]) -> None:
    """Reactions of the seat within 1e-7 of one rank, and in balance with the weight of the beam within 1e-7."""
    seats = [one.summary["seat"] for one in results]
    for seat in seats:
        assert seat["base_force"] == pytest.approx(seats[0]["base_force"], rel=1e-7)
        assert seat["gland_force"] == pytest.approx(seats[0]["gland_force"], rel=1e-7)
        weight = 7919.0 * 0.51 * 0.012 * 0.02 * 9.81
        assert seat["base_force"] - seat["gland_force"] == pytest.approx(weight, rel=1e-7)


@pytest.mark.slow(minutes=0.1)
def test_iterations_agree(all_results: dict[str, list[Results]]) -> None:
    """The beam by conjugate gradients, which differ on ranks: all variables but the number of contact iterations."""
    assert set(too_far(all_results["iterative"])) <= {"iterations"}


@pytest.mark.slow
def test_solid_beams_without_friction_agree(tmp_path: Path) -> None:
    """What holds with friction holds without it: histories, fields and seats of a solid beam, in steps of 0.1 ms."""
    results = run_on_ranks(DEMO, {"3D": (*SOLID, "time.end=0.012")}, tmp_path)["3D"]
    test_both_faces_open_and_close(results)
    assert too_far(results) == {}
    check_fields(results, CLOSE)
    test_seats_agree(results)


@pytest.mark.slow
def test_reduced_beams_agree(tmp_path: Path) -> None:
    """Histories and fields in a reduced basis: the modes agree as well as their solver converged, to some 1e-12."""
    results = run_on_ranks(DEMO, {"reduced": REDUCED}, tmp_path)["reduced"]
    assert too_far(results, loosened=200.0) == {}
    check_fields(results, 200.0 * CLOSE)


@pytest.mark.slow
def test_solid_beam_of_li_agrees(tmp_path: Path) -> None:
    """The first 0.01 s of cases/li2013.toml, 29 000 DOFs: histories against one rank.

    Hardly anything drives the beam across its bending plane, where a weak spring at one end is all that holds it:
    round-off moves its tip by some 1e-7 m. So the lateral displacement is held to 0.1 % of the clearance, and the
    rest, which holds the energy of that spring, to five times the tolerances of the small cases.
    """
    li = {"li": (*RATTLE, "time.end=0.01")}
    results = run_on_ranks(PROJECT / "cases" / "li2013.toml", li, tmp_path)["li"]
    histories = [one.history for one in results]
    lateral = [history["displacement"].sel(component="y").values for history in histories]
    for one in lateral[1:]:
        assert np.abs(one - lateral[0]).max() < 1e-3 * 0.107e-3
    for history in histories:
        history["displacement"].loc[{"component": "y"}] = 0.0
    assert too_far(results, loosened=5.0) == {}
