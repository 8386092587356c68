"""The page and the PDF of a report in a headless Chromium: what a reader sees, clicks and prints."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Playwright, Position, expect, sync_playwright
from pypdf import PdfReader

import gapbeam as gb
from gapbeam.postprocess.report import html_page
from gapbeam.postprocess.report.blocks import (
    Block,
    Command,
    Listing,
    LiveModel,
    Picture,
    Report,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.html_page import html_of, write_html
from gapbeam.postprocess.report.pdf_page import OPTIONS, BrowserError, find_browser, write_pdf
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.kernel.kernel_data import kernel_data
from tests.shared.command import alone
from tests.shared.processes import LONGEST, until

pytestmark = alone  # a browser for every rank would be too many
CLEARANCES = ("0.000", "0.021", "0.107", "0.243")
PHONE = {"width": 360, "height": 740}


def points(choice: str) -> int:
    """Return how many points the curve of a clearance has: another number for each."""
    return 11 + 3 * CLEARANCES.index(choice)


def sample() -> Report:
    """Return a report with every kind of block, and texts that would break a page."""
    curves = [
        ChartCurve(
            "smoothed <mean>", np.arange(points(name)), np.arange(points(name)) ** 2.0, "lines+markers", choice=name
        )
        for name in CLEARANCES
    ]
    curves.append(ChartCurve("paper", [0.0, 10.0], [1.0, 50.0], "lines", dashed=True))
    spectrum = Chart(
        "Spectrum", "frequency (Hz)", "amplitude (g)", [ChartCurve("a", [20, 40], [1.0, 0.1], "markers")], log_y=True
    )
    wide = [[name, *(1.0 / (n + 3) for n in range(9))] for name in CLEARANCES]
    stiffness = np.logspace(2.0, 8.0, 21)
    heights = np.tanh(np.log10(stiffness) - 5.0)
    return Report(
        "Beam & support <test>",
        "four clearances",
        [
            ReportSection("Summary", "summary", [
                Verdict("error", "**The scheme created 2.3 J.**"),
                Words("Set `time.step`; <script>window.broken = true</script> ![x](https://example.org/x.png)"),
                TableBlock("Roots", ["", "paper", "gapbeam", "note"],
                           [["first (Hz)", 47.38, 47.18, "−0.42 %"], ["no", None, 2.0, "compliant"]]),
                Command("gapbeam run cases/demo.toml"),
            ]),
            ReportSection("Motion", "motion", [
                Chart("Acceleration", "time (ms)", "acceleration (g)", curves, "gapbeam sweep", choices=CLEARANCES,
                      choice="clearance (mm)"),
                ReportSection("Spectrum", "spectrum", [spectrum]),
                TableBlock("Wide", ["clearance", *(f"harmonic {n} of a long name (mm)" for n in range(1, 10))], wide),
            ]),
            ReportSection("Roots", "roots", [
                Chart("Root", "k1 (N/m)", "root", [ChartCurve("root", stiffness, heights)], log_x=True),
                TableBlock("Values", ["key", "value", "unit", "reason"],
                           [["contact.stiffness", 2.1e14, "Pa/m", "5 E/h: stiff beside the body, more than needed"]]),
                Listing("The case", "[beam]\nlength = 0.51 # </pre><b>\n" + "x = 1\n" * 150),
            ]),
        ],
        {"results": "results/sweep"},
    )  # fmt: skip


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the page of the sample report."""
    return write_html(sample(), tmp_path_factory.mktemp("report") / "report.html")


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
    """Open a page from its file; complaints and requests go to `reported`."""
    page = browser.new_context(**options).new_page()  # type: ignore[arg-type]
    page.on("console", lambda message: shown.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: shown.append(str(error)))
    page.on("request", lambda request: shown.append(request.url))
    page.goto(path.as_uri())
    page.wait_for_selector("#figure-1 .plot[data-drawn]")
    return page


