"use strict";
// The controls of a scene: play, time, speed, magnification, and the view that is turned by mouse, finger and keys.
(() => {
  const { sceneModel, contactMaps, webglPainter, canvasPainter, clock } = window.gapbeam;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const calm = window.matchMedia("(prefers-reduced-motion: reduce)");
  const VIEWS = { side: [0.0, 0.0], oblique: [0.42, 0.3], end: [1.5, 0.08] };
  const PALETTES = {
    light: { beam: [0.45, 0.67, 0.85], wall: [0.78, 0.81, 0.84], outline: [0.1, 0.2, 0.3, 0.55], edges: [0.2, 0.25, 0.3, 0.28], axis: [0.3, 0.35, 0.4, 0.5] },
    dark: { beam: [0.44, 0.7, 0.9], wall: [0.4, 0.45, 0.5], outline: [0.85, 0.93, 1, 0.4], edges: [0.9, 0.95, 1, 0.2], axis: [0.8, 0.85, 0.9, 0.4] },
  };
  const HIT = [0.89, 0.47, 0.2];  // a wall that the beam presses on
  const OPAQUE = 1, CLEAR = 0.3;
  const faded = (color) => [...color.slice(0, 3).map((value) => value * color[3]), color[3]];

  function digits(value, count) {
    return Number(value.toPrecision(count)).toString().replace("-", "−");
  }

  function start(figure) {
    const data = JSON.parse(figure.querySelector(".scene-data").textContent);
    const canvas = figure.querySelector("canvas"), still = figure.querySelector(".still");
    const part = (name) => figure.querySelector(`[data-part="${name}"]`);
    const painter = webglPainter(canvas) || canvasPainter(canvas);
    const model = sceneModel(data, painter.kind === "canvas"), maps = contactMaps(figure, data.maps);
    const lowest = Math.min(1, data.magnification), highest = Math.max(10, 20 * data.magnification);
    const state = { frame: data.opening, scale: data.magnification, turn: [...VIEWS.oblique], zoom: 1, playing: false, byReader: false, last: 0, gone: 0 };
    const rate = Math.min(30, Math.max(5, model.frames / 8));  // frames per second at speed 1
    figure.dataset.painter = painter.kind;

    function view(width, height, zoom) {
      const [azimuth, elevation] = state.turn, [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
      const right = [ca, sa, 0], toward = [sa * ce, -ca * ce, se], up = [-sa * se, ca * se, ce];
      const reach = model.reach(state.scale);
      const span = (axis) => reach.reduce((sum, half, k) => sum + half * Math.abs(axis[k]), 0);
      const scale = zoom * Math.min(width / (2.12 * span(right)), height / (2.2 * span(up)));
      return { right, up, toward, center: [0, 0, 0], scale, deep: 1.1 * span(toward) + reach[0] };
    }

    function colors(light) {
      const palette = light || !dark.matches ? PALETTES.light : PALETTES.dark;
      const parts = model.force(state.frame).map((force, k) => {
        const share = model.strongest > 0 ? Math.sqrt(Math.max(0, force) / model.strongest) : 0;
        const mixed = palette.wall.map((value, c) => value + (HIT[c] - value) * Math.min(1, 0.1 * (force > 0) + 0.8 * share));
        return [...mixed, data.walls[k].kind === "around" ? CLEAR + 0.3 * share : OPAQUE];
      });
      const one = painter.kind === "webgl" ? faded : (color) => color;
      return { parts: [[...palette.beam, 1], ...parts], outline: one(palette.outline), edges: one(palette.edges), axis: one(palette.axis) };
    }

    function draw(light) {
      if (light || still.hidden) maps.draw(state.frame, !light && dark.matches);  // what is on paper stays
      const density = Math.min(2, window.devicePixelRatio || 1);
      const width = Math.round(canvas.clientWidth * density), height = Math.round(canvas.clientHeight * density);
      if (!width || !height) return;
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      painter.paint(model.placed(state.frame, state.scale), model.axis(), view(width, height, state.zoom), colors(light));
      say();
    }

    let due = false;
    const soon = () => { if (!due) { due = true; requestAnimationFrame(() => { due = false; draw(false); }); } };

    function say() {
      part("factor").textContent = `× ${digits(state.scale, 2)}`;
      if (model.frames < 2) return;
      const time = model.times[state.frame], total = model.force(state.frame).reduce((a, b) => a + b, 0);
      part("now").textContent = `${time.toFixed(timeDigits)} s`;
      part("time").value = state.frame;
      part("time").setAttribute("aria-valuetext", `${digits(time, 5)} s`);
      part("force").textContent = model.strongest > 0 ? `contact ${digits(total, 3)} N` : "";
      const slower = (rate * part("speed").value * (model.times[model.frames - 1] - model.times[0])) / Math.max(1, model.frames - 1);
      part("pace").textContent = slower < 1 ? `slowed ${digits(1 / slower, 2)} times` : `sped up ${digits(slower, 2)} times`;
    }
    const interval = (model.times[model.frames - 1] - model.times[0]) / Math.max(1, model.frames - 1) || 1;
    const timeDigits = Math.min(7, Math.max(2, Math.ceil(-Math.log10(interval)) + 1));

    function goTo(frame, quiet) {
      state.frame = Math.min(model.frames - 1, Math.max(0, frame));
      soon();
      if (!quiet && model.frames > 1) clock.set(model.times[state.frame], figure);
    }

    function play(on, byReader) {
      if (model.frames < 2) return;
      state.playing = on;
      state.byReader = byReader;
      state.last = 0;
      part("play").textContent = on ? "Pause" : "Play";
      part("play").setAttribute("aria-pressed", String(on));
      if (on && state.frame === model.frames - 1) state.frame = 0;
      if (on) requestAnimationFrame(step);
    }

    function step(now) {
      if (!state.playing) return;
      if (state.last) state.gone += ((now - state.last) / 1000) * rate * part("speed").value;
      state.last = now;
      const whole = Math.floor(state.gone);
      if (whole > 0) {
        state.gone -= whole;
        goTo((state.frame + whole) % model.frames);
      }
      requestAnimationFrame(step);
    }

    function turn(dx, dy) {
      state.turn[0] -= dx;
      state.turn[1] = Math.min(1.5, Math.max(-1.5, state.turn[1] + dy));
      for (const one of figure.querySelectorAll("[data-view]")) one.setAttribute("aria-pressed", "false");
      soon();
    }
    const zoom = (factor) => { state.zoom = Math.min(40, Math.max(0.5, state.zoom * factor)); soon(); };

    // A finger across turns, a finger up or down scrolls the page; two fingers zoom.
    const fingers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const wide = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1; };
      const old = fingers.size === 2 ? wide() : 0;
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (old) zoom(wide() / old);
      else turn((event.clientX - before[0]) * 0.008, (event.clientY - before[1]) * 0.008);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;  // the wheel alone scrolls the page
      event.preventDefault();
      zoom(Math.exp(-event.deltaY * 0.004));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const does = { ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
                     "+": () => zoom(1.2), "=": () => zoom(1.2), "-": () => zoom(1 / 1.2), " ": () => play(!state.playing, true),
                     ",": () => goTo(state.frame - 1), ".": () => goTo(state.frame + 1) }[event.key];
      if (!does) return;
      event.preventDefault();
      does();
    });

    const time = part("time"), scale = part("scale");
    time.max = model.frames - 1;
    time.addEventListener("input", () => { play(false, true); goTo(Number(time.value)); });
    Object.assign(scale, { min: Math.log10(lowest), max: Math.log10(highest), step: 0.01, value: Math.log10(state.scale) });
    scale.addEventListener("input", () => {
      const wished = 10 ** Number(scale.value);
      state.scale = Number(wished.toPrecision(2));
      scale.setAttribute("aria-valuetext", `${digits(state.scale, 2)} times`);
      soon();
    });
    part("play").addEventListener("click", () => play(!state.playing, true));
    part("speed").addEventListener("change", say);
    figure.addEventListener("click", (event) => {
      const button = event.target.closest("[data-view], [data-zoom]");
      if (!button) return;
      if (button.dataset.zoom) return zoom(Number(button.dataset.zoom));
      state.turn = [...VIEWS[button.dataset.view]];
      state.zoom = 1;
      for (const one of figure.querySelectorAll("[data-view]")) one.setAttribute("aria-pressed", String(one === button));
      return soon();
    });

    clock.listen((now, from) => {
      if (from === figure || model.frames < 2) return;
      play(false, true);
      let near = 0;
      for (let k = 0; k < model.frames; k += 1) if (Math.abs(model.times[k] - now) < Math.abs(model.times[near] - now)) near = k;
      goTo(near, true);
    });
    new ResizeObserver(soon).observe(canvas);
    dark.addEventListener("change", soon);
    canvas.addEventListener("webglcontextlost", () => { play(false, false); figure.dataset.painter = "lost"; });

    if (model.squeeze < 1) part("squeeze").textContent = `Its length is drawn ${digits(1 / model.squeeze, 2)} times shorter. `;
    // A scene starts by itself where motion is welcome, and stops when it is scrolled away unless the reader started it.
    let first = true;
    const seen = new IntersectionObserver(([entry]) => {
      if (entry.isIntersecting && first && !calm.matches && location.hash !== "#print") { first = false; play(true, false); }
      else if (!entry.isIntersecting && state.playing && !state.byReader) { play(false, false); first = true; }
    }, { threshold: 0.35 });
    if (model.frames > 1) seen.observe(canvas);

    if (model.frames > 1) clock.set(model.times[state.frame], figure);
    draw(false);
    window.gapbeam.scenes.push({
      figure, model, maps, state, draw, play, goTo,
      // The picture on paper: the opening frame in the colors of a light page.
      toPaper() {
        play(false, false);
        const kept = state.frame;
        state.frame = data.opening;
        draw(true);
        still.src = canvas.toDataURL("image/png");
        still.hidden = false;
        state.frame = kept;
      },
      toScreen() { still.hidden = true; draw(false); },
    });
  }

  for (const figure of document.querySelectorAll("figure.scene")) {
    try { start(figure); } catch (fault) {
      figure.dataset.painter = "none";
      console.error(fault);
    }
  }
})();
