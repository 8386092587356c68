"""What is measured about many ranks: counts of messages that are known, tables of tiny meshes on two ranks."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks import communication, many_ranks, replicated, scaling, solves, tiers
from benchmarks.messages import Sent, counter, on_ranks
from tests.shared.command import alone, process_environment

pytestmark = alone


def test_known_messages_are_counted() -> None:
    """Eight messages and five collective operations of known size, from each of two ranks."""
    with counter() as counting:
        done = subprocess.run(
            on_ranks(2, "-m", "tests.programs.known_messages", counting=counting),
            env=process_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    for calls, amounts, seconds in json.loads(done.stdout):
        sent = Sent(calls, amounts, seconds)
        assert (calls["send"], amounts["send"]) == (8, 3 * 80 + 40 + 4 * 80)
        assert (calls["reduce"], amounts["reduce"]) == (2, 88)
        assert (calls["bcast"], amounts["bcast"]) == (1, 80)
        assert (calls["gather"], amounts["gather"]) == (1, 80)
        assert calls["barrier"] == 1
        assert sent.collective("calls") == 5
        assert seconds["wait"] > 0.0


@pytest.mark.slow
def test_ranks_are_measured_beside_each_other() -> None:
    """The coarsest mesh on one rank and on two: the DOFs are all there, and what is reported of the ranks is theirs."""
    found = scaling.table({1: 1}, (1, 2))
    alone, together = found.rows
    assert alone[:4] == (3075, 1, "3075", alone[3])
    assert together[:2] == (3075, 2)
    for column in (2, 3):  # DOFs and interface DOFs of each rank
        assert sum(map(int, together[column].split(" + "))) == int(alone[column])
    assert len(together[-4].split(" + ")) == 2
    for what in ("setup", "step", "back_substitution"):
        one, two = (found.figures[f"3075 on {count}: {what}"] for count in (1, 2))
        assert min(one, two) > 0.0
        assert found.figures[f"3075 on 1: efficiency of {what}"] == 1.0
        assert found.figures[f"3075 on 2: efficiency of {what}"] == pytest.approx(0.5 * one / two)


@pytest.mark.slow
@pytest.mark.parametrize("together", [False, True])
def test_steps_are_counted_part_by_part(together: bool) -> None:
    """The coarsest mesh: alone nothing is sent; on two ranks sums send the interface and products a layer.

    Factors of the ranks need a sum for what lies between them, MUMPS on all ranks together sends messages.
    """
    step = communication.step_table((1,), (1, 2), together)
    figures = step.figures
    assert figures["3075 on 1: products: messages"] == 0.0
    assert (figures["3075 on 2: back-substitution: messages"] > 0.0) == together
    assert figures["3075 on 2: back-substitution: collectives"] > 0.0
    # a refresh at the end of the march has two products with M and two with K in addition to one with M in each step
    assert figures["3075 on 2: products: messages"] == pytest.approx(1.0 + 4.0 / communication.STEPS, abs=0.05)
    trace = 8.0 * figures["3075: interface"]
    assert figures["3075 on 2: sums: collective_bytes"] > 2.0 * trace
    assert figures["3075 on 2: sums: collective_bytes"] < 3.0 * trace


@pytest.mark.slow
def test_what_is_replicated_grows_with_the_faces() -> None:
    """Faces grow more slowly than the body."""
    found = replicated.table((1, 2))
    assert [row[0] for row in found.rows] == [3075, 5025]
    assert 0.0 < found.figures["exponent_interface"] <= 2.0


def test_model_of_many_ranks_has_its_limits(tmp_path: Path) -> None:
    """Figures of a machine whose every time and count is a power law: the model gives the laws back, far away too."""
    parts = (*many_ranks.OWN, many_ranks.SOLVER, many_ranks.REPLICATED, many_ranks.SUMS)
    counts = {(law.part, law.what): law for law in many_ranks.LAWS}
    communication = {f"{dofs}: points": 1.0 for dofs in (1000, 8000)}
    for dofs in (1000, 8000):
        for ranks in (1, 2, 4):
            for part in parts:
                communication[f"{dofs} on {ranks}: {part}: seconds"] = dofs * 1e-6
            for (part, what), law in counts.items():
                communication[f"{dofs} on {ranks}: {part}: {what}"] = law.at(1e-3, dofs / 1000, max(ranks, 2))
    names = ("assembly", *many_ranks.SPLIT, "back_substitution", "step")
    scaling = {f"{d} on {r}: {name}": d / r for d in (1000, 8000) for r in (1, 2) for name in names}
    alone = {f"exponent_{name}": 1.0 for name in ("points", "interface", "operator")}
    replicated = {"dofs": 1000.0, "points": 10.0, "interface": 5.0, "mesh": 3.0, "operator": 2.0} | alone
    for name, figures in (("together", communication), ("scaling", scaling), ("replicated", replicated)):
        (tmp_path / f"{name}.json").write_text(json.dumps({"figures": figures}))
    found = many_ranks.Measured(tmp_path)
    assert many_ranks.checked(found).figures["worst"] == pytest.approx(1.0)
    # on two ranks: four parts of 8 ms halved, the contact solve of 8 ms whole; the wire is for nothing
    few = many_ranks.step_of(found, 8000, 2, latency=0.0, bandwidth=float("inf"))
    assert sum(few.values()) == pytest.approx(4 * 4e-3 + 8e-3)
    many = many_ranks.step_of(found, 1e6, 2**10, latency=0.0, bandwidth=float("inf"))
    assert sum(many.values()) == pytest.approx(1.0 + 4.0 / 2**10)
    assert sum(many_ranks.step_of(found, 1e6, 2**10).values()) > sum(many.values())
    setup = many_ranks.setup_of(found, 1e6, 2**10)
    assert setup["mesh, on rank 0"] == pytest.approx(3000.0)
    assert sum(setup.values()) == pytest.approx(5000.0 + 4.0 * 1e6 / 2**10)
    steps, _ = many_ranks.extended(found)
    assert {row[-2:] for row in steps.rows} == {("contact solve, on every rank",) * 2}
    assert found.left("assembly", 64) == pytest.approx(1.0 / 64)


@pytest.mark.slow(minutes=2)
def test_ways_to_solve_are_measured() -> None:
    """The two coarsest meshes, with a factor and by iterations: every figure is there and costs something."""
    found = tiers.table({"factor": (1, 2), "iterations": (1,)})
    assert [row[:2] for row in found.rows] == [("factor", 3075), ("factor", 5025), ("iterations", 3075)]
    small, large = (("factor", 3075), ("factor", 5025))
    for way, dofs in (small, large, ("iterations", 3075)):
        assert found.figures[f"{way}, {dofs}: step"] > 0.0
        assert found.figures[f"{way}, {dofs}: memory"] > 0.0
    memory = [found.figures[f"{way}, {dofs}: memory"] for way, dofs in (small, large)]
    # its sign is not known: meshes as coarse as these take less than their processes differ by
    exponent = np.log(memory[1] / memory[0]) / np.log(5025 / 3075)
    assert found.figures["factor: exponent of memory"] == pytest.approx(exponent)
    one = solves.table((1, 2))
    assert [row[0] for row in one.rows] == [3075, 5025]
    assert one.figures["largest_solve"] > 0.0
