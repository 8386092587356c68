"use strict";
// The time of the page: the scene sets it while it plays, charts over time and orbits show it, a click on one sets it.
(() => {
  const { numbersOf } = window.gapbeam;
  const heard = [];
  const clock = {
    time: null,
    listen: (listener) => heard.push(listener),
    set(time, from) {
      clock.time = time;
      for (const listener of heard) listener(time, from);
    },
  };

  // A layer over the plot: a line at the time where its axis is time, a dot on each curve whose points have times.
  function layerOf(plot) {
    let layer = plot.querySelector(":scope > .cursor-layer");
    if (!layer) {
      layer = document.createElement("div");
      layer.className = "cursor-layer";
      layer.setAttribute("aria-hidden", "true");
      plot.append(layer);
    }
    return layer;
  }

  function show(plot, seconds, tracks) {
    const layer = layerOf(plot), { xaxis, yaxis } = plot._fullLayout || {};
    layer.replaceChildren();
    if (clock.time === null || !xaxis || !yaxis) return;
    const mark = (name, left, top, height) => {
      if (left < -0.5 || left > xaxis._length + 0.5 || top < -0.5 || top > yaxis._length + 0.5) return;
      const one = document.createElement("i");
      one.className = name;
      one.style.transform = `translate(${xaxis._offset + left}px, ${yaxis._offset + top}px)`;
      if (height) one.style.height = `${height}px`;
      layer.append(one);
    };
    if (seconds) mark("at", xaxis.c2p(clock.time / seconds), 0, yaxis._length);
    for (const { x, y, times } of tracks) {
      const k = placeIn(times, clock.time);
      if (k !== null) mark("dot", xaxis.c2p(x(k)), yaxis.c2p(y(k)));
    }
  }

  // The place of a time among increasing ones, with its fraction; null before and after them.
  function placeIn(times, time) {
    const last = times.length - 1;
    if (last < 0 || time < times[0] - 1e-9 || time > times[last] + 1e-9) return null;
    let low = 0, high = last;
    while (high - low > 1) {
      const half = (low + high) >> 1;
      if (times[half] <= time) low = half; else high = half;
    }
    const wide = times[high] - times[low];
    return low + (wide > 0 ? Math.min(1, Math.max(0, (time - times[low]) / wide)) : 0);
  }

  const between = (values) => (place) => {
    const low = Math.floor(place), high = Math.min(low + 1, values.length - 1);
    return values[low] + (values[high] - values[low]) * (place - low);
  };

  const followed = new Map();
  let due = false;
  function update() {
    due = false;
    for (const { plot, seconds, tracks } of followed.values()) {
      const box = plot.getBoundingClientRect();
      if (box.bottom > 0 && box.top < window.innerHeight) show(plot, seconds, tracks);
    }
  }
  const soon = () => { if (!due) { due = true; requestAnimationFrame(update); } };

  // Let a chart follow; again after each drawing, as its curves may have changed.
  clock.follow = (plot, spec, choice) => {
    const seconds = spec.layout.meta && spec.layout.meta.seconds;
    const tracks = spec.data.filter((trace) => trace.customdata && (trace.meta == null || trace.meta === choice))
      .map((trace) => ({ x: between(numbersOf(trace.x)), y: between(numbersOf(trace.y)), times: numbersOf(trace.customdata) }));
    if (!seconds && !tracks.length) return;
    const known = followed.get(plot);
    followed.set(plot, { plot, seconds, tracks });
    if (!known) {
      plot.on("plotly_relayout", soon);
      plot.on("plotly_click", (event) => {
        const point = event.points[0];
        if (seconds) clock.set(point.x * seconds, plot);
        else if (point.data.customdata) clock.set(Number(point.customdata), plot);
      });
    }
    soon();
  };
  clock.listen(soon);
  window.addEventListener("scroll", soon, { passive: true });
  window.addEventListener("resize", () => setTimeout(soon, 150));
  window.gapbeam.clock = clock;
})();
