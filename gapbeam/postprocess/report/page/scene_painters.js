"use strict";
// Two painters of a scene with one face: paint(parts, axis, view, colors). WebGL where the browser has it, else a canvas.
// A view holds right, up, toward (unit vectors, toward points at the reader), center, pixels per meter, and deep (m).
(() => {
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const VERTEX = `attribute vec3 place; attribute vec3 normal; uniform mat4 seen; uniform vec3 light; varying float shade; uniform vec3 toward;
    void main() { gl_Position = seen * vec4(place, 1.0); vec3 facing = dot(normal, toward) < 0.0 ? -normal : normal;
      shade = dot(normal, normal) < 0.5 ? 1.0 : 0.62 + 0.42 * max(dot(facing, light), 0.0); }`;
  const FRAGMENT = `precision mediump float; varying float shade; uniform vec4 color;
    void main() { gl_FragColor = vec4(color.rgb * shade * color.a, color.a); }`;

  function lightOf(view) {
    const sum = [0, 1, 2].map((k) => 0.2 * view.right[k] + 0.55 * view.up[k] + 0.8 * view.toward[k]);
    const size = Math.hypot(...sum);
    return sum.map((value) => value / size);
  }

  window.gapbeam.webglPainter = (canvas) => {
    const gl = canvas.getContext("webgl", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl || !gl.getExtension("OES_element_index_uint")) return null;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    const spot = (name) => gl.getUniformLocation(program, name);
    const uniform = { seen: spot("seen"), light: spot("light"), color: spot("color"), toward: spot("toward") };
    const place = gl.getAttribLocation(program, "place"), normal = gl.getAttribLocation(program, "normal");
    const kept = new WeakMap();

    function buffersOf(part) {
      let found = kept.get(part);
      if (!found) {
        found = { positions: gl.createBuffer(), normals: gl.createBuffer(), index: gl.createBuffer(), lines: gl.createBuffer(), version: null };
        kept.set(part, found);
        gl.bindBuffer(gl.ARRAY_BUFFER, found.normals);
        gl.bufferData(gl.ARRAY_BUFFER, part.normals, gl.STATIC_DRAW);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, found.index);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, part.index, gl.STATIC_DRAW);
      }
      if (found.version === null || found.version !== part.version || part.version === undefined) {
        gl.bindBuffer(gl.ARRAY_BUFFER, found.positions);
        gl.bufferData(gl.ARRAY_BUFFER, part.positions, gl.DYNAMIC_DRAW);
        gl.bindBuffer(gl.ARRAY_BUFFER, found.lines);
        gl.bufferData(gl.ARRAY_BUFFER, part.lines, gl.DYNAMIC_DRAW);
        found.version = part.version;
      }
      return found;
    }

    function attribute(where, buffer) {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0);
    }

    function lines(buffer, count, color) {
      attribute(place, buffer);
      gl.disableVertexAttribArray(normal);
      gl.vertexAttrib3f(normal, 0, 0, 0);
      gl.uniform4fv(uniform.color, color);
      gl.drawArrays(gl.LINES, 0, count);
    }
    let previous = [];
    const axisBuffer = gl.createBuffer();
    return {
      kind: "webgl",
      paint(parts, axis, view, colors) {
        for (const old of previous) {  // walls that were made anew leave their buffers
          if (parts.includes(old)) continue;
          for (const name of ["positions", "normals", "index", "lines"]) gl.deleteBuffer(kept.get(old)[name]);
        }
        previous = [...parts];
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clearColor(0, 0, 0, 0);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.useProgram(program);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LEQUAL);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        const [x, y] = [(2 * view.scale) / canvas.width, (2 * view.scale) / canvas.height], z = -1 / view.deep;
        const rows = [view.right.map((v) => v * x), view.up.map((v) => v * y), view.toward.map((v) => v * z)];
        const matrix = [0, 1, 2].flatMap((k) => [rows[0][k], rows[1][k], rows[2][k], 0]).concat(rows.map((row) => -dot(row, view.center)), 1);
        gl.uniformMatrix4fv(uniform.seen, false, matrix);
        gl.uniform3fv(uniform.light, lightOf(view));
        gl.uniform3fv(uniform.toward, view.toward);
        gl.bindBuffer(gl.ARRAY_BUFFER, axisBuffer);
        gl.bufferData(gl.ARRAY_BUFFER, axis, gl.DYNAMIC_DRAW);
        lines(axisBuffer, axis.length / 3, colors.axis);
        gl.enable(gl.POLYGON_OFFSET_FILL);
        gl.polygonOffset(1, 1);
        for (const clear of [false, true]) {  // what is seen through comes last and hides nothing
          gl.depthMask(!clear);
          parts.forEach((part, k) => {
            if (Boolean(part.clear) !== clear) return;
            const buffers = buffersOf(part);
            attribute(place, buffers.positions);
            attribute(normal, buffers.normals);
            gl.uniform4fv(uniform.color, colors.parts[k]);
            gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.index);
            gl.drawElements(gl.TRIANGLES, part.index.length, gl.UNSIGNED_INT, 0);
            lines(buffers.lines, part.lines.length / 3, k ? colors.edges : colors.outline);
          });
        }
        gl.depthMask(true);
      },
    };
  };

  const css = (color, shade) => `rgba(${color.slice(0, 3).map((value) => Math.round(255 * Math.min(1, value * shade))).join(",")},${color[3]})`;

  window.gapbeam.canvasPainter = (canvas) => {
    const pen = canvas.getContext("2d");
    return {
      kind: "canvas",
      paint(parts, axis, view, colors) {
        const light = lightOf(view);
        const seen = (values, k) => {
          const point = [values[3 * k] - view.center[0], values[3 * k + 1] - view.center[1], values[3 * k + 2] - view.center[2]];
          return [0.5 * canvas.width + view.scale * dot(point, view.right), 0.5 * canvas.height - view.scale * dot(point, view.up), dot(point, view.toward)];
        };
        pen.clearRect(0, 0, canvas.width, canvas.height);
        pen.lineWidth = Math.max(1, canvas.width / 1000);
        const strokes = (values, color) => {
          pen.strokeStyle = css(color, 1);
          pen.beginPath();
          for (let k = 0; k < values.length / 3; k += 2) {
            pen.moveTo(...seen(values, k).slice(0, 2));
            pen.lineTo(...seen(values, k + 1).slice(0, 2));
          }
          pen.stroke();
        };
        strokes(axis, colors.axis);
        const pieces = [];
        parts.forEach((part, p) => {
          for (let k = 0; k < part.index.length; k += 3) {
            const numbers = part.index.subarray(k, k + 3), points = [...numbers].map((n) => seen(part.positions, n));
            const normal = part.normals.subarray(3 * numbers[0], 3 * numbers[0] + 3);
            const facing = dot(normal, view.toward) < 0 ? -1 : 1;
            const shade = 0.62 + 0.42 * Math.max(0, facing * dot(normal, light));
            pieces.push({ points, depth: points[0][2] + points[1][2] + points[2][2] + (part.clear ? 1e9 : 0), fill: css(colors.parts[p], shade), solid: !part.clear });
          }
        });
        pieces.sort((a, b) => a.depth - b.depth);
        for (const piece of pieces) {
          pen.fillStyle = piece.fill;
          pen.beginPath();
          piece.points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
          pen.closePath();
          pen.fill();
          if (piece.solid) { pen.strokeStyle = piece.fill; pen.stroke(); }  // no seams between triangles
        }
        parts.forEach((part, k) => { if (part.clear) strokes(part.lines, colors.edges); });
      },
    };
  };
})();
