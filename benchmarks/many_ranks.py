"""A model of what a step and its set-up take on many ranks, from what was measured on few; checked, then extended.

    T(n, P) = sum_own t(n) / P + t_solver(n) (s + (1 - s) / P) + sum_replicated t(n) + messages, collective operations

t(n) are powers of n between two measured sizes; s is the share of the solver's work that a second rank was measured
not to shorten, and that more ranks may shorten or not: 0 at best. Messages and bytes follow the laws below from the
smaller size on two ranks; what they take is computed from latency and bandwidth of a network. It reads the tables of
benchmarks.scaling, replicated and communication, of the latter with MUMPS on all ranks together: so many slices have
too much between them for factors of their own.

    environment/run python3 -m benchmarks.many_ranks --output results/bench
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

from benchmarks.table import Cell, Table, options, seconds

LATENCY, BANDWIDTH = 2.0e-6, 10.0e9  # s, bytes/s: ASSUMED, of a network between nodes
SIZES, RANKS = (1.0e6, 1.0e7, 1.0e8), (64, 1024)
OWN, SOLVER, REPLICATED = ("the rest", "products", "correction"), "back-substitution", "contact solve"
SPLIT = ("factorization", "block", "seat")  # of the set-up, as the solver; no memory has room for columns
SUMS = "sums"


@dataclass(frozen=True)
class Law:
    """Growth of the messages of a part with DOFs and ranks.

    Attributes:
        part: Which part.
        what: Their number or bytes.
        power: Of the number of unknowns.
        growth: With the ranks: "none", "neighbors" (1 on two ranks, then 2) or "levels" (log2 P, of a tree).
        words: Why.
    """

    part: str
    what: str
    power: float
    growth: str
    words: str

    def at(self, known: float, scale: float, ranks: int) -> float:
        """Return the law at a multiple of the unknowns on some ranks, from what is known on two."""
        more = {"none": 1.0, "neighbors": min(2.0, ranks - 1.0), "levels": math.log2(ranks)}[self.growth]
        return float(known * scale**self.power * more)


LAWS = (
    Law(SUMS, "collectives", 0.0, "none", "two sums a step, each Reduce and Bcast"),
    Law(SUMS, "collective_bytes", 2.0 / 3.0, "none", "values on the interface, a part of the surface"),
    Law("products", "messages", 0.0, "neighbors", "one layer of cells to each neighbor"),
    Law("products", "message_bytes", 2.0 / 3.0, "neighbors", "as large as a cross-section"),
    Law(SOLVER, "messages", 4.0 / 3.0, "levels", "panels of the factor, level by level of its tree"),
    Law(SOLVER, "message_bytes", 1.0, "levels", "parts of the solution, level by level"),
    Law(SOLVER, "collectives", 0.0, "none", "settings, orders, the solution"),
    Law(SOLVER, "collective_bytes", 1.0, "none", "where each unknown is, an integer each, to all ranks"),
)


class Measured:
    """The figures of the tables, and the two sizes and their times on one rank."""

    def __init__(self, folder: Path) -> None:
        self._figures = {
            name: json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))["figures"]
            for name in ("scaling", "together", "replicated")
        }
        sizes = sorted({int(name.split(":")[0]) for name in self._figures["together"] if ": points" in name})
        self.small, self.large = sizes[0], sizes[-1]

    def sent(self, dofs: int, ranks: int, part: str, what: str) -> float:
        """Return a figure of a part of a step."""
        return float(self._figures["together"][f"{dofs} on {ranks}: {part}: {what}"])

    def step(self, part: str, dofs: float) -> float:
        """Return the time of a part of a step on one rank, s."""
        few, many = (self.sent(size, 1, part, "seconds") for size in (self.small, self.large))
        return self._grown(few, many, dofs)

    def whole_step(self, dofs: int, ranks: int) -> float:
        """Return the time of a step as it was measured, s."""
        return float(self._figures["scaling"][f"{dofs} on {ranks}: step"])

    def setup(self, part: str, dofs: float) -> float:
        """Return the time of a part of the set-up on one rank, s."""
        few, many = (float(self._figures["scaling"][f"{size} on 1: {part}"]) for size in (self.small, self.large))
        return self._grown(few, many, dofs)

    def left(self, part: str, ranks: int) -> float:
        """Return the time of a part on some ranks over that on one, if they shorten no more of it than two ranks do."""
        one, two = (float(self._figures["scaling"][f"{self.large} on {count}: {part}"]) for count in (1, 2))
        stays = max(2.0 * two / one - 1.0, 0.0)
        return stays + (1.0 - stays) / ranks

    def alone(self, name: str, dofs: float) -> float:
        """Return what does not depend on the ranks: points, interface DOFs, times of mesh and contact operator, s.

        From the largest size on gmsh takes its time for cells, whatever it took to start.
        """
        found = self._figures["replicated"]
        power = 1.0 if name == "mesh" else found[f"exponent_{name}"]
        return float(found[name] * (dofs / found["dofs"]) ** power)

    def _grown(self, few: float, many: float, dofs: float) -> float:
        power = math.log(many / few) / math.log(self.large / self.small)
        return float(many * (dofs / self.large) ** power)


def checked(found: Measured) -> Table:
    """Return the laws against what was counted where they were not fitted."""
    rows: list[tuple[Cell, ...]] = []
    worst = 1.0
    for law in LAWS:
        known = found.sent(found.small, 2, law.part, law.what)
        cells: list[Cell] = [law.part, law.what.replace("_", " "), law.words, known]
        for dofs, ranks in ((found.small, 4), (found.large, 2), (found.large, 4)):
            predictable_periods = law.at(known, dofs / found.small, ranks)
            counted = found.sent(dofs, ranks, law.part, law.what)
            worst = max(worst, predictable_periods / counted, counted / predictable_periods)
            cells += [predictable_periods, counted]
        rows.append(tuple(cells))
    heads = [f"{dofs} on {ranks}" for dofs, ranks in ((found.small, 4), (found.large, 2), (found.large, 4))]
    columns = [f"{head}, {what}" for head in heads for what in ("predicted", "counted")]
    model = step_of(found, found.large, 2, latency=0.0)
    measured = found.whole_step(found.large, 2)
    return Table(
        "laws",
        "How messages grow: predicted from the smaller size on two ranks, and counted",
        ("part", "what", "law", f"{found.small} on 2, counted", *columns),
        tuple(rows),
        (
            f"the worst law is off by a factor of {worst:.2g}",
            f"the time of a step with {found.large} DOFs on 2 ranks: predicted {seconds(sum(model.values()))} from one "
            f"rank and what two leave of the back-substitution, measured {seconds(measured)}",
        ),
        {"worst": worst, "step_foretold": sum(model.values()), "step_measured": measured},
    )


def step_of(
    found: Measured,
    dofs: float,
    ranks: int,
    at_best: bool = False,
    latency: float = LATENCY,
    bandwidth: float = BANDWIDTH,
) -> dict[str, float]:
    """Return what the parts of a step take, s; at best the solver is shortened by every rank alike."""
    levels = math.log2(ranks)
    left = 1.0 / ranks if at_best else found.left("back_substitution", ranks)
    sent = {
        (law.part, law.what): law.at(found.sent(found.small, 2, law.part, law.what), dofs / found.small, ranks)
        for law in LAWS
    }
    collectives = sum(number * levels * latency for (_, what), number in sent.items() if what == "collectives")
    messages = sum(number * latency for (_, what), number in sent.items() if what == "messages")
    # a sum or a broadcast of much goes through the network about twice, however many ranks there are
    amounts = {"collective_bytes": 2.0, "message_bytes": 1.0}
    carried = sum(amounts.get(what, 0.0) * number / bandwidth for (_, what), number in sent.items())
    return {
        "own share": sum(found.step(part, dofs) for part in OWN) / ranks,
        SOLVER: found.step(SOLVER, dofs) * left,
        "contact solve, on every rank": found.step(REPLICATED, dofs),
        "waiting for messages": collectives + messages,
        "carrying bytes": carried,
    }


def setup_of(found: Measured, dofs: float, ranks: int, at_best: bool = False) -> dict[str, float]:
    """Return what the parts of the set-up take, s; at best as in `step_of`."""
    return {
        "mesh, on rank 0": found.alone("mesh", dofs),
        "contact operator, on every rank": found.alone("operator", dofs),
        "assembly": found.setup("assembly", dofs) / ranks,
        **{part: found.setup(part, dofs) * (1.0 / ranks if at_best else found.left(part, ranks)) for part in SPLIT},
    }


def held(interface: float, dofs: float) -> str:
    """Return in words what every rank holds whole."""
    return f"{dofs:.0e} DOFs: a block of {interface:.3g}^2 at the interface on every rank, {8e-9 * interface**2:.3g} GB"


def extended(found: Measured) -> tuple[Table, Table]:
    """Return steps and set-up on many ranks."""
    tables = []
    for name, title, parts_of in (
        ("many_ranks", "A step on many ranks: computed, not measured", step_of),
        ("many_ranks_setup", "The set-up on many ranks: computed, not measured", setup_of),
    ):
        rows: list[tuple[Cell, ...]] = []
        figures: dict[str, Cell] = {}
        columns: list[str] = []
        for dofs in SIZES:
            for ranks in RANKS:
                parts, best = parts_of(found, dofs, ranks), parts_of(found, dofs, ranks, at_best=True)
                total = sum(parts.values())
                columns = list(parts)
                limits = [max(one, key=lambda part: one[part]) for one in (parts, best)]
                times = (*parts.values(), total, sum(best.values()))
                rows.append((f"{dofs:.0e}", ranks, *map(seconds, times), *limits))
                figures[f"{dofs:.0e} on {ranks}"] = total
        notes = (
            f"ASSUMED: a network with {LATENCY * 1e6:g} us latency and {BANDWIDTH / 1e9:g} GB/s; ranks as fast as here",
            "factor and Delassus operator at every size, whether or not that would be wise or fit in memory",
            *map(held, (found.alone("interface", dofs) for dofs in SIZES), SIZES),
        )
        heads = ("DOFs", "ranks", *columns, "total", "at best", "limit", "at best")
        tables.append(Table(name, title, heads, tuple(rows), notes, figures))
    return tables[0], tables[1]


if __name__ == "__main__":
    chosen = options(__doc__)
    measured = Measured(chosen.output)
    for one in (checked(measured), *extended(measured)):
        one.write(chosen.output)
