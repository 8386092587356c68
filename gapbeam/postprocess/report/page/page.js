"use strict";
(() => {
  const { numbersOf, clock, scenes } = window.gapbeam;
  const specs = JSON.parse(document.getElementById("figures").textContent);
  const root = document.documentElement;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const coarse = window.matchMedia("(pointer: coarse)").matches;
  // On paper: A4 between its margins, 178 mm at 96 dots per inch; up to three panels side by side.
  const PAPER = { 1: { width: 672, height: 290 }, 2: { width: 330, height: 215 }, 3: { width: 216, height: 170 } };
  // Colors that would not be seen on a dark page.
  const BRIGHTER = { "#000000": "#eceff1", "#0072B2": "#56B4E9", "#56B4E9": "#9ad7ff", "#D55E00": "#ff8d3b",
                     "#009E73": "#35c99b", "#9A9A9A": "#a8b0b8" };

  const onPaper = () => root.classList.contains("paper");
  const copy = (thing) => JSON.parse(JSON.stringify(thing));

  function tinted(traces) {
    if (onPaper() || !dark.matches) return traces;
    for (const trace of traces) {
      for (const part of [trace.line, trace.marker]) {
        if (part && BRIGHTER[part.color]) part.color = BRIGHTER[part.color];
      }
    }
    return traces;
  }

  function themed(layout, size) {
    const style = getComputedStyle(root);
    const of = (name) => style.getPropertyValue(name).trim();
    const font = { family: of("--sans"), size: size || (window.innerWidth < 560 ? 12 : 13), color: of("--ink") };
    const title = { size: font.size };
    const axis = { gridcolor: of("--grid"), linecolor: of("--rule"), tickcolor: of("--rule") };
    Object.assign(layout, { font, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", autosize: true,
                            dragmode: coarse ? false : "zoom" });
    layout.hoverlabel = { bgcolor: of("--raised"), bordercolor: of("--rule"), font };
    for (const name of ["xaxis", "yaxis"]) {
      if (layout[name]) Object.assign(layout[name], axis).title.font = title;
    }
    return layout;
  }

  function drawChart(plot, spec, choice, size) {
    const traces = tinted(copy(spec.data));
    for (const trace of traces) trace.visible = trace.meta == null || trace.meta === choice;
    const layout = themed(copy(spec.layout), size && size.font);
    if (size) {
      Object.assign(layout, { width: size.width, height: size.height, autosize: false });
      layout.showlegend = layout.showlegend && size.legend;
    }
    const still = onPaper();
    if (!still && window.innerWidth < 560) {  // a legend of many lines takes no room from the curves
      const names = new Set(traces.filter((trace) => trace.visible).map((trace) => trace.name));
      plot.style.height = `${300 + 21 * Math.max(0, layout.showlegend ? names.size - 2 : 0)}px`;
    }
    Plotly.react(plot, still ? traces.filter((trace) => trace.visible) : traces, layout, {
      responsive: !still, staticPlot: still, displaylogo: false, displayModeBar: false, doubleClick: "reset",
    });
    if (!still && plot.dataset.drawn === undefined) plot.on("plotly_click", (event) => tellPicked(plot, event.points[0]));
    plot.dataset.drawn = choice ?? "";
    if (!still) clock.follow(plot, spec, choice);
  }

  // The text of a point stays below the chart once it is clicked or touched.
  function tellPicked(plot, point) {
    const plain = (html) => new DOMParser().parseFromString(html.replaceAll("<br>", "\n"), "text/html").body.textContent;
    const axis = (name) => plain(plot._fullLayout[name].title.text);
    const text = point.text ?? `${axis("xaxis")}: ${Number(point.x.toPrecision(5))}, ${axis("yaxis")}: ${Number(point.y.toPrecision(5))}`;
    plot.parentElement.querySelector(".picked").textContent = `${plain(point.data.name)}\n${plain(String(text))}`;
  }

  function chosen(figure) {
    const pressed = figure.querySelector('.choices button[aria-pressed="true"]');
    return pressed ? pressed.dataset.choice : null;
  }

  function drawOnScreen(figure) {
    drawChart(figure.querySelector(".plot"), specs[figure.dataset.figure], chosen(figure), null);
  }

  function drawOnPaper(figure) {
    const plot = figure.querySelector(".plot");
    Plotly.purge(plot);
    const spec = specs[figure.dataset.figure];
    const buttons = [...figure.querySelectorAll(".choices button")];
    plot.style.display = "none";
    const panels = made("div", "panels");
    const columns = Math.min(3, Math.max(1, Math.ceil(Math.sqrt(buttons.length))));
    if (buttons.length && spec.layout.showlegend) panels.append(legendOf(spec));
    for (const button of buttons.length ? buttons : [null]) {
      const panel = made("div", "panel");
      if (button) {
        const of = figure.querySelector(".choices .of");
        panel.append(made("p", "head", [of && of.textContent, button.textContent].filter(Boolean).join(": ")));
      }
      const place = made("div", "");
      panel.append(place);
      panels.append(panel);
      drawChart(place, spec, button ? button.dataset.choice : null, { ...PAPER[columns], font: columns > 2 ? 10 : 11, legend: !button });
    }
    figure.prepend(panels);
  }

  function made(element, name, text) {
    const one = document.createElement(element);
    one.className = name;
    if (text) one.textContent = text;
    return one;
  }

  // One legend for all panels of a figure on paper.
  function legendOf(spec) {
    const legend = made("p", "legend");
    const listed = new Set();
    for (const trace of spec.data) {
      if (listed.has(trace.legendgroup)) continue;
      listed.add(trace.legendgroup);
      const key = made("span", `key ${trace.mode}`);
      key.style.setProperty("--color", trace.mode === "lines" ? trace.line.color : trace.marker.color);
      key.style.setProperty("--stroke", (trace.line && trace.line.dash !== "solid" && trace.line.dash) ? "dashed" : "solid");
      const entry = made("span", "entry");
      entry.append(key);
      entry.insertAdjacentHTML("beforeend", trace.name);
      legend.append(entry);
    }
    return legend;
  }

  const charts = [...document.querySelectorAll("[data-figure]")];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting || onPaper()) continue;
      seen.unobserve(entry.target);
      drawOnScreen(entry.target);
    }
  }, { rootMargin: "800px 0px" });

  function toScreen() {
    root.classList.remove("paper");
    for (const scene of scenes) scene.toScreen();
    for (const figure of charts) {
      figure.querySelector(".panels")?.remove();
      figure.querySelector(".plot").style.display = "";
      seen.observe(figure);
    }
  }

  function toPaper() {
    root.classList.add("paper");
    for (const scene of scenes) scene.toPaper();
    for (const details of document.querySelectorAll("details")) details.open = true;
    for (const figure of charts) {
      seen.unobserve(figure);
      drawOnPaper(figure);
    }
  }

  function asCsv(spec) {
    const quoted = (text) => `"${String(text).replaceAll('"', '""')}"`;
    const rows = [["choice", "curve", spec.layout.xaxis.title.text, spec.layout.yaxis.title.text].map(quoted).join(",")];
    for (const trace of spec.data) {
      const x = numbersOf(trace.x), y = numbersOf(trace.y);
      for (let i = 0; i < x.length; i += 1) {
        rows.push([quoted(trace.meta ?? ""), quoted(trace.name), Number(x[i].toPrecision(7)), Number(y[i].toPrecision(7))].join(","));
      }
    }
    return rows.join("\r\n") + "\r\n";
  }

  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    const figure = button.closest("[data-figure]");
    if (button.dataset.choice !== undefined) {
      for (const one of figure.querySelectorAll(".choices button")) one.setAttribute("aria-pressed", String(one === button));
      figure.querySelector(".picked").textContent = "";
      drawOnScreen(figure);
    } else if (button.dataset.does === "csv") {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([asCsv(specs[figure.dataset.figure])], { type: "text/csv" }));
      link.download = `${figure.id}.csv`;
      link.click();
      URL.revokeObjectURL(link.href);
    } else if (button.dataset.does === "copy") {
      navigator.clipboard?.writeText(button.parentElement.querySelector("code").textContent).then(() => {
        button.textContent = "Copied";
        setTimeout(() => { button.textContent = "Copy"; }, 1500);
      });
    }
  });

  dark.addEventListener("change", () => {
    for (const figure of charts) if (figure.querySelector(".plot").dataset.drawn !== undefined && !onPaper()) drawOnScreen(figure);
  });
  const unfold = () => {
    const found = document.getElementById(location.hash.slice(1))?.querySelector(":scope > details.folded");
    if (found) { found.open = true; found.scrollIntoView(); }
  };
  window.addEventListener("hashchange", unfold);
  unfold();
  window.addEventListener("beforeprint", () => { if (!onPaper()) toPaper(); });
  window.addEventListener("afterprint", () => { if (location.hash !== "#print") toScreen(); });
  if (location.hash === "#print") toPaper();
  else {
    document.querySelector(".contents details").open = window.innerWidth >= 1216;
    toScreen();
  }
})();
