// What WebGL is asked for: shaded surfaces, lines of any width, dots.
const SURFACE = [`#version 300 es
in vec3 p; uniform mat4 model, view; out vec3 eye;
void main() { vec4 e = view * model * vec4(p, 1.0); eye = e.xyz; gl_Position = e; }`, `#version 300 es
precision highp float; in vec3 eye; uniform vec4 colour; uniform vec3 stretch; out vec4 ink;
void main() {
  vec3 n = normalize(cross(dFdx(eye * stretch), dFdy(eye * stretch)));
  float light = 0.55 + 0.45 * abs(dot(n, normalize(vec3(0.25, 0.45, 0.85))));
  ink = vec4(colour.rgb * light, colour.a);
}`];

const LINE = [`#version 300 es
in vec2 corner; in vec3 a, b; in vec4 colour_a, colour_b;
uniform mat4 view; uniform vec2 pixels; uniform float width, nearer; out vec4 colour;
void main() {
  vec4 pa = view * vec4(a, 1.0), pb = view * vec4(b, 1.0);
  vec2 way = (pb.xy - pa.xy) * pixels;
  vec2 along = length(way) > 1e-6 ? normalize(way) : vec2(1.0, 0.0);
  vec4 p = mix(pa, pb, corner.x);
  p.xy += (vec2(-along.y, along.x) * corner.y + along * (2.0 * corner.x - 1.0) * 0.5) * width / pixels;
  p.z -= nearer;
  gl_Position = colour_b.a == 0.0 ? vec4(2.0, 2.0, 2.0, 1.0) : p;
  colour = vec4(mix(colour_a.rgb, colour_b.rgb, corner.x), colour_b.a);
}`, `#version 300 es
precision mediump float; in vec4 colour; out vec4 ink; void main() { ink = colour; }`];

const DOT = [`#version 300 es
in vec3 p; uniform mat4 view; uniform float size;
void main() { gl_Position = view * vec4(p, 1.0); gl_Position.z -= 0.0003; gl_PointSize = size; }`, `#version 300 es
precision mediump float; uniform vec4 colour; out vec4 ink;
void main() {
  float r = length(gl_PointCoord - 0.5);
  if (r > 0.5) discard;
  ink = r > 0.36 ? vec4(1.0, 1.0, 1.0, 1.0) : colour;
}`];

function drawingOn(canvas) {
  const gl = canvas.getContext('webgl2', {antialias: true, preserveDrawingBuffer: true});
  if (!gl) return null;

  const program = ([vertex, fragment]) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || 'WebGL program');
    return {
      use: () => gl.useProgram(made),
      at: (name) => gl.getAttribLocation(made, name),
      matrix: (name, m) => gl.uniformMatrix4fv(gl.getUniformLocation(made, name), false, m),
      numbers: (name, ...v) => gl[`uniform${v.length}f`](gl.getUniformLocation(made, name), ...v),
    };
  };
  const surface = program(SURFACE), line = program(LINE), dot = program(DOT);

  const buffer = (data, target = gl.ARRAY_BUFFER) => {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return made;
  };
  const attribute = (location, from, size, kind, offset, divisor) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, from);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, kind, kind === gl.UNSIGNED_BYTE, 0, offset);
    gl.vertexAttribDivisor(location, divisor);
  };
  const corners = buffer(new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]));

  return {
    surface: (xyz, triangles) => {
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      attribute(surface.at('p'), buffer(xyz), 3, gl.FLOAT, 0, 0);
      buffer(triangles, gl.ELEMENT_ARRAY_BUFFER);
      gl.bindVertexArray(null);
      return {vao, count: triangles.length};
    },
    // Segments between neighbours; a point with alpha 0 is not drawn to.
    lines: (xyz, colours) => {
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      const points = buffer(xyz), inks = buffer(colours);
      attribute(line.at('corner'), corners, 2, gl.FLOAT, 0, 0);
      attribute(line.at('a'), points, 3, gl.FLOAT, 0, 1);
      attribute(line.at('b'), points, 3, gl.FLOAT, 12, 1);
      attribute(line.at('colour_a'), inks, 4, gl.UNSIGNED_BYTE, 0, 1);
      attribute(line.at('colour_b'), inks, 4, gl.UNSIGNED_BYTE, 4, 1);
      gl.bindVertexArray(null);
      return {vao, buffers: [points, inks], count: Math.max(0, xyz.length / 3 - 1)};
    },
    dots: (xyz) => {
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      const points = buffer(xyz);
      attribute(dot.at('p'), points, 3, gl.FLOAT, 0, 0);
      gl.bindVertexArray(null);
      return {vao, buffers: [points], count: xyz.length / 3};
    },
    forget: (thing) => {
      if (!thing) return;
      thing.buffers.forEach((b) => gl.deleteBuffer(b));
      gl.deleteVertexArray(thing.vao);
    },
    begin: () => {
      const ratio = window.devicePixelRatio || 1;
      const wide = Math.max(1, Math.round(canvas.clientWidth * ratio));
      const high = Math.max(1, Math.round(canvas.clientHeight * ratio));
      if (canvas.width !== wide || canvas.height !== high) {
        canvas.width = wide;
        canvas.height = high;
      }
      gl.viewport(0, 0, wide, high);
      gl.clearColor(1, 1, 1, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    },
    drawSurface: (thing, view, model, colour, stretch) => {
      surface.use();
      surface.matrix('view', view);
      surface.matrix('model', model);
      surface.numbers('colour', ...colour);
      surface.numbers('stretch', ...stretch);
      gl.depthMask(colour[3] === 1);
      gl.bindVertexArray(thing.vao);
      gl.drawElements(gl.TRIANGLES, thing.count, gl.UNSIGNED_INT, 0);
      gl.depthMask(true);
    },
    drawLines: (thing, view, width, nearer) => {
      if (!thing || thing.count === 0) return;
      const ratio = window.devicePixelRatio || 1;
      line.use();
      line.matrix('view', view);
      line.numbers('pixels', 0.5 * canvas.width, 0.5 * canvas.height);
      line.numbers('width', 0.5 * width * ratio);
      line.numbers('nearer', nearer);
      gl.bindVertexArray(thing.vao);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, thing.count);
    },
    drawDots: (thing, view, size, colour) => {
      if (!thing || thing.count === 0) return;
      dot.use();
      dot.matrix('view', view);
      dot.numbers('size', size * (window.devicePixelRatio || 1));
      dot.numbers('colour', ...colour);
      gl.bindVertexArray(thing.vao);
      gl.drawArrays(gl.POINTS, 0, thing.count);
    },
  };
}
