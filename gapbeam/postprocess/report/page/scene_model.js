"use strict";
// The geometry of a scene: beam and walls as triangles and lines, at a frame and a magnification.
// A point of the beam lies at its place + magnification * displacement, a wall at magnification * gap from the
// undeformed beam: beam and wall touch in the picture where they touch in the run. x is shortened by `squeeze`.
(() => {
  const { numbersOf } = window.gapbeam;
  const RING = 0.3, CORNERS = 1.3, BLOCK = 0.75;  // thickness of rings and blocks, over that of the beam
  const SHARP = Math.cos((44 * Math.PI) / 180);  // corners that are edges
  const LONGEST = 24;  // length over thickness of the beam as drawn; longer ones are shortened

  // Corners and normals of an outline: two vertices a side, the normals of round outlines are smooth.
  function sidesOf(outline, width, height) {
    const count = outline.length;
    const normals = outline.map((from, k) => {
      const to = outline[(k + 1) % count];
      const dy = (to[0] - from[0]) * width, dz = (to[1] - from[1]) * height, size = Math.hypot(dy, dz) || 1;
      return [dz / size, -dy / size];
    });
    const smooth = (one, other) => {
      if (one[0] * other[0] + one[1] * other[1] < SHARP) return one;
      const y = one[0] + other[0], z = one[1] + other[1], size = Math.hypot(y, z) || 1;
      return [y / size, z / size];
    };
    return outline.map((from, k) => ({
      ends: [from, outline[(k + 1) % count]],
      normals: [smooth(normals[k], normals[(k + count - 1) % count]), smooth(normals[k], normals[(k + 1) % count])],
      sharp: normals[k][0] * normals[(k + count - 1) % count][0] + normals[k][1] * normals[(k + count - 1) % count][1] < SHARP,
    }));
  }

  function thinned(values, most) {
    if (values.length <= most) return values.map((_, k) => k);
    const kept = Array.from({ length: most }, (_, k) => Math.round((k * (values.length - 1)) / (most - 1)));
    return [...new Set(kept)];
  }

  // Triangles and lines that grow; a quad is four corners in order around it.
  function shape() {
    const one = { positions: [], normals: [], index: [], lines: [] };
    one.quad = (corners, normal) => {
      const first = one.positions.length / 3;
      for (const corner of corners) { one.positions.push(...corner); one.normals.push(...normal); }
      one.index.push(first, first + 1, first + 2, first, first + 2, first + 3);
    };
    one.line = (from, to) => one.lines.push(...from, ...to);
    return one;
  }

  function innerRadii(wall, gap, scale, turns) {
    const half = 0.5 * (wall.top - wall.bottom);
    const walls = wall.angles.map((angle, k) => [angle, half + scale * (gap + wall.recesses[k])]);
    if (!walls.length) return turns.map(() => half + scale * gap);
    if (!wall.flat) {
      return turns.map((turn) => {
        const next = walls.findIndex(([angle]) => angle >= turn);
        const to = next < 0 ? walls[0] : walls[next];
        const from = next <= 0 ? walls[walls.length - 1] : walls[next - 1];
        const wide = ((to[0] - from[0]) + 720) % 360 || 360, gone = ((turn - from[0]) + 720) % 360;
        return from[1] + ((to[1] - from[1]) * gone) / wide;
      });
    }
    return turns.map((turn) => Math.min(...walls.map(([angle, distance]) => {
      const toward = Math.cos(((turn - angle) * Math.PI) / 180);
      return toward > 1e-6 ? distance / toward : Infinity;
    })));
  }

  window.gapbeam.sceneModel = (data, coarse) => {
    const stations = numbersOf(data.stations), half = numbersOf(data.half), middle = numbersOf(data.middle);
    const times = numbersOf(data.times), slide = numbersOf(data.slide);
    const motion = Object.fromEntries(Object.entries(data.motion).map(([name, one]) => [name, { values: numbersOf(one), unit: one.unit }]));
    const all = stations.length, frames = times.length;
    const walls = data.walls.map((wall) => ({ ...wall, moved: wall.moved && numbersOf(wall.moved), force: wall.force && numbersOf(wall.force) }));
    const strongest = Math.max(0, ...walls.map((wall) => (wall.force ? wall.force.reduce((a, b) => Math.max(a, b), 0) : 0)));
    let width = 0, height = 0, farthest = 0;
    for (let s = 0; s < all; s += 1) { width = Math.max(width, half[2 * s]); height = Math.max(height, half[2 * s + 1]); }
    for (const name of ["y", "z"]) if (motion[name]) for (const value of motion[name].values) farthest = Math.max(farthest, Math.abs(value * motion[name].unit));
    const start = stations[0], length = stations[all - 1] - start, thickness = 2 * height;
    const short = (LONGEST * thickness) / length, squeeze = short > 0.8 ? 1 : short;
    const kept = thinned(Array.from(stations), coarse ? 48 : 200);
    const outline = coarse ? thinned(data.outline, 14).map((k) => data.outline[k]) : data.outline;
    const sides = sidesOf(outline, width, height);
    const of = (name, frame, s) => (motion[name] ? motion[name].values[frame * all + s] * motion[name].unit : 0);

    const per = 2 * sides.length, count = kept.length;
    const beam = {
      positions: new Float32Array(3 * (count * per + 2 * sides.length)),
      normals: new Float32Array(3 * (count * per + 2 * sides.length)),
      index: [], lines: [],
    };
    const edges = [];  // pairs of vertices that are drawn as lines
    for (let k = 0; k < count; k += 1) {
      for (let n = 0; n < sides.length; n += 1) {
        for (const end of [0, 1]) beam.normals.set([0, ...sides[n].normals[end]], 3 * (k * per + 2 * n + end));
        if (k + 1 === count) continue;
        const a = k * per + 2 * n, b = a + per;
        beam.index.push(a, a + 1, b + 1, a, b + 1, b);
        if (sides[n].sharp) edges.push(a, b);
      }
    }
    const caps = count * per;
    for (const end of [0, 1]) {
      const first = caps + end * sides.length, ring = end ? (count - 1) * per : 0;
      for (let n = 0; n < sides.length; n += 1) {
        beam.normals.set([end ? 1 : -1, 0, 0], 3 * (first + n));
        if (n > 1) beam.index.push(first, first + n - 1, first + n);
        edges.push(ring + 2 * n, ring + 2 * n + 1);
      }
    }
    beam.index = new Uint32Array(beam.index);
    beam.lines = new Float32Array(3 * edges.length);

    const along = (x) => squeeze * (x - start - 0.5 * length);

    function placeBeam(frame, scale) {
      const moved = kept.map((s) => [of("y", frame, s), of("z", frame, s), of("twist", frame, s)]);
      for (let k = 0; k < count; k += 1) {
        const s = kept[k], [v, w, twist] = moved[k];
        const before = moved[Math.max(k - 1, 0)], after = moved[Math.min(k + 1, count - 1)];
        const dx = stations[kept[Math.min(k + 1, count - 1)]] - stations[kept[Math.max(k - 1, 0)]] || 1;
        const leanY = (scale * (after[0] - before[0])) / dx, leanZ = (scale * (after[1] - before[1])) / dx;
        for (let n = 0; n < sides.length; n += 1) {
          for (const end of [0, 1]) {
            const y = sides[n].ends[end][0] * half[2 * s], z = sides[n].ends[end][1] * half[2 * s + 1];
            const place = 3 * (k * per + 2 * n + end);
            beam.positions[place] = along(stations[s] + slide[frame]) - squeeze * (y * leanY + z * leanZ);
            beam.positions[place + 1] = middle[2 * s] + y + scale * (v - twist * z);
            beam.positions[place + 2] = middle[2 * s + 1] + z + scale * (w + twist * y);
          }
        }
      }
      for (const end of [0, 1]) {
        const ring = end ? (count - 1) * per : 0;
        for (let n = 0; n < sides.length; n += 1) {
          const from = 3 * (ring + 2 * n);
          beam.positions.set(beam.positions.subarray(from, from + 3), 3 * (caps + end * sides.length + n));
        }
      }
      edges.forEach((vertex, k) => beam.lines.set(beam.positions.subarray(3 * vertex, 3 * vertex + 3), 3 * k));
    }

    function block(wall, gap, scale) {
      const one = shape(), below = wall.kind === "below";
      const plane = below ? wall.bottom - scale * gap : wall.top + scale * gap;
      const far = plane + (below ? -1 : 1) * BLOCK * thickness;
      const rise = 0.5 * scale * wall.tilt * (wall.along[1] - wall.along[0]);
      const corner = (end, side, z) => [along(wall.along[end]), side * 1.25 * width + middle[0], z + (end ? rise : -rise)];
      const faces = [
        [[0, -1, far], [1, -1, far], [1, -1, plane], [0, -1, plane], [0, -1, 0]], [[0, 1, far], [1, 1, far], [1, 1, plane], [0, 1, plane], [0, 1, 0]],
        [[0, -1, far], [0, 1, far], [0, 1, plane], [0, -1, plane], [-1, 0, 0]], [[1, -1, far], [1, 1, far], [1, 1, plane], [1, -1, plane], [1, 0, 0]],
        [[0, -1, plane], [1, -1, plane], [1, 1, plane], [0, 1, plane], [0, 0, below ? 1 : -1]], [[0, -1, far], [1, -1, far], [1, 1, far], [0, 1, far], [0, 0, below ? -1 : 1]],
      ];
      for (const face of faces) {
        const corners = face.slice(0, 4).map((place) => corner(...place));
        one.quad(corners, face[4]);
        corners.forEach((place, k) => one.line(place, corners[(k + 1) % 4]));
      }
      return one;
    }

    function ring(wall, gap, offset, lateral, scale) {
      const one = shape(), steps = coarse ? 40 : 96;
      const turns = Array.from({ length: steps + 1 }, (_, k) => -180 + (360 * k) / steps);
      const recess = Math.max(0, ...wall.recesses), thick = wall.top - wall.bottom;
      const outer = (wall.flat ? CORNERS : 1) * (0.5 * thick + scale * (gap + recess)) + RING * thick;
      const inner = innerRadii(wall, gap, scale, turns).map((radius) => Math.min(radius, outer));
      const rise = 0.5 * scale * wall.tilt * (wall.along[1] - wall.along[0]);
      const centre = 0.5 * (wall.top + wall.bottom) + scale * offset;
      const at = (end, k, radius) => {
        const angle = (turns[k] * Math.PI) / 180;
        return [along(wall.along[end]), middle[0] + scale * lateral + radius * Math.sin(angle), centre + (end ? rise : -rise) - radius * Math.cos(angle)];
      };
      for (let k = 0; k < steps; k += 1) {
        if (inner[k] >= outer && inner[k + 1] >= outer) continue;  // open there
        const angle = (0.5 * (turns[k] + turns[k + 1]) * Math.PI) / 180, toward = [0, Math.sin(angle), -Math.cos(angle)];
        one.quad([at(0, k, inner[k]), at(1, k, inner[k]), at(1, k + 1, inner[k + 1]), at(0, k + 1, inner[k + 1])], toward);
        one.quad([at(0, k, outer), at(1, k, outer), at(1, k + 1, outer), at(0, k + 1, outer)], toward);
        for (const end of [0, 1]) {
          one.quad([at(end, k, inner[k]), at(end, k, outer), at(end, k + 1, outer), at(end, k + 1, inner[k + 1])], [end ? 1 : -1, 0, 0]);
          one.line(at(end, k, inner[k]), at(end, k + 1, inner[k + 1]));
          one.line(at(end, k, outer), at(end, k + 1, outer));
        }
      }
      return one;
    }

    function placeWall(wall, frame, scale) {
      const moved = wall.moved ? wall.moved.subarray(3 * frame, 3 * frame + 3) : [wall.gap, wall.offset, wall.lateral];
      const made = wall.kind === "around" ? ring(wall, ...moved, scale) : block(wall, moved[0], scale);
      return { positions: new Float32Array(made.positions), normals: new Float32Array(made.normals),
               index: new Uint32Array(made.index), lines: new Float32Array(made.lines), clear: wall.kind === "around" };
    }

    let shown = null;
    const parts = [];
    return {
      times, frames, length, thickness, squeeze, farthest, strongest, names: walls.map((wall) => wall.name),
      force: (frame) => walls.map((wall) => (wall.force ? wall.force[frame] : 0)),
      // Beam and walls at a frame: [{positions, normals, index, lines, clear, version}], the beam first.
      placed(frame, scale) {
        placeBeam(frame, scale);
        walls.forEach((wall, k) => {
          if (shown !== scale || wall.moved || !parts[k]) parts[k] = { ...placeWall(wall, frame, scale), version: (parts[k]?.version ?? 0) + 1 };
        });
        shown = scale;
        return [beam, ...parts];
      },
      // The axis of the undeformed beam, as a line.
      axis: () => new Float32Array([along(start), middle[0], middle[1], along(start + length), middle[2 * all - 2], middle[2 * all - 1]]),
      // Half the box that holds everything at a magnification.
      reach(scale) {
        const aside = Math.max(height, width) + scale * farthest;
        const gaps = Math.max(0, ...walls.map((wall) => scale * (Math.abs(wall.gap) + Math.abs(wall.offset) + Math.max(0, ...wall.recesses)) * (wall.flat ? CORNERS : 1)));
        const room = walls.length ? height + gaps + (walls.some((wall) => wall.kind === "around") ? RING : BLOCK) * thickness : 0;
        return [0.5 * squeeze * length, Math.max(motion.y ? aside : width, walls.some((wall) => wall.kind === "around") ? room : 1.25 * width), Math.max(aside, room)];
      },
    };
  };
})();
