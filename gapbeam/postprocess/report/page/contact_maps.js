"use strict";
// Contact pressures at the time of a scene: colors over x and the angle around the beam, lines over x on planes.
(() => {
  const { numbersOf, ticks } = window.gapbeam;
  const MILLI = 1e3, MEGA = 1e-6;  // mm in a meter, MPa in a pascal
  const COARSE = [160, 96];  // pixels of a map, which the canvas smooths
  const COLORS = {  // of pressures from 0 to the largest
    light: [[226, 232, 237], [242, 201, 76], [232, 112, 42], [176, 32, 12], [74, 5, 8]],
    dark: [[43, 51, 59], [122, 42, 18], [232, 112, 42], [242, 201, 76], [255, 246, 214]],
  };
  const ROOM = { left: 50, right: 12, top: 10, bottom: 36, bar: 58, bar_top: 22 };  // around the axes, px; where a bar stands at the right

  function shades(colors) {
    return Array.from({ length: 256 }, (_, k) => {
      const place = (k / 255) * (colors.length - 1), low = Math.min(Math.floor(place), colors.length - 2);
      return colors[low].map((value, c) => Math.round(value + (colors[low + 1][c] - value) * (place - low)));
    });
  }

  // A face: places in the units of its axes, and the pressures of a frame, MPa, which are 0 where none are packed.
  function faceOf(data) {
    const x = Array.from(numbersOf(data.x), (value) => MILLI * value), angles = Array.from(numbersOf(data.angles));
    const packed = numbersOf(data.pressures), width = data.places.length, rows = new Map(data.frames.map((frame, row) => [frame, row]));
    const values = new Float32Array(x.length);
    return {
      x, angles, triangles: data.triangles,
      largest: MEGA * data.pressures.unit * packed.reduce((a, b) => Math.max(a, b), 0),
      at(frame) {
        values.fill(0);
        const row = rows.get(frame);
        if (row !== undefined) data.places.forEach((place, k) => { values[place] = MEGA * data.pressures.unit * packed[row * width + k]; });
        return values;
      },
    };
  }

  // The pixels of a map that lie in triangles: for each its corners and their shares; linear between points.
  function pixelsOf(face, [left, right], [wide, high]) {
    const places = [], corners = [], shares = [];
    const across = (x) => ((x - left) / (right - left)) * wide - 0.5, down = (angle) => ((180 - angle) / 360) * high - 0.5;
    for (let t = 0; t < face.triangles.length; t += 3) {
      const three = face.triangles.slice(t, t + 3), x = three.map((k) => across(face.x[k])), y = three.map((k) => down(face.angles[k]));
      const area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
      if (!area) continue;
      const first = (values) => Math.max(0, Math.ceil(Math.min(...values) - 1e-6)), last = (values, most) => Math.min(most - 1, Math.max(...values) + 1e-6);
      for (let row = first(y); row <= last(y, high); row += 1) {
        for (let column = first(x); column <= last(x, wide); column += 1) {
          const dx = column - x[0], dy = row - y[0];
          const second = (dx * (y[2] - y[0]) - (x[2] - x[0]) * dy) / area, third = ((x[1] - x[0]) * dy - dx * (y[1] - y[0])) / area;
          if (Math.min(second, third, 1 - second - third) < -1e-6) continue;
          places.push(row * wide + column);
          corners.push(...three);
          shares.push(1 - second - third, second, third);
        }
      }
    }
    return { places: Uint32Array.from(places), corners: Uint32Array.from(corners), shares: Float32Array.from(shares) };
  }

  // The ways to draw on a canvas, in the colors of the page.
  function penOf(canvas) {
    const pen = canvas.getContext("2d"), density = Math.min(2, window.devicePixelRatio || 1);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    Object.assign(canvas, { width: Math.round(width * density), height: Math.round(height * density) });
    pen.setTransform(density, 0, 0, density, 0, 0);
    const style = getComputedStyle(canvas);
    pen.font = `11px ${style.fontFamily}`;
    return {
      pen, width, height,
      write(text, x, y, textAlign, textBaseline) {
        Object.assign(pen, { textAlign, textBaseline, fillStyle: style.getPropertyValue("--soft") });
        pen.fillText(text, x, y);
      },
      line(name, lineWidth, points, dash = []) {
        Object.assign(pen, { strokeStyle: style.getPropertyValue(name), lineWidth, lineJoin: "round" });
        pen.setLineDash(dash);
        pen.beginPath();
        points.forEach((point, k) => (k ? pen.lineTo(...point) : pen.moveTo(...point)));
        pen.stroke();
      },
    };
  }

  function axes({ pen, write, line, width, height }, ends, heights, names, right) {
    const top = right === ROOM.right ? ROOM.top : ROOM.bar_top, wide = width - ROOM.left - right, high = height - top - ROOM.bottom;
    const across = (x) => ROOM.left + ((x - ends[0]) / (ends[1] - ends[0] || 1)) * wide;
    const up = (value) => top + ((heights.ends[1] - value) / (heights.ends[1] - heights.ends[0])) * high;
    for (const [value, text] of heights.ticks) {
      line("--line", 1, [[ROOM.left - 3, up(value)], [ROOM.left + wide, up(value)]]);
      write(text, ROOM.left - 6, up(value), "right", "middle");
    }
    for (const [value, text] of ticks(...ends, Math.max(2, wide / 70))) {
      line("--rule", 1, [[across(value), top + high], [across(value), top + high + 4]]);
      write(text, across(value), top + high + 7, "center", "top");
    }
    write(names[0], ROOM.left + 0.5 * wide, height - 1, "center", "bottom");
    pen.save();
    pen.translate(8, top + 0.5 * high);
    pen.rotate(-Math.PI / 2);
    write(names[1], 0, 0, "center", "middle");
    pen.restore();
    return { across, up, top, wide, high };
  }

  // Curves over x: one for each plane of a support, the second one dashed as its key is.
  function curvesOf(canvas, faces, ends) {
    return (values, scale) => {
      const tools = penOf(canvas), heights = { ends: [0, 1.04 * scale], ticks: ticks(0, scale, 4) };
      const { across, up } = axes(tools, ends, heights, ["x (mm)", "pressure (MPa)"], ROOM.right);
      faces.forEach((face, k) => tools.line(k % 2 ? "--warning" : "--accent", 2, face.x.map((x, n) => [across(x), up(values[k][n])]), k % 2 ? [6, 4] : []));
    };
  }

  // A map over x and the angle, with its scale at the right.
  function mapOf(canvas, face, ends) {
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = COARSE;
    const picture = copy.getContext("2d").createImageData(...COARSE), { places, corners, shares } = pixelsOf(face, ends, COARSE);
    const angles = [-180, -90, 0, 90, 180].map((angle) => [angle, String(angle).replace("-", "−")]);
    return ([values], scale, colors) => {
      const tools = penOf(canvas), { pen, write, line } = tools;
      const { up, top, wide, high } = axes(tools, ends, { ends: [-180, 180], ticks: angles }, ["x (mm)", "angle (°)"], ROOM.bar);
      for (let k = 0; k < places.length; k += 1) {
        const value = shares[3 * k] * values[corners[3 * k]] + shares[3 * k + 1] * values[corners[3 * k + 1]] + shares[3 * k + 2] * values[corners[3 * k + 2]];
        const color = colors[Math.round(255 * Math.min(1, Math.max(0, value / scale)))], at = 4 * places[k];
        picture.data[at] = color[0];
        picture.data[at + 1] = color[1];
        picture.data[at + 2] = color[2];
        picture.data[at + 3] = 255;
      }
      copy.getContext("2d").putImageData(picture, 0, 0);
      pen.drawImage(copy, ROOM.left, top, wide, high);
      line("--rule", 1, [[ROOM.left, up(180)], [ROOM.left + wide, up(180)], [ROOM.left + wide, up(-180)], [ROOM.left, up(-180)], [ROOM.left, up(180)]]);
      const bar = ROOM.left + wide + 12;
      colors.forEach((color, k) => { pen.fillStyle = `rgb(${color})`; pen.fillRect(bar, top + high * (1 - (k + 1) / 256), 10, high / 256 + 0.6); });
      for (const [value, text] of ticks(0, scale, 4)) write(text, bar + 15, top + high * (1 - value / scale), "left", "middle");
      write("MPa", bar, top - 6, "left", "bottom");
    };
  }

  // All maps of a scene have one scale. Returns their faces, which know their pressures in a frame, and how to draw it.
  window.gapbeam.contactMaps = (figure, data) => {
    const places = [...figure.querySelectorAll(".contact-map")], all = data.map((faces) => faces.map(faceOf));
    const scale = Math.max(...all.flat().map((face) => face.largest));
    const drawn = all.map((faces, k) => {
      const canvas = places[k].querySelector("canvas"), x = faces.flatMap((face) => face.x);
      const ends = [x.reduce((a, b) => Math.min(a, b)), x.reduce((a, b) => Math.max(a, b))];
      return faces[0].angles.length ? mapOf(canvas, faces[0], ends) : curvesOf(canvas, faces, ends);
    });
    const shadesOf = { light: shades(COLORS.light), dark: shades(COLORS.dark) };
    return {
      faces: all,
      draw(frame, dark) {
        all.map((faces) => faces.map((face) => face.at(frame))).forEach((values, k) => {
          const now = values.reduce((most, one) => one.reduce((a, b) => Math.max(a, b), most), 0);
          places[k].querySelector('[data-part="most"]').textContent = now > 0 ? `largest ${Number(now.toPrecision(3))} MPa` : "no contact";
          if (places[k].clientWidth) drawn[k](values, scale, dark ? shadesOf.dark : shadesOf.light);
        });
      },
    };
  };
})();
