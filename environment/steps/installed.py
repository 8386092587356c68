"""Make a checkout look installed: the metadata for `importlib.metadata`, and the lists of what it needs.

A checkout is used in place (PYTHONPATH), so nothing has to be installed again when another one is used.

Usage: installed.py PROJECT FOLDER
"""

import sys
import tomllib
from pathlib import Path

project, folder = (Path(argument) for argument in sys.argv[1:])
about = tomllib.loads((project / "pyproject.toml").read_text())["project"]

needs = list(about.get("dependencies", []))
extras = about.get("optional-dependencies", {})
lists = {"needs-base": list(needs)}
for listed in extras.values():
    needs += [need for need in listed if not need.startswith(("dolfinx", about["name"]))]  # which the environment has
lists["needs-wheel"] = [need for need in [*needs, *extras["fem"]] if need not in extras["workers"]]

metadata = folder / f"{about['name']}-{about['version']}.dist-info"
metadata.mkdir(parents=True, exist_ok=True)
(metadata / "METADATA").write_text(
    f"Metadata-Version: 2.1\nName: {about['name']}\nVersion: {about['version']}\n"
    + "".join(f"Requires-Dist: {need}\n" for need in needs)
)
for name, listed in (lists | {"needs": needs}).items():
    (folder / f"{name}.txt").write_text("".join(f"{need}\n" for need in listed))
