"""Put the tables that `make bench` wrote into the pages of docs/benchmarks, each between its marks.

Run it with: environment/run python3 docs/tables/benchmark_tables.py [results/bench]
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from docs.tables.narrow_tables import narrow

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
# Columns at the left that say what a row is, where that takes more than one.
KEYS = {"scaling": 2, "communication": 3, "together": 3, "laws": 2, "many_ranks": 2, "many_ranks_setup": 2}


def filled(page: str, folder: Path) -> str:
    """Return the page with `<!-- NAME --> ... <!-- /NAME -->` taken from NAME.md, where that file exists."""

    def table(found: re.Match[str]) -> str:
        source = folder / f"{found[1]}.md"
        if not source.is_file():
            return found[0]
        _, _, text = source.read_text(encoding="utf-8").partition("\n")  # without its heading
        text = narrow(f"{text.strip()}\n", KEYS.get(found[1], 1))
        return f"<!-- {found[1]} -->\n{text}<!-- /{found[1]} -->"

    return re.sub(r"<!-- (\w+) -->\n.*?<!-- /\1 -->", table, page, flags=re.DOTALL)


if __name__ == "__main__":
    chosen = Path(sys.argv[1] if len(sys.argv) > 1 else "results/bench")
    for page in sorted(BENCHMARKS.glob("*.md")):
        page.write_text(filled(page.read_text(encoding="utf-8"), chosen), encoding="utf-8")
