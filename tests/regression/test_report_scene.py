"""The moving scene of a report in a headless Chromium: drawn, played, turned and followed by the charts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

from gapbeam.postprocess.report.html_page import html_of, write_html
from gapbeam.postprocess.report.pdf_page import OPTIONS, find_browser
from tests.regression.test_postprocess_plot import sine_records
from tests.shared.command import alone
from tests.shared.processes import until
from tests.shared.reports import report_on
from tests.unit.test_contact_maps import COLLAR, PERIOD, collar_pressure, pressed_run, stop_pressure
from tests.unit.test_moving_scene import planar_run, tube
from tests.unit.test_postprocess_synthetic import write_fields, write_results

pytestmark = alone  # a browser for every rank would be too many

SHADES = """(canvas) => {
  const copy = document.createElement("canvas");
  Object.assign(copy, { width: canvas.width, height: canvas.height });
  const pen = copy.getContext("2d");
  pen.drawImage(canvas, 0, 0);
  const data = pen.getImageData(0, 0, copy.width, copy.height).data, found = new Set();
  for (let k = 0; k < data.length; k += 4) {
    if (data[k + 3] > 200) found.add((data[k] << 16) | (data[k + 1] << 8) | data[k + 2]);
  }
  return found.size;
}"""
COLORED = """(canvas) => {
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data, found = [];
  for (let k = 0; k < data.length; k += 4) {
    const column = (k / 4) % canvas.width, row = Math.floor(k / 4 / canvas.width);
    if (column < 0.75 * canvas.width && data[k] - data[k + 2] > 100) found.push(row);
  }
  return found;
}"""  # rows of what is yellow to red, left of the scale
PHONE = {"width": 360, "height": 800}
LARGEST = 2e6  # bytes of a scene of 51 fields, and of its scripts


def spatial_run(folder: Path) -> Path:
    """Write a run of a tube whose sections go round in circles of 1 mm at 20 Hz."""
    time = np.linspace(0.0, 0.5, 501)
    phase = 2.0 * np.pi * 20.0 * time
    circle = 1e-3 * np.stack([np.zeros_like(time), np.cos(phase), np.sin(phase)], axis=1)[:, None, :]
    write_results(folder, time, sine_records(time) | {"displacement": circle}, dimension=3)
    points = tube(9)
    cells = []
    for k in range(8):
        for n in range(0, 12, 3):
            corners = [12 * k + n, 12 * k + (n + 1) % 12, 12 * k + (n + 2) % 12, 12 * k + (n + 3) % 12]
            cells.append([*corners, *(number + 12 for number in corners)])
    frames = [
        (time[k], np.tile(circle[k], (len(points), 1)), np.zeros(len(points))) for k in range(0, 501, 10)
    ]  # fmt: skip
    write_fields(folder, points, np.array(cells), "Hexahedron", frames)
    return folder


RUNS = {"slice": planar_run, "tube": spatial_run, "pressed": pressed_run}


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the reports on a slice, on a tube, and on a tube with contact pressures."""
    folder = tmp_path_factory.mktemp("scene")
    runs = {name: write(folder / name) for name, write in RUNS.items()}
    return {name: write_html(report_on([run], "c"), folder / f"{name}.html") for name, run in runs.items()}


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    """Return what drives browsers."""
    with sync_playwright() as driver:
        yield driver


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """Return a browser; without one the tests fail, as the environment provides it."""
    running = playwright.chromium.launch(executable_path=find_browser(), args=list(OPTIONS[1:]))
    yield running
    running.close()


def opened(browser: Browser, path: Path, shown: list[str], **options: object) -> Page:
    """Open a page on which nothing starts by itself; complaints go to `shown`."""
    page = browser.new_context(reduced_motion="reduce", **options).new_page()  # type: ignore[arg-type]
    page.on("console", lambda message: shown.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: shown.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_selector(".scene[data-painter]")
    until(lambda: page.evaluate("window.gapbeam.scenes.length === 1"), "the scene has come as far")
    return page


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("width", [360, 1400])
def test_scene_is_drawn_and_the_page_fits(browser: Browser, pages: dict[str, Path], width: int) -> None:
    """Light and dark: the canvas shows shaded surfaces, nothing is wider than the page, and no script complains."""
    shown: list[str] = []
    for name, path in pages.items():
        page = opened(browser, path, shown, viewport={"width": width, "height": 800})
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
            page.evaluate("window.gapbeam.scenes[0].draw(false)")
            assert page.locator(".stage canvas").evaluate(SHADES) > 5, (name, scheme)
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), (name, scheme)
        assert page.locator(".modebar").count() == 0
        page.context.close()
    assert shown == []


