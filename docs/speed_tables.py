"""Put the tables that `make bench` wrote into docs/speed.md and docs/scaling.md, each between its marks.

Run it with: environment/run python3 docs/speed_tables.py [results/bench]
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

PAGES = [Path(__file__).parent / name for name in ("speed.md", "scaling.md")]


def filled(page: str, folder: Path) -> str:
    """Return the page with `<!-- NAME --> ... <!-- /NAME -->` taken from NAME.md, where there is one."""

    def table(found: re.Match[str]) -> str:
        source = folder / f"{found[1]}.md"
        if not source.is_file():
            return found[0]
        _, _, text = source.read_text(encoding="utf-8").partition("\n")  # without its heading
        return f"<!-- {found[1]} -->\n{text.strip()}\n<!-- /{found[1]} -->"

    return re.sub(r"<!-- (\w+) -->\n.*?<!-- /\1 -->", table, page, flags=re.DOTALL)


if __name__ == "__main__":
    chosen = Path(sys.argv[1] if len(sys.argv) > 1 else "results/bench")
    for page in PAGES:
        page.write_text(filled(page.read_text(encoding="utf-8"), chosen), encoding="utf-8")
