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
const times = (m, v) => [0, 1, 2].map((i) => m[i] * v[0] + m[3 + i] * v[1] + m[6 + i] * v[2]);

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
  const faces = [], meeting = new Map();
  const key = (i) => corners.slice(i, i + 3).map((x) => Math.round(x * 1e5)).join();
  for (let i = 0; i < corners.length; i += 9) {
    const [a, b, c] = [0, 3, 6].map((k) => corners.slice(i + k, i + k + 3));
    const normal = cross(less(b, a), less(c, a)), face = { normal, unit: unit(normal) };
    faces.push(face);
    for (let k = i; k < i + 9; k += 3) {
      const name = key(k);
      if (!meeting.has(name)) meeting.set(name, []);
      meeting.get(name).push(face);
    }
  }
  const normals = new Float32Array(corners.length);
  for (let k = 0; k < corners.length; k += 3) {
    const own = faces[Math.floor(k / 9)], sum = [0, 0, 0];
    for (const face of meeting.get(key(k))) {
      const cosine = dot(face.unit, own.unit);
      if (Math.abs(cosine) > 0.8) face.normal.forEach((x, i) => { sum[i] += Math.sign(cosine) * x; });
    }
    normals.set(unit(sum), k);
  }
  return normals;
};

// --- Programs of the graphics card

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
  const corners = [], round = (k) => [0.35 * Math.cos(k * Math.PI / 12), 0.35 * Math.sin(k * Math.PI / 12), -1];
  for (let k = 0; k < 24; k++) corners.push(0, 0, 0, ...round(k), ...round(k + 1), 0, 0, -1, ...round(k + 1), ...round(k));
  return new Float32Array(corners.map((x) => x * HEAD));
})();

// A canvas with its programs; what it draws are arrays of corners, segments or points.
class Painter {
  constructor(gl) {
    this.gl = gl;
    this.programs = [SURFACE, SEGMENT, BALL].map((sources) => this.program(sources));
    this.cone = this.array(CONE, normalsOf([...CONE]));
    this.loose = this.array(new Float32Array(3 * 512));
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
    const places = {};
    for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(made, k);
      places[name] = gl.getUniformLocation(made, name);
    }
    return { made, places };
  }

  // Points on the card (n by 3), with normals if they are corners of triangles.
  array(points, normals) {
    const gl = this.gl, held = { count: points.length / 3, buffer: gl.createBuffer() };
    gl.bindBuffer(gl.ARRAY_BUFFER, held.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.DYNAMIC_DRAW);
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
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.loose.buffer);
    if (points.length > 3 * this.loose.count) {
      gl.bufferData(gl.ARRAY_BUFFER, points, gl.DYNAMIC_DRAW);
      this.loose.count = points.length / 3;
    } else gl.bufferSubData(gl.ARRAY_BUFFER, 0, points);
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
      if (places.screen) gl.uniform2f(places.screen, width, height);
    }
  }

  use(index, colour, turn, shift = [0, 0, 0]) {
    const gl = this.gl, { made, places } = this.programs[index];
    gl.useProgram(made);
    gl.uniformMatrix3fv(places.turn, false, turn);
    gl.uniform3fv(places.shift, shift);
    gl.uniform4fv(places.colour, colour);
    return places;
  }

  surface(held, colour, turn, painted, shift) {
    const gl = this.gl, places = this.use(0, colour, turn, shift);
    gl.uniform1f(places.painted, painted);
    gl.depthMask(colour[3] === 1);
    gl.bindVertexArray(held.points);
    gl.drawArrays(gl.TRIANGLES, 0, held.count);
    gl.depthMask(true);
  }

  line(held, count, colour, turn, width) {
    if (count < 2) return;
    const gl = this.gl, places = this.use(1, colour, turn);
    gl.uniform1f(places.width, width);
    gl.bindVertexArray(held.segments);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count - 1);
  }

  dots(held, count, colour, turn, width) {
    const gl = this.gl, places = this.use(2, colour, turn);
    gl.uniform1f(places.width, width);
    gl.bindVertexArray(held.points);
    gl.drawArrays(gl.POINTS, 0, count);
  }
}
