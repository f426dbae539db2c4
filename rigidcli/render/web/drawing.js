// Draws surfaces, lines, dots and arrows with WebGL2. Lengths are in units of the reach of what is shown;
// quaternions are (w, x, y, z) and turn vectors from the body to space; matrices are 3 by 3, column after
// column.

const DISTANCE = 5;  // of the eye from the centre
const HEAD = 0.07;   // length of the head of an arrow

// --- Vectors, quaternions and matrices

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => { const length = Math.hypot(...a) || 1; return a.map((x) => x / length); };
const less = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const turned = (m, v) => [0, 1, 2].map((i) => m[i] * v[0] + m[3 + i] * v[1] + m[6 + i] * v[2]);

// The product of quaternions p q: q turns first.
const compose = (p, q) => {
  const v = cross(p.slice(1), q.slice(1));
  return [p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
    ...[1, 2, 3].map((k) => p[0] * q[k] + q[0] * p[k] + v[k - 1])];
};

// The matrix of a unit quaternion.
const matrix = ([w, x, y, z]) => [
  1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
  2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
  2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];

const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1];

// A rotation that brings z onto a unit vector.
const onto = (axis) => {
  const side = unit(cross(Math.abs(axis[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], axis));
  return [...side, ...cross(axis, side), ...axis];
};

// The normals of triangles at their corners: faces that meet at a small angle look round.
const normalsOf = (corners) => {
  const at = (i) => corners.slice(i, i + 3), key = (i) => at(i).map((x) => Math.round(x * 1e5)).join();
  const meeting = new Map(), normals = new Float32Array(corners.length), faces = [];
  for (let i = 0; i < corners.length; i += 3) {
    if (i % 9 === 0) faces.push(cross(less(at(i + 3), at(i)), less(at(i + 6), at(i))));
    const name = key(i);
    if (!meeting.has(name)) meeting.set(name, []);
    meeting.get(name).push(faces.at(-1));
  }
  for (let i = 0; i < corners.length; i += 3) {
    const own = unit(faces[Math.floor(i / 9)]), sum = [0, 0, 0];
    for (const face of meeting.get(key(i))) {
      const cosine = dot(unit(face), own);
      if (Math.abs(cosine) > 0.8) face.forEach((x, k) => { sum[k] += Math.sign(cosine) * x; });
    }
    normals.set(unit(sum), i);
  }
  return normals;
};

// --- Programs of the graphics card

const [FACES, LINE, DOTS] = [0, 1, 2];  // their places in the list

const SEEN = `#version 300 es
precision highp float;
uniform mat3 turn, camera;
uniform vec3 shift, centre;
uniform vec2 zoom;
vec3 eye(vec3 p) { return camera * (turn * p + shift - centre); }
vec4 seen(vec3 p) {
  vec3 e = eye(p);
  float w = ${DISTANCE}.0 - e.z, near = ${DISTANCE}.0 - 3.0, far = ${DISTANCE}.0 + 3.0;
  return vec4(e.xy * zoom, (w * (far + near) - 2.0 * far * near) / (far - near), w);
}`;

const COLOUR = `#version 300 es
precision highp float;
uniform vec4 colour;
out vec4 shown;`;

// Each octant about O is a little darker than its neighbours, so that one sees a round body turn.
const SURFACE = [SEEN + `
in vec3 a, b;
out vec3 normal, place;
void main() { normal = camera * turn * b; place = a; gl_Position = seen(a); }`, COLOUR + `
uniform float painted;
in vec3 normal, place;
void main() {
  vec3 n = normalize(normal);
  float light = 0.45 + 0.55 * abs(dot(n, normalize(vec3(0.3, 0.5, 0.9))));
  float paint = place.x * place.y * (abs(place.z) < 1e-6 ? 1.0 : place.z) < 0.0 ? 1.0 - painted : 1.0;
  shown = vec4(colour.rgb * light * paint, 1.0) * colour.a;
}`];

// A segment from a to b, as wide as asked on the screen, in front of a surface that it lies on; and the wider
// one in front of the other.
const SEGMENT = [SEEN + `
in vec3 a, b;
uniform vec2 screen;
uniform float width;
void main() {
  vec4 start = seen(a), end = seen(b);
  vec2 way = end.xy / end.w * screen - start.xy / start.w * screen;
  way = length(way) > 0.0 ? normalize(way) : vec2(1, 0);
  float side = float(gl_VertexID & 1) * 2.0 - 1.0, ahead = float(gl_VertexID >> 1);
  vec4 p = ahead > 0.0 ? end : start;
  p.xy += (vec2(-way.y, way.x) * side + way * (ahead * 2.0 - 1.0) * 0.5) * width / screen * p.w;
  p.z -= (0.002 + 0.001 * min(width, 4.0)) * p.w;
  gl_Position = p;
}`, COLOUR + `
void main() { shown = vec4(colour.rgb, 1.0) * colour.a; }`];

const BALL = [SEEN + `
in vec3 a;
uniform float width;
void main() { gl_Position = seen(a); gl_Position.z -= 0.01 * gl_Position.w; gl_PointSize = width; }`, COLOUR + `
void main() {
  vec2 p = gl_PointCoord * 2.0 - 1.0;
  float r = dot(p, p);
  if (r > 1.0) discard;
  shown = vec4(colour.rgb * (0.55 + 0.45 * dot(vec3(p.x, -p.y, sqrt(1.0 - r)), vec3(0.27, 0.45, 0.85))), 1.0);
}`];

// The cone of an arrow's head, its tip at the origin and its axis along z.
const CONE = (() => {
  const corners = [], rim = (k) => [0.35 * Math.cos(k * Math.PI / 12), 0.35 * Math.sin(k * Math.PI / 12), -1];
  for (let k = 0; k < 24; k++) {
    corners.push(0, 0, 0, ...rim(k), ...rim(k + 1), 0, 0, -1, ...rim(k + 1), ...rim(k));
  }
  return new Float32Array(corners.map((x) => x * HEAD));
})();

// A canvas with its programs; what it draws are arrays of corners, segments or points.
class Painter {
  constructor(gl) {
    this.gl = gl;
    this.programs = [SURFACE, SEGMENT, BALL].map((sources) => this.program(sources));
    this.cone = this.array(CONE, normalsOf([...CONE]));
    this.loose = this.array(new Float32Array(6));
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program([vertex, fragment]) {
    const gl = this.gl, made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, 0, "a");
    gl.bindAttribLocation(made, 1, "b");
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const names = ["turn", "shift", "camera", "centre", "zoom", "screen", "colour", "width", "painted"];
    return { made, places: Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(made, name)])) };
  }

  // Points on the card (n by 3), with normals if they are corners of triangles.
  array(points, normals) {
    const gl = this.gl, held = { buffer: gl.createBuffer() };
    gl.bindBuffer(gl.ARRAY_BUFFER, held.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW);
    const attribute = (place, offset, divisor) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 12, offset);
      gl.vertexAttribDivisor(place, divisor);
    };
    gl.bindVertexArray(held.points = gl.createVertexArray());
    attribute(0, 0, 0);
    if (normals) {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, normals, gl.STATIC_DRAW);
      attribute(1, 0, 0);
    } else {
      gl.bindVertexArray(held.segments = gl.createVertexArray());
      attribute(0, 0, 1);
      attribute(1, 12, 1);
    }
    return held;
  }

  // The array for what is drawn once, with these points.
  once(points) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.loose.buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, new Float32Array(points), this.gl.STREAM_DRAW);
    return this.loose;
  }

  // Begins a frame, seen by a camera.
  begin(camera) {
    const gl = this.gl, { width, height } = gl.canvas;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const { made, places } of this.programs) {
      gl.useProgram(made);
      gl.uniformMatrix3fv(places.camera, false, camera.matrix);
      gl.uniform3fv(places.centre, camera.centre);
      gl.uniform2fv(places.zoom, camera.zoom);
      gl.uniform2f(places.screen, width, height);
    }
  }

  // Draws so many points of an array as triangles, as a line, or as dots.
  draw(kind, held, count, { colour, turn, shift = [0, 0, 0], width = 0, painted = 0 }) {
    const gl = this.gl, { made, places } = this.programs[kind];
    gl.useProgram(made);
    gl.uniformMatrix3fv(places.turn, false, turn);
    gl.uniform3fv(places.shift, shift);
    gl.uniform4fv(places.colour, colour);
    gl.uniform1f(places.width, width);
    gl.uniform1f(places.painted, painted);
    gl.depthMask(kind !== FACES || colour[3] === 1);  // what shines through hides nothing
    gl.bindVertexArray(kind === LINE ? held.segments : held.points);
    if (kind !== LINE) gl.drawArrays(kind === FACES ? gl.TRIANGLES : gl.POINTS, 0, count);
    else if (count > 1) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count - 1);
    gl.depthMask(true);
  }
}
