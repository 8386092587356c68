"""Run the scenes of the gallery, draw them, and write docs/gallery.md.

environment/run python3 -m docs.gallery              all scenes: a quarter of an hour on a free core
environment/run python3 -m docs.gallery boom piers   these alone
environment/run python3 -m docs.gallery --forces     print the forces of the short runs, for scenes.toml
environment/run python3 -m docs.gallery --page       write docs/gallery.md from the pictures that are there
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from PIL import Image

import gapbeam
from docs.gallery.gallery_page import write_page
from docs.gallery.gallery_scenes import PROJECT, Scene, scenes

RENDERED = ("largest_contact_force", "largest_displacement")
"""The pictures of `gapbeam render`; the others are figures of `gapbeam plot`."""
SIZE = (1200, 675)
WIDTH = 960
MOST_BYTES = 60_000


def main(words: list[str]) -> int:
    """Draw the scenes that are named, or all."""
    chosen = {word for word in words if not word.startswith("-")}
    known = {scene.name for scene in scenes()}
    if chosen - known or set(words) - chosen - {"--forces", "--page"}:
        print(f"found {' '.join(words)}; expected --forces, --page or some of: {' '.join(known)}", file=sys.stderr)
        return 2
    for scene in scenes():
        if chosen and scene.name not in chosen:
            continue
        if "--forces" in words:
            with tempfile.TemporaryDirectory() as folder:
                print(f"{scene.name}: {scene.measured(Path(folder) / scene.name):.7g}", flush=True)
        elif "--page" not in words:
            draw(scene, PROJECT / "results" / "gallery" / scene.name)
            print(f"{scene.name}: {scene.file.stat().st_size} bytes", flush=True)
    if "--forces" not in words:
        write_page()
    return 0


def draw(scene: Scene, folder: Path) -> None:
    """Run a scene and put its picture, made small, into the repository."""
    scene.run(folder)
    if scene.picture in RENDERED:
        options = {"size": SIZE, **scene.drawn}
        paths = gapbeam.render(folder, film=False, **options)
    else:
        paths = gapbeam.plot(folder, **scene.drawn)
    [path] = [path for path in paths if path.name == f"{scene.picture}.png"]
    shrink(path, scene.file)


def shrink(path: Path, target: Path) -> None:
    """Write a picture of at most 960 pixels across and 60 kB, with as many colors as fit."""
    whole = Image.open(path).convert("RGB")
    small = whole.resize((WIDTH, round(whole.height * WIDTH / whole.width)), Image.Resampling.LANCZOS)
    target.parent.mkdir(exist_ok=True)
    for colors in (128, 64, 32, 16):
        small.quantize(colors, dither=Image.Dither.NONE).save(target, optimize=True)
        if target.stat().st_size <= MOST_BYTES:
            return


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