def curve_shown(page: Page) -> dict[str, list[float]]:
    """Return the heights of every visible curve of the first figure by name."""
    found: dict[str, list[float]] = page.evaluate(
        "Object.fromEntries(document.querySelector('#figure-1 .plot')._fullData"
        ".filter((trace) => trace.visible === true).map((trace) => [trace.name, [...trace.y]]))"
    )
    return found


@pytest.mark.slow(minutes=0.1)
def test_click_on_a_clearance_shows_its_curve(browser: Browser, page_file: Path) -> None:
    """Each button draws the points of its curve and the curve of all choices, and nothing is fetched."""
    shown: list[str] = []
    page = opened(browser, page_file, shown)
    for choice in ("0.000", "0.107", "0.243"):
        page.get_by_role("button", name=choice, exact=True).click()
        marks = page.locator("#figure-1 .scatterlayer path.point")
        assert marks.count() == points(choice)
        assert marks.first.is_visible()
        expected = {"smoothed &lt;mean&gt;": [float(n * n) for n in range(points(choice))], "paper": [1.0, 50.0]}
        assert curve_shown(page) == expected
        pressed = page.locator('#figure-1 button[aria-pressed="true"]')
        assert [pressed.count(), pressed.inner_text()] == [1, choice]
    assert page.locator("#figure-1 .legendtext").all_text_contents() == ["smoothed <mean>", "paper"]
    line = page.locator("#figure-1 .scatterlayer path.js-line").first
    assert line.is_visible()
    assert line.get_attribute("d")
    page.locator("#figure-1 .nsewdrag").click(position=place_of(page, 3))
    assert page.locator("#figure-1 .picked").inner_text() == "smoothed <mean>\ntime (ms): 3, acceleration (g): 9"
    assert shown == [page_file.as_uri()]
    page.context.close()


def place_of(page: Page, number: int) -> Position:
    """Return where a mark of the first figure is within the area of its axes."""
    mark = page.locator("#figure-1 .scatterlayer path.point").nth(number).bounding_box()
    area = page.locator("#figure-1 .nsewdrag").bounding_box()
    assert mark is not None
    assert area is not None
    return {
        "x": mark["x"] + 0.5 * mark["width"] - area["x"],
        "y": mark["y"] + 0.5 * mark["height"] - area["y"],
    }


@pytest.mark.slow(minutes=0.1)
def test_buttons_are_reached_by_keyboard(browser: Browser, page_file: Path) -> None:
    """Focus and the Enter key do what a click does; a chart has a text for those who cannot see it."""
    page = opened(browser, page_file, [])
    page.get_by_role("button", name="0.000", exact=True).focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.locator("#figure-1 .scatterlayer path.point").count() == points("0.021")
    assert "acceleration (g) over time (ms)" in (page.locator("#figure-1 .plot").get_attribute("aria-label") or "")
    assert page.get_by_role("heading", level=1).inner_text() == "Beam & support <test>"
    assert page.get_by_role("heading", level=3).inner_text() == "Spectrum"
    page.context.close()


@pytest.mark.slow(minutes=0.1)
def test_phone(browser: Browser, page_file: Path) -> None:
    """At 360 points of width nothing sticks out but within what scrolls, figures fit, and fingers scroll the page."""
    shown: list[str] = []
    page = opened(browser, page_file, shown, viewport=PHONE, is_mobile=True, has_touch=True, device_scale_factor=2)
    for figure in page.locator("figure").all():
        figure.scroll_into_view_if_needed()
    page.wait_for_selector("#figure-2 .plot[data-drawn]")
    outside = page.evaluate(
        "[...document.querySelectorAll('body *')].filter((one) => !one.closest('.scrolls, pre, .skip, svg') "
        "&& one.getBoundingClientRect().right > innerWidth + 0.5).map((one) => one.outerHTML.slice(0, 80))"
    )
    assert outside == []
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    table = page.locator("#table-2 .scrolls")
    assert table.evaluate("(one) => one.scrollWidth > one.clientWidth && getComputedStyle(one).overflowX === 'auto'")
    few_columns = page.locator("#table-3 .scrolls")
    assert few_columns.evaluate("(one) => one.scrollWidth <= one.clientWidth")
    width = page.locator("#figure-1 svg.main-svg").first.bounding_box()
    assert width is not None
    assert 280 < width["width"] <= PHONE["width"]
    drag = page.locator("#figure-1 .nsewdrag").evaluate("(one) => getComputedStyle(one).touchAction")
    assert "pan-y" in drag
    assert shown == [page_file.as_uri()]
    page.context.close()


