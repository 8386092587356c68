"""Targets of fuzzing: each corrupts its files in a folder of its own and returns the function to attempt."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.fuzz import checkpoint_mutations as checkpoint_targets
from benchmarks.fuzz.mutations import NUMBERS, WORDS, put_in_place, spoil_bytes, spoil_hdf5, spoil_json, spoil_text
from benchmarks.fuzz.sandbox import PROJECT, QUICK, STABILITY, Limits, Work, command

TEXTS = {".toml": spoil_text, ".json": spoil_json, ".jsonl": spoil_json, ".csv": spoil_text, ".xdmf": spoil_text}


@dataclass(frozen=True)
class Target:
    """Something that reads files.

    Attributes:
        name: Name in the table.
        weight: Share of the inputs.
        spoil: Makes the input in a folder and returns the work; gets seeds, folder, chance.
        limits: Limits of an attempt.
        quotes: Whether its messages quote the line of the file that the user named, as those of case files do.
    """

    name: str
    weight: float
    spoil: Callable[[Path, Path, random.Random], Work]
    limits: Limits = Limits()  # noqa: RUF009
    quotes: bool = False


def _case(seeds: Path, folder: Path, chance: random.Random) -> Work:  # noqa: ARG001
    path = folder / "case.toml"
    path.write_bytes(spoil_text(chance.choice(_cases()).read_bytes(), chance))
    shutil.copytree(PROJECT / "cases" / "signals", folder / "signals")
    if chance.random() < 0.02:
        put_in_place(path, folder / "precious", chance)
    return lambda: _read_case(path, [])


def _record(seeds: Path, folder: Path, chance: random.Random) -> Work:  # noqa: ARG001
    """Read a case with a spoiled record, or with keys that read it otherwise."""
    signal = PROJECT / "cases" / "signals" / "transport.csv"
    (folder / "signals").mkdir()
    path, record = folder / "case.toml", folder / "signals" / signal.name
    path.write_bytes((PROJECT / "cases" / "recorded.toml").read_bytes())
    lines = signal.read_bytes().splitlines(keepends=True)
    content = b"".join(lines[: chance.choice((6, 9, 40, len(lines)))])
    record.write_bytes(chance.choice((spoil_text, spoil_text, spoil_bytes))(content, chance))
    if chance.random() < 0.05:
        put_in_place(record, folder / "precious", chance)
    keys = ("time_column", "value_column", "time_scale", "scale", "offset", "start", "ramp", "file", "checksum",
            "beyond=zero", "beyond=repeat", "interpolation=monotone", "quantity=displacement")  # fmt: skip
    texts = [
        f"load.base.{key}" if "=" in key else f"load.base.{key}={chance.choice((*NUMBERS, *WORDS))}"
        for key in chance.sample(keys, chance.choice((0, 1, 1, 2)))
    ]
    return lambda: _read_case(path, texts)


def _check(seeds: Path, folder: Path, chance: random.Random) -> Work:  # noqa: ARG001
    """Check a case with absurd values, most of which are valid."""
    places = (
        "beam.length", "beam.thickness", "beam.width", "material.young_modulus", "material.density",
        "material.poisson_ratio", "support.length", "support.clearance", "restraint.axial", "mesh.size",
        "mesh.support_size", "contact.stiffness", "load.shaker.amplitude", "load.shaker.frequency", "load.shaker.point",
        "time.end", "time.step", "damping.ratios", "mesh.dimension", "mesh.cells_through_thickness",
    )  # fmt: skip
    words = []
    for key in chance.sample(places, chance.choice((1, 1, 2, 3))):
        value = f"{chance.choice((1.0, -1.0, 3.0))}e{chance.choice((-300, -30, -12, -6, -3, 0, 3, 6, 12, 30, 300))}"
        value = {"damping.ratios": f"[{value}, 0.01]", "mesh.dimension": chance.choice("1234")}.get(key, value)
        words += ["--set", f"{key}={'200' if key.endswith('thickness') and 'mesh' in key else value}"]
    return command("check", PROJECT / "cases" / "demo.toml", *words)


def _cases() -> list[Path]:
    return sorted((PROJECT / "cases").glob("*.toml"))


def _setting(seeds: Path, folder: Path, chance: random.Random) -> Work:  # noqa: ARG001
    from gapbeam.studies.sweep.sweep_plan import Sweep
    from gapbeam.studies.trials.axes import read_axis

    keys = ("support.clearance", "mesh.size", "time.step", "load.shaker.amplitude", "load.0", "contact.formulation",
            "time.scheme.type", "model", "beam", "mesh.file", "load", "", ".", "a.b.c.d", "x" * 3000,
            "load.99999999999.x", "time.end", "output.history_interval", "contact", "probe.tip.point", "title",
            "model.type")  # fmt: skip
    texts = []
    for _ in range(chance.choice((1, 1, 2, 5))):
        text = f"{chance.choice(keys)}={chance.choice((*NUMBERS, *WORDS, '[' * 2000, '{a=1}', '[[1]]'))}"
        if chance.random() < 0.3:
            text = spoil_text(text.encode(), chance).decode("utf-8", errors="replace")
        texts.append(text)
    case = chance.choice(_cases())
    if chance.random() < 0.6:
        return lambda: _read_case(case, texts)
    ends = f"{chance.choice(NUMBERS)}:{chance.choice(NUMBERS)}:{chance.choice(('3', *NUMBERS))}"
    texts[0] = f"{chance.choice(keys)}={ends}"

    def work() -> int:
        axes = tuple(read_axis(text, chance.choice(("log", "linear")), "") for text in texts)  # type: ignore[arg-type]
        Sweep(case, (), axes, zipped=chance.random() < 0.5).points()
        return 0

    return work


def _read_case(path: Path, overrides: list[str]) -> int:
    from gapbeam.solver.case.case import case_to_toml
    from gapbeam.solver.case.checks.case_warnings import warnings
    from gapbeam.solver.case.reading.case_reader import read_case

    case = read_case(path, overrides)
    for warning in warnings(case):
        print(warning)
    text = case_to_toml(case)
    again = path.parent / "again.toml" if path.name == "case.toml" else None
    if again is not None:
        again.write_text(text, encoding="utf-8")
        if read_case(again) != case:
            raise AssertionError("written and read again, the case is another one")
    return 0


def _identification(seeds: Path, folder: Path, chance: random.Random) -> Work:
    from gapbeam.studies.identification.identification_file import read_identification

    for name in ("identify.toml", "identified-case.toml"):
        shutil.copy(seeds / name, folder / name)
    path = folder / chance.choice(("identify.toml", "identify.toml", "identify.toml", "identified-case.toml"))
    path.write_bytes(spoil_text(path.read_bytes(), chance))
    if chance.random() < 0.03:
        put_in_place(path, folder / "precious", chance)

    def work() -> int:
        read_identification(folder / "identify.toml")
        return 0

    return work


def _spoil_one(path: Path, precious: Path, chance: random.Random) -> None:
    """Spoil a file of a results folder in the way that suits it."""
    draw = chance.random()
    if draw < 0.05:
        put_in_place(path, precious, chance)
    elif path.suffix == ".h5" and draw < 0.6:
        spoil_hdf5(path, chance)
    elif path.suffix in TEXTS:
        path.write_bytes(TEXTS[path.suffix](path.read_bytes(), chance))
    else:
        path.write_bytes(spoil_bytes(path.read_bytes(), chance))


def _spoiled_folder(seeds: Path, kind: str, folder: Path, chance: random.Random, *names: str) -> Path:
    """Copy a results folder and spoil one or two of its files."""
    copy = folder / kind
    shutil.copytree(seeds / kind, copy)
    for name in dict.fromkeys(chance.choice(names) for _ in range(chance.choice((1, 1, 1, 2)))):
        if (copy / name).is_file():
            _spoil_one(copy / name, folder / "precious", chance)
    if chance.random() < 0.03:
        for name in ("figures", "pictures", "report.html", "summary.json.part"):
            (copy / name).symlink_to(folder / "precious" / chance.choice(("", "secret", "not-there")))
    return copy


RUN = (*("history.h5",) * 3, *("summary.json",) * 2, "case.toml", "fields.xdmf", "fields.h5")


def _analysis(seeds: Path, folder: Path, chance: random.Random) -> Work:
    copy = _spoiled_folder(seeds, "run", folder, chance, *RUN)

    def work() -> int:
        from gapbeam.postprocess.results.bounded_files import as_written
        from gapbeam.postprocess.results.results import open_results
        from gapbeam.postprocess.signals.probe_analysis import Options, analyze, as_data, as_text

        with as_written(copy):
            results = open_results(copy)
            analysis = analyze(results, Options())
            as_text(analysis, results.title)
            as_data(analysis)
            with results.fields() as fields:
                for _ in fields:
                    pass
        return 0

    return work


def _of_run(*words: str) -> Callable[[Path, Path, random.Random], Work]:
    def spoil(seeds: Path, folder: Path, chance: random.Random) -> Work:
        copy = _spoiled_folder(seeds, "run", folder, chance, *RUN)
        return command(*words, copy)

    return spoil


def _compare(seeds: Path, folder: Path, chance: random.Random) -> Work:
    copy = _spoiled_folder(seeds, "run", folder, chance, *RUN[:6])
    pair = [copy, seeds / "other"]
    chance.shuffle(pair)
    return command("compare", *pair, "--output", folder / "out")


STUDIES = {
    "sweep": ("sweep.json", "sweep.json", "sweep.csv", "census.json"),
    "stability": ("stability.json",),
    "identify": ("identification.json", "identification.json", "evaluations.csv"),
    "compare": ("comparison.json",),
    "tradeoff": ("tradeoff.json",),
}


def _study_report(seeds: Path, folder: Path, chance: random.Random) -> Work:
    kind = chance.choice(sorted(STUDIES))
    copy = _spoiled_folder(seeds, kind, folder, chance, *STUDIES[kind])
    return command("report", copy, "--no-pdf", *(("--overwrite",) if chance.random() < 0.5 else ()))


def _sweep_again(seeds: Path, folder: Path, chance: random.Random) -> Work:
    copy = _spoiled_folder(seeds, "sweep", folder, chance, "plan.json", "points/000000.json", "points/000001.json")
    (copy / "points" / chance.choice(("x.json", "-1.json", "000000.json.part", "000007.json"))).write_bytes(b"{}")

    def work() -> int:
        from gapbeam.postprocess.results.bounded_files import as_written
        from gapbeam.postprocess.study_figures.sweep_branches import census
        from gapbeam.solver.messages.errors import CaseError
        from gapbeam.studies.study_folder import study_folder
        from gapbeam.studies.sweep.sweep_plan import Sweep, finished, plan_of, prepare, read_points
        from gapbeam.studies.sweep.sweep_tables import write_tables
        from gapbeam.studies.trials.axes import read_axis

        sweep = Sweep(STABILITY, QUICK, (read_axis("support.clearance=0.05e-3,0.1e-3", "linear", ""),))
        subjects = [entry for entry in read_points(sweep).values() if not isinstance(entry, CaseError)]
        with study_folder(copy, plan=plan_of(sweep, subjects, False)), as_written(copy):
            prepare(sweep, copy)
            records = [record for _, record in sorted(finished(copy).items())]
            write_tables(copy, records, census(records, sweep.tolerance))
        return 0

    return work


def _identify_again(seeds: Path, folder: Path, chance: random.Random) -> Work:
    copy = _spoiled_folder(seeds, "identify", folder, chance, "plan.json", "case.toml", *["evaluations.jsonl"] * 3)

    def work() -> int:
        from gapbeam.studies.engine.study_engine import Engine
        from gapbeam.studies.engine.workers import Workers
        from gapbeam.studies.identification.evaluations import Evaluations, plan_of
        from gapbeam.studies.identification.identification_file import read_identification
        from gapbeam.studies.identification.misfit import Misfit
        from gapbeam.studies.study_folder import study_folder

        problem = read_identification(seeds / "identify.toml")
        with study_folder(copy, plan=plan_of(problem, False)), Engine(Workers(1)) as engine:
            evaluations = Evaluations(problem, copy, engine)
            if len(evaluations.records) >= len(problem.experiments):
                Misfit(problem, evaluations)
        return 0

    return work


def _mesh(seeds: Path, folder: Path, chance: random.Random) -> Work:
    path = folder / "mesh.msh"
    content = (seeds / chance.choice(("text.msh", "binary.msh", "old.msh"))).read_bytes()
    path.write_bytes(chance.choice((spoil_bytes, spoil_text))(content, chance))
    if chance.random() < 0.05:
        put_in_place(path, folder / "precious", chance)

    def work() -> int:
        from mpi4py import MPI

        from gapbeam.meshes.beam_geometry import BeamGeometry
        from gapbeam.meshes.user_mesh.user_mesh import read_mesh

        read_mesh(MPI.COMM_SELF, path, BeamGeometry(2, 0.51, 0.012, 0.02, 0.05))
        return 0

    return work


TARGETS = (
    Target("case files", 20.0, _case, quotes=True),
    Target("--set and swept keys", 10.0, _setting, quotes=True),
    Target("records of loads", 10.0, _record, quotes=True),
    Target("gapbeam check of absurd values", 1.5, _check, Limits(180.0, 8 * 2**30)),
    Target("identification files", 10.0, _identification, quotes=True),
    Target("results: records, tables, fields", 24.0, _analysis),
    Target("gapbeam plot", 1.0, _of_run("plot"), Limits(60.0)),
    Target("gapbeam report of a run", 4.0, _of_run("report", "--no-pdf"), Limits(60.0)),
    Target("gapbeam render", 0.5, _of_run("render", "--no-film"), Limits(120.0, 4 * 2**30)),
    Target("gapbeam compare", 3.0, _compare, Limits(60.0)),
    Target("gapbeam report of studies", 12.0, _study_report, Limits(60.0)),
    Target("sweep taken up again", 5.0, _sweep_again),
    Target("identify taken up again", 5.0, _identify_again),
    Target("mesh files", 4.0, _mesh, Limits(60.0, 12 * 2**30)),
    Target("checkpoints, runs resumed", 12.0, checkpoint_targets.checkpoints, Limits(20.0, 4 * 2**30)),
    Target("results beside checkpoints, runs resumed", 6.0, checkpoint_targets.beside, Limits(20.0, 4 * 2**30)),
)