@pytest.mark.slow(minutes=0.1)
def test_charts_follow_the_scene_and_set_its_time(browser: Browser, pages: dict[str, Path]) -> None:
    """The dot of the orbit and the line over time stand where the slider is; play goes on and space stops it."""
    shown: list[str] = []
    page = opened(browser, pages["tube"], shown, viewport={"width": 1400, "height": 800})
    page.locator("#orbits summary").click()
    page.locator("#orbits figure").scroll_into_view_if_needed()
    page.wait_for_selector("#orbits .dot")
    for frame in (1, 2):
        page.locator('[data-part="time"]').evaluate(
            "(one, frame) => { one.value = frame; one.dispatchEvent(new Event('input')); }", frame
        )
        assert page.evaluate("window.gapbeam.scenes[0].state.frame") == frame
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        place = page.evaluate(
            "(() => { const { xaxis, yaxis } = document.querySelector('#orbits .plot')._fullLayout;"
            "const at = new DOMMatrix(getComputedStyle(document.querySelector('#orbits .dot')).transform);"
            "return [xaxis.p2c(at.e - xaxis._offset), yaxis.p2c(at.f - yaxis._offset)]; })()"
        )
        phase = 2.0 * np.pi * 20.0 * 0.01 * frame
        assert place == pytest.approx([np.cos(phase), np.sin(phase)], abs=0.02)
    page.locator("#motion figure").first.scroll_into_view_if_needed()
    page.wait_for_selector("#motion .at")
    page.evaluate("window.gapbeam.clock.set(0.25, null)")
    assert page.evaluate("window.gapbeam.scenes[0].state.frame") == 25
    canvas = page.locator(".stage canvas")
    canvas.focus()
    page.keyboard.press(".")
    assert page.evaluate("window.gapbeam.scenes[0].state.frame") == 26
    before = page.evaluate("[...window.gapbeam.scenes[0].state.turn]")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("[...window.gapbeam.scenes[0].state.turn]") != before
    page.keyboard.press(" ")
    until(lambda: page.evaluate("window.gapbeam.scenes[0].state.frame !== 26"), "the scene has come as far")
    page.keyboard.press(" ")
    assert page.locator('[data-part="play"]').inner_text() == "Play"
    assert shown == []
    page.context.close()


@pytest.mark.slow(minutes=0.1)
def test_contact_maps_follow_the_time(browser: Browser, pages: dict[str, Path]) -> None:
    """The page has the pressures of the fields at its time, and the map shows them at their angle, light and dark."""
    shown: list[str] = []
    page = opened(browser, pages["pressed"], shown, viewport={"width": 360, "height": 800})
    place = page.locator(".contact-map")
    labels = [one.get_attribute("aria-label") or "" for one in place.locator("canvas").all()]
    assert [label.split(",")[0] for label in labels] == [
        "Contact pressure of support collar on collar_hole over x",
        "Contact pressure of support stop on stop_below and stop_above over x",
    ]
    for scheme, frame in (("light", 0), ("dark", 10), ("light", 31)):
        time = 0.01 * frame
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
        page.evaluate("(time) => window.gapbeam.clock.set(time, null)", time)
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        (hole,), (below, above) = page.evaluate(
            "(frame) => window.gapbeam.scenes[0].maps.faces.map((faces) => faces.map((face) =>"
            "({ x: face.x, angles: face.angles, values: [...face.at(frame)] })))",
            frame,
        )
        expected = 1e-6 * collar_pressure(1e-3 * np.array(hole["x"]), np.array(hole["angles"]), time)
        assert hole["values"] == pytest.approx(expected, abs=1e-4)
        assert below["values"] == pytest.approx(1e-6 * stop_pressure(1e-3 * np.array(below["x"]), time), abs=1e-4)
        assert not any(above["values"])
        assert place.nth(0).locator('[data-part="most"]').inner_text() == f"largest {expected.max():.3g} MPa"
        rows, box = place.nth(0).locator("canvas").evaluate(COLORED), place.nth(0).locator("canvas").bounding_box()
        assert box is not None
        assert box["x"] + box["width"] <= 360.0
        angle = 180.0 - 360.0 * (np.mean(rows) - 22.0) / (box["height"] - 22.0 - 36.0)
        assert angle == pytest.approx((360.0 * time / PERIOD + 180.0) % 360.0 - 180.0, abs=4.0)
        assert place.nth(1).locator("canvas").evaluate(SHADES) > 2
    most = place.nth(0).locator('[data-part="most"]')
    shown_last, on_paper = most.inner_text(), f"largest {1e-6 * collar_pressure(np.array(COLLAR[1]), 0.0, 0.0):.3g} MPa"
    page.evaluate("window.gapbeam.scenes[0].toPaper(); window.gapbeam.scenes[0].draw(false)")
    assert most.inner_text() == on_paper
    page.evaluate("window.gapbeam.scenes[0].toScreen()")
    assert most.inner_text() == shown_last != on_paper
    page.context.close()
    assert 'class="contact-map"' not in pages["slice"].read_text(encoding="utf-8")
    assert shown == []


