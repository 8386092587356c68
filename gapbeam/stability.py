"""The command `gapbeam stability`."""

from __future__ import annotations

import csv
import json
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress

from solver.output.folder import write_beside

SCHEMES = "discrete-gradient,implicit-midpoint,newmark,hht-alpha,generalized-alpha"


def stability(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")],
    stiffness: Annotated[str, typer.Option(help="contact stiffness, Pa/m: a,b,c or first:last:count")] = "1e10:1e16:4",
    step: Annotated[str, typer.Option(help="time step, s: a,b,c or first:last:count")] = "1e-5:1e-3:3",
    scheme: Annotated[str, typer.Option(help="schemes, by name")] = SCHEMES,
    vary: Annotated[list[str] | None, typer.Option(metavar="KEY=VALUES", help="any other key; may be repeated")] = None,
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-stability")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="processes; by default one a core")] = None,
) -> int:
    """Run a case over a grid of stiffness, step and scheme, and draw where it can be trusted."""
    from gapbeam.study_folder import study_folder
    from postprocess.stability_map import QUANTITIES, draw_stability_map
    from solver.studies.axes import read_axis
    from solver.studies.grid import run_grid, table

    grid = [f"contact.stiffness={stiffness}", f"time.step={step}", f"time.scheme={scheme}", *(vary or [])]
    axes = [read_axis(text) for text in grid]
    folder = output if output is not None else Path("results") / f"{case.stem}-stability"
    with study_folder(folder):
        console = Console(stderr=True)
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("trials", total=None)
            rows = run_grid(
                case, override or [], axes, jobs, lambda done, total: progress.update(task, completed=done, total=total)
            )
        records = table(rows, axes)
        write_beside(folder / "stability.json", json.dumps(records, indent=1) + "\n")
        _write_csv(folder / "stability.csv", records)
        pictures = [folder / f"stability-{name}.png" for name in QUANTITIES]
        for picture, quantity in zip(pictures, QUANTITIES.values(), strict=True):
            draw_stability_map(records, picture, shown=quantity)
    for name in axes[2].values:
        mine = [record for record in records if record["time.scheme"] == name]
        counts = Counter(record["verdict"] for record in mine)
        told = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
        residuals = [abs(record["residual"]) for record in mine if record["verdict"] == "passed"]
        worst = f"; largest residual of those that passed {max(residuals):.1e}" if residuals else ""
        print(f"{name}: {told}{worst}")
    print(*pictures, sep="\n")
    return 0


def _write_csv(path: Path, records: list[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(records[0]))
        writer.writeheader()
        writer.writerows(records)
