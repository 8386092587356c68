"use strict";
// The reduced model of a run, marched here by the kernel that is in the page as WebAssembly.
(() => {
  const KEPT = 4000, CHUNK = 6, PERIODS = 8, SECONDS = 8;  // samples of a picture; ms of marching a frame; shown; until a picture is new
  const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { ticks } = window.gapbeam;
  const shown = (value, digits = 3) => Number(value.toPrecision(digits)).toString().replace("-", "−");

  for (const figure of document.querySelectorAll("figure.live")) start(figure);

  async function start(figure) {
    const part = (name) => figure.querySelector(`[data-part="${name}"]`);
    const data = JSON.parse(part("data").textContent), given = new Float64Array(bytesOf(data.block).buffer);
    let exports;
    try {
      exports = (await WebAssembly.instantiate(bytesOf(data.kernel))).instance.exports;
    } catch (fault) {
      part("now").textContent = `This browser cannot march: ${fault.message}`;
      return;
    }
    const base = Math.ceil(exports.__heap_base.value / 16) * 16;
    const lacking = base + 8 * data.size - exports.memory.buffer.byteLength;
    if (lacking > 0) exports.memory.grow(Math.ceil(lacking / 65536));
    const numbers = new Float64Array(exports.memory.buffer, base, data.size);
    const named = (ending) => data.variables.filter((one) => one.role === "parameter" && one.name.endsWith(ending));
    const groups = { clearance: named(".clearance"), amplitude: named(".amplitude"), frequency: named(".frequency") };
    const probes = data.variables.filter((one) => one.name.endsWith(".displacement"));
    const hertz = Math.max(...groups.frequency.map((one) => one.start), 0);
    const stride = hertz > 0 ? Math.max(1, Math.round(PERIODS / (hertz * KEPT * data.step))) : 1;
    const samples = [];  // t, x, v
    let playing = false, running = false, broken = false;

    for (const one of probes) part("probe").add(new Option(one.name.replace(/\.displacement$/, "")));
    part("probe").selectedIndex = probes.length - 1;
    const place = () => probes[part("probe").selectedIndex].place;

    function set() {
      for (const [name, variables] of Object.entries(groups)) {
        const factor = Number(part(name).value);
        const first = variables.reduce((one, other) => (other.start > one.start ? other : one), variables[0]);  // a base has no gap
        part(name).closest("label").hidden = !variables.length;
        for (const one of variables) numbers[one.place] = one.start * factor;
        if (!first) continue;
        const value = words(first.start * factor, first.unit);
        part(`${name}-value`).textContent = `${value} (${shown(factor)} × the run's)`;
      }
    }
    const words = (value, unit) => (unit === "m" ? (Math.abs(value) < 1e-5 ? `${shown(1e6 * value)} µm` : `${shown(1e3 * value)} mm`) : `${shown(value)} ${unit.replace("m/s2", "m/s²")}`);

    function reset() {
      numbers.fill(0);
      numbers.set(given);
      samples.length = 0;
      broken = false;
      set();
      advance(location.hash === "#print" ? KEPT : 1, Infinity);  // paper has the whole picture, whenever it is printed
      run();
    }

    function advance(count, limit) {
      const begun = performance.now(), x = place(), v = x + probes.length;
      for (let k = 0; k < count && !broken && performance.now() - begun < limit; k++) {
        broken = exports.march(base, stride) !== 0;
        samples.push([numbers[9] + numbers[10] * data.step, numbers[x], numbers[v]]);
      }
      samples.splice(0, samples.length - KEPT);
      part("now").textContent = broken ? "The contact forces of a step did not converge: begin again."
        : `t = ${shown(samples[samples.length - 1][0], 5)} s`;
    }

    function plot(canvas, across, up, heads) {
      const ratio = window.devicePixelRatio || 1, { width, height } = canvas.getBoundingClientRect();
      const style = getComputedStyle(figure), color = (name) => style.getPropertyValue(name).trim();
      canvas.width = width * ratio, canvas.height = height * ratio;
      const pen = canvas.getContext("2d"), left = 58, low = 34, right = 10, top = 10;
      pen.scale(ratio, ratio);
      pen.font = `12px ${style.fontFamily}`;
      const range = (values) => {
        let a = Infinity, b = -Infinity;
        for (const one of values) a = Math.min(a, one), b = Math.max(b, one);
        return b > a ? [a, b] : [a - 1e-9, b + 1e-9];
      };
      const [a, b] = range(across), [c, d] = range(up);
      const x = (one) => left + (one - a) / (b - a) * (width - left - right);
      const y = (one) => height - low - (one - c) / (d - c) * (height - low - top);
      pen.strokeStyle = color("--rule"), pen.fillStyle = color("--soft");
      pen.strokeRect(left, top, width - left - right, height - low - top);
      pen.textAlign = "right";
      for (const [value, text] of ticks(c, d, 4)) pen.fillText(text, left - 5, y(value) + 4);
      pen.textAlign = "center";
      for (const [value, text] of ticks(a, b, Math.max(2, width / 90))) pen.fillText(text, x(value), height - low + 14);
      pen.fillText(heads[0], (left + width - right) / 2, height - 6);
      pen.save(), pen.translate(13, (top + height - low) / 2), pen.rotate(-Math.PI / 2), pen.fillText(heads[1], 0, 0), pen.restore();
      pen.strokeStyle = color("--accent"), pen.lineWidth = 1.3, pen.beginPath();
      across.forEach((one, k) => pen.lineTo(x(one), y(up[k])));
      pen.stroke();
    }

    function draw() {
      const [t, x, v] = [0, 1, 2].map((k) => samples.map((one) => one[k] * (k === 1 ? 1e3 : 1)));
      plot(part("time"), t, x, ["time (s)", "displacement (mm)"]);
      plot(part("plane"), x, v, ["displacement (mm)", "velocity (m/s)"]);
    }

    function frame() {
      const full = samples.length >= KEPT;
      running = !broken && (playing || !full);
      if (running) advance(full ? Math.ceil(KEPT / (60 * SECONDS)) : KEPT - samples.length, CHUNK);
      draw();
      if (running) requestAnimationFrame(frame);
    }
    const run = () => running || frame();

    part("play").onclick = () => {
      playing = !playing;
      part("play").textContent = playing ? "Pause" : "March";
      part("play").setAttribute("aria-pressed", String(playing));
      run();
    };
    part("reset").onclick = reset;
    part("probe").onchange = reset;
    for (const name of Object.keys(groups)) {
      part(name).oninput = () => {
        set();
        if (!playing) part("play").onclick();
      };
    }
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    window.addEventListener("resize", draw);
    window.addEventListener("beforeprint", () => { advance(KEPT - samples.length, Infinity), draw(); });
    figure.closest("details")?.addEventListener("toggle", draw);
    figure.live = { numbers, march: (steps) => exports.march(base, steps), variables: data.variables };
    reset();
  }
})();