@pytest.mark.slow(minutes=0.1)
def test_gaps_grow_with_the_magnification(browser: Browser, pages: dict[str, Path]) -> None:
    """Beam and walls touch in the picture where they touch in the run: the upper wall is at the magnified gap."""
    page = opened(browser, pages["slice"], [], viewport={"width": 800, "height": 600})
    for factor in (1.0, 40.0):
        low = page.evaluate(
            "(scale) => { const parts = window.gapbeam.scenes[0].model.placed(0, scale), places = parts[2].positions;"
            "return Math.min(...places.filter((_, k) => k % 3 === 2)); }",
            factor,
        )
        assert low == pytest.approx(0.006 + factor * 1.07e-4, rel=1e-5)
    page.context.close()


@pytest.mark.slow(minutes=0.1)
def test_without_webgl_a_canvas_is_painted(playwright: Playwright, pages: dict[str, Path]) -> None:
    """A browser that may not draw in three dimensions shows the same scene, painted."""
    shown: list[str] = []
    flat = playwright.chromium.launch(executable_path=find_browser(), args=[*OPTIONS[1:], "--disable-3d-apis"])
    page = opened(flat, pages["tube"], shown, viewport={"width": 800, "height": 600})
    assert page.locator(".scene").get_attribute("data-painter") == "canvas"
    assert page.locator(".stage canvas").evaluate(SHADES) > 5
    flat.close()
    assert shown == []


@pytest.mark.slow(minutes=0.1)
def test_motion_is_started_only_where_it_is_welcome(browser: Browser, pages: dict[str, Path]) -> None:
    """By itself where the reader's system allows motion; never where it asks for less; on paper a picture stands."""
    page = opened(browser, pages["slice"], [], viewport={"width": 800, "height": 900})
    page.locator(".stage").scroll_into_view_if_needed()
    assert page.evaluate("window.gapbeam.scenes[0].state.playing") is False
    page.evaluate("window.gapbeam.scenes[0].toPaper()")
    until(lambda: page.evaluate("document.querySelector('.still').naturalWidth > 300"), "the scene has come as far")
    page.context.close()
    lively = browser.new_context(reduced_motion="no-preference", viewport={"width": 800, "height": 900}).new_page()
    lively.goto(pages["slice"].as_uri())
    lively.locator(".stage").scroll_into_view_if_needed()
    until(lambda: lively.evaluate("window.gapbeam.scenes[0].state.playing"), "the scene has come as far")
    lively.context.close()


def test_scene_is_small_and_stands_first(pages: dict[str, Path], tmp_path: Path) -> None:
    """Behind the end of the run and before everything else; what a scene adds to a page is bounded."""
    text = pages["slice"].read_text(encoding="utf-8")
    assert text.index('class="verdict') < text.index('<figure class="scene"') < text.index("<table")
    assert text.index('id="energy"') < text.index('id="case"')
    time = np.linspace(0.0, 0.5, 501)
    bare = html_of(report_on([write_results(tmp_path / "bare", time, sine_records(time))], "c"))
    assert bare.index('class="verdict') < bare.index('<figure class="scene resting"') < bare.index("<table")
    assert "scene resting" not in text.split("<body")[1]
    assert 0 < len(text) - len(bare) < LARGEST


@pytest.mark.slow(minutes=0.1)
def test_a_run_without_fields_has_a_still_scene(browser: Browser, tmp_path: Path) -> None:
    """It is drawn, turned and magnified, light and dark; nothing plays, and the charts have no time of their own."""
    time, shown = np.linspace(0.0, 0.5, 501), list[str]()
    folder = write_results(tmp_path / "bare", time, sine_records(time))
    page = opened(browser, write_html(report_on([folder], "c"), tmp_path / "bare.html"), shown, viewport=PHONE)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")  # type: ignore[arg-type]
        page.evaluate("window.gapbeam.scenes[0].draw(false)")
        assert page.locator(".stage canvas").evaluate(SHADES) > 5, scheme
    before = page.evaluate("[...window.gapbeam.scenes[0].state.turn]")
    page.locator(".stage canvas").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press(" ")
    assert page.evaluate("[...window.gapbeam.scenes[0].state.turn]") != before
    assert page.evaluate("window.gapbeam.scenes[0].state.playing") is False
    assert [page.locator(f'[data-part="{name}"]').is_visible() for name in ("play", "time", "speed", "scale")] == [
        False, False, False, True,
    ]  # fmt: skip
    page.locator("#motion figure").first.scroll_into_view_if_needed()
    page.wait_for_selector("#motion .plot .main-svg")
    assert page.locator("#motion .at").count() == 0
    page.evaluate("window.gapbeam.scenes[0].toPaper()")
    until(lambda: page.evaluate("document.querySelector('.still').naturalWidth > 300"), "the scene has come as far")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.context.close()
    assert shown == []