@pytest.mark.slow(minutes=0.1)
def test_dark_pages_are_dark_and_their_curves_bright(browser: Browser, page_file: Path) -> None:
    """The colors follow the scheme of the system, also when it changes, and those of the curves too."""
    page = opened(browser, page_file, [], color_scheme="light")
    for scheme, stroke in (("light", "rgb(0, 114, 178)"), ("dark", "rgb(86, 180, 233)")):
        page.emulate_media(color_scheme=scheme)
        color = page.evaluate("getComputedStyle(document.body).backgroundColor")
        shade = sum(map(int, re.findall(r"\d+", color)[:3])) / 3.0
        assert (shade > 200) == (scheme == "light")
        curve = page.locator("#figure-1 path.js-line").first
        expect(curve).to_have_css("stroke", stroke)  # waits: figures are drawn again after the colors change
    page.context.close()


def test_page_is_one_safe_file(page_file: Path) -> None:
    """Texts are escaped, pictures of the network are not taken, and the page is small enough for a phone."""
    text = page_file.read_text(encoding="utf-8")
    head, tail = text.split("<script>", 1)[0], text.rsplit("<script>", 1)[1]
    assert "<script>window.broken" not in text
    assert "&lt;script&gt;window.broken" in head
    assert '<img src="https' not in text
    assert "&lt;/pre&gt;&lt;b&gt;" in head
    assert "content=\"default-src 'none'" in head
    assert 'name="viewport"' in head
    assert "fetch(" not in tail
    assert 4e6 < page_file.stat().st_size < 8e6
    assert text.count("plotly.js v") == 1


def test_numbers_are_text_beside_those_of_the_paper() -> None:
    """Four digits; what is missing is a dash."""
    text = html_of(sample())
    assert re.search(r"first \(Hz\)</td><td[^>]*>47.38</td><td[^>]*>47.18</td><td[^>]*>−0.42 %</td>", text)
    assert re.search(r"no</td><td[^>]*>–</td><td[^>]*>2.000</td><td[^>]*>compliant</td>", text)


@pytest.mark.slow(minutes=0.1)
def test_pdf_has_text_and_a_panel_for_every_clearance(page_file: Path, tmp_path: Path) -> None:
    """A4 pages with the words, the tables, and the axes of drawn figures as text."""
    reader = PdfReader(write_pdf(page_file, tmp_path / "report.pdf"))
    pages = [" ".join(page.extract_text().split()) for page in reader.pages]
    text = " ".join(pages)
    assert 2 <= len(pages) <= 6
    assert all(abs(float(page.mediabox.width) - 595.0) < 2.0 for page in reader.pages)
    for words in (
        "Beam & support <test>",
        "The scheme created 2.3 J.",
        "47.18",
        "−0.42 %",
        "length = 0.51",
        "Table 2.",
    ):
        assert words in text, words
    assert all(f"clearance (mm): {choice}" in text for choice in CLEARANCES)
    assert text.count("acceleration (g)") == len(CLEARANCES)
    assert text.count("frequency (Hz)") == 1
    assert re.search(rf"1 / {len(pages)}", pages[0])
    assert len(reader.outline) > 0
    one = next(number for number, page in enumerate(pages) if "Table 2." in page)
    assert all(choice in pages[one].split("Table 2.")[1] for choice in CLEARANCES)


def test_browser_that_hangs_or_fails_is_ended(page_file: Path, tmp_path: Path) -> None:
    """No report waits for ever, and nothing is left running or lying about."""
    program = tmp_path / "browser"
    calls = [
        ("sleep infinity & echo $! > child; wait", "did not print within", longest)
        for longest in (0.5, 5.0, 50.0, 500.0)
    ]
    for words, message, longest in (*calls, ("echo no screen >&2", "no screen", LONGEST)):
        if longest < LONGEST and (tmp_path / "child").exists():
            continue  # it had the time to start
        program.write_text(f"#!/bin/sh\ncd {tmp_path}\n{words}\n", encoding="utf-8")
        program.chmod(0o755)
        with pytest.raises(BrowserError, match=message):
            write_pdf(page_file, tmp_path / "report.pdf", str(program), longest=longest)
        assert not (tmp_path / "report.pdf").exists()
    child = int((tmp_path / "child").read_text(encoding="utf-8"))
    state = Path(f"/proc/{child}/stat")
    until(lambda: not state.exists() or state.read_text("utf-8").split()[2] == "Z", "the browser's process has ended")


def test_pictures_that_are_not_there(tmp_path: Path) -> None:
    """A missing picture, or one of another kind, is reported with its place."""
    (tmp_path / "film.mp4").write_bytes(b"")
    for name, found in (("none.png", "no such file"), ("film.mp4", "a picture of the kind .mp4")):
        report = Report("r", "", [ReportSection("s", "s", [Picture(tmp_path / name, "a picture")])])
        with pytest.raises(ResultsError, match=found):
            html_of(report)


def test_the_page_has_words_for_every_block_and_refuses_others() -> None:
    """A kind of block that the page does not know is an error, not an empty place."""
    template = Path(html_page.__file__).with_name("page") / "page.html"
    branches = re.findall(r'kind == "(\w+)"', template.read_text(encoding="utf-8"))
    assert sorted(branches) == sorted(kind.__name__ for kind in get_args(Block))
    unknown = ReportSection("New", "new", [object()])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="does not know blocks of the kind object"):
        html_of(Report("Report", "", [unknown]))


@pytest.mark.slow(minutes=0.1)
def test_a_link_unfolds_its_section(browser: Browser, tmp_path: Path) -> None:
    """A folded section is closed until its heading, or a link to it, is chosen; the page holds its words anyway."""
    folded = ReportSection("Margins", "margins", [Words("Deep words")], folded=True)
    report = Report("A run", "", [ReportSection("Summary", "summary", [Words("Short")]), folded])
    file = html_page.write_html(report, tmp_path / "folded.html")
    page = browser.new_page()
    page.goto(file.as_uri())
    expect(page.get_by_text("Deep words")).to_be_hidden()
    page.locator(".contents a[href='#margins']").evaluate("(one) => one.click()")
    expect(page.get_by_text("Deep words")).to_be_visible()
    page.get_by_role("heading", name="Margins").click()
    expect(page.get_by_text("Deep words")).to_be_hidden()


@pytest.mark.slow(minutes=0.1)
def test_a_live_model_is_printed_with_the_whole_of_its_picture(browser: Browser, tmp_path: Path) -> None:
    """Eight periods of the load, in a browser that draws no frame, so that only what paper asks for is marched."""
    body = gb.mass(1.0, stiffness=1e4, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(1e-4), gb.KelvinVoigt(stiffness=1e6), name="stop")
    push = gb.Force(body["at"], gb.sine, amplitude=5.0, frequency=4.0, name="push")
    step, periods = 5e-5, 8 / 4.0
    model = LiveModel(kernel_data(gb.Scene(body, contacts=[stop], loads=[push]), step).as_json(), "A model.")
    path = write_html(Report("A", "", [ReportSection("Try", "live", [model])]), tmp_path / "page.html")
    now = "document.querySelector('figure.live [data-part=now]').textContent"
    for way in ("#print", ""):
        page = browser.new_context().new_page()
        page.add_init_script("window.requestAnimationFrame = () => 0")
        page.goto(path.as_uri() + way)
        page.wait_for_function(f"{now}.startsWith('t =')")
        if not way:
            assert page.evaluate(now) != f"t = {periods:g} s"
            page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
        assert page.evaluate(now) == f"t = {periods:g} s"
        page.context.close()
