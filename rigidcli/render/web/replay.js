// Replays the motions on a page: each figure of the class rigidcli-replay has its data in a script element.

// Colours by the style of a mark, which the colour-blind can tell apart (Okabe and Ito, 2008), on light and
// on dark pages; then that of marks which are there for orientation only, and that round the names.
const LIGHT = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#333333", "#56B4E9", "#8A8A8A", "#FFFFFF"];
const DARK = ["#4FB0F0", "#FF8A3D", "#2FCB9C", "#E79FCB", "#DDDDDD", "#6FB8E0", "#85858D", "#000000"];
const [QUIET, HALO] = [6, 7];

const WIDTHS = { thin: 1.2, line: 2, arrow: 3.5 };   // of lines, in CSS pixels
const SIZES = { few: 18, some: 10, many: 5 };         // diameters of dots, in CSS pixels
const VIEWS = { space: [-2.2, -1.2], flat: [0, 0] }; // yaw and pitch (rad) at the beginning
const MOST_FILLED = 0.88;                            // of the canvas, by what is shown
const ROOM = 60;                                     // for names above and below it, in CSS pixels
const MOST_DOUBLINGS = 6;                            // of the speed, up or down
const LONGEST_FRAME = 0.1;                           // the most seconds that pass from frame to frame
const STEPS = 100;                                   // steps of the arrow keys from beginning to end
const MOST_DIGITS = 5;                                // of the readings, which change all the time
const PAINTED = 0.22;                                // how much darker every other octant of a body is
const FAINT = 0.3;                                   // the colour of a path that is still to come, on the page
const LEAST_SEEN = 0.45;                             // of the reach of a stage: what is seen end on has room to turn
const POSES = 24;                                    // of a body, and points of a part, that show how far it reaches
const MOST_CORNERS = 300;
const APART = 18;                                    // least distance of the names of arrows, in CSS pixels

const floats = (text, Kind) => new Kind(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);

// A colour as the card wants it; what lets others shine through has an opacity below 1.
const rgba = (colour, opacity = 1) =>
  [...[1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16) / 255), opacity];

// A colour that is nearly that of the page.
const faint = (colour, page) => {
  const [mine, others] = [rgba(colour), rgba(page)];
  return mine.map((x, k) => FAINT * x + (1 - FAINT) * others[k]);
};

// The view from a direction, as a matrix.
const viewed = (yaw, pitch) => {
  const [[cy, sy], [cp, sp]] = [yaw, pitch].map((angle) => [Math.cos(angle), Math.sin(angle)]);
  return [cy, cp * sy, sp * sy, -sy, cp * cy, sp * cy, 0, -sp, cp];
};

class Replay {
  constructor(figure) {
    this.figure = figure;
    this.find = (selector) => figure.querySelector(selector);
    const data = JSON.parse(this.find('script[type="application/json"]').textContent);
    this.digits = Math.min(data.digits, MOST_DIGITS);
    const arrays = data.arrays.map((text) => floats(text, Float32Array));
    this.motions = [data, ...data.others ?? []].map((motion) => this.unpack(motion, arrays));
    this.load(this.motions[0]);
    [this.time, this.doublings] = [this.start, 0];
    this.playing = this.inView = this.met = false;
    this.hidden = new Set();
    this.fingers = new Map();
    this.actions = {
      play: () => this.play(!this.playing),
      slower: () => this.change(-1), faster: () => this.change(1),
      in: () => this.magnify(1.2), out: () => this.magnify(1 / 1.2),
      reset: () => this.reset(),
    };
    this.still = this.times.length < 2;                // a body at rest has no time to choose
    for (const each of figure.querySelectorAll("[hidden]")) each.hidden = false;
    for (const each of this.still ? figure.querySelectorAll(".timed") : []) each.hidden = true;
    this.listen();
    this.listenTo(this.find("canvas"));
    this.choose(0);
    this.change(0);
    this.read();
    this.tell("");
  }

  unpack(sent, arrays) {
    const motion = {
      ...sent,
      times: floats(sent.times, Float64Array),
      readings: sent.readings.map(({ unit, values }) => ({ unit, values: floats(values, Float64Array) })),
      orientation: sent.orientation && floats(sent.orientation, Float32Array),
      turns: sent.turns && floats(sent.turns, Float32Array),
    };
    for (const part of motion.stages.flatMap((stage) => stage.parts)) {
      part.points = arrays[part.points];
      part.size = part.motion === "traced" ? 3 : part.count;  // the numbers at a time of what moves
    }
    return motion;
  }

  load(motion) {
    const { times, readings, orientation, turns, stages, seconds } = motion;
    Object.assign(this, { times, readings, orientation, turns, stages });
    [this.start, this.end] = [times.at(0), times.at(-1)];
    this.duration = this.end - this.start;
    this.pace = this.duration / seconds;
  }

  // Another value of a sweep: the motion, as far as before, and the results that belong to it.
  vary(place) {
    const share = (this.time - this.start) / this.duration, stage = this.stages.indexOf(this.stage);
    this.load(this.motions[place]);
    this.time = this.start + share * this.duration;
    this.stage = this.stages[Math.min(stage, this.stages.length - 1)];
    const slider = this.find(".choice input"), name = JSON.parse(slider.dataset.names)[place];
    this.find(".choice output").textContent = name;
    slider.setAttribute("aria-valuetext", name);
    const results = this.figure.closest("section")?.querySelectorAll(".chosen") ?? [];
    results.forEach((each, k) => { each.hidden = k !== place; });
    dispatchEvent(new Event("resize"));  // the formulas in them are fitted
    this.dress();
    this.change(0);
    this.read();
  }

  // --- What a reader does

  listen() {
    for (const each of this.figure.querySelectorAll("button")) each.onclick = this.actions[each.dataset.do];
    this.slider = this.find(".controls input");
    this.slider.oninput = () => this.go(this.start + this.slider.value / this.slider.max * this.duration);
    const choice = this.find(".choice input");
    if (choice) choice.oninput = () => this.vary(+choice.value);
    this.find("select").onchange = (event) => this.choose(+event.target.value);
    const stage = this.find(".stage");
    new ResizeObserver(() => this.ask()).observe(stage);
    new IntersectionObserver((entries) => this.meet(entries.at(-1).isIntersecting)).observe(stage);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.dress());
  }

  listenTo(canvas) {
    this.canvas = canvas;
    canvas.onkeydown = (event) => this.press(event);
    canvas.onpointerdown = (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, event);
    };
    canvas.onpointermove = (event) => this.drag(event);
    canvas.onpointerup = canvas.onpointercancel = (event) => this.fingers.delete(event.pointerId);
    canvas.addEventListener("wheel", (event) => {
      // A page that is scrolled goes on over the picture, unless that was clicked, or is pinched.
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      this.magnify(Math.exp(-event.deltaY / 500));
    }, { passive: false });
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.painter = null;
      this.taken = true;
      this.tell("The browser has put this picture aside: play goes on with it.");
    });
  }

  press(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = this.duration / STEPS;
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    const keys = {
      " ": this.actions.play, "+": this.actions.in, "=": this.actions.in, "-": this.actions.out,
      0: this.actions.reset,
      ArrowLeft: () => this.go(this.time - step), ArrowRight: () => this.go(this.time + step),
      ArrowUp: this.actions.faster, ArrowDown: this.actions.slower,
      Home: () => this.go(this.start), End: () => this.go(this.end),
    };
    const way = event.shiftKey && turns[event.key], done = way ? () => this.turn(...way) : keys[event.key];
    if (!done) return;
    event.preventDefault();
    done();
  }

  drag(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const other = [...this.fingers.values()].find((finger) => finger !== before);
    const apart = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY) || 1;
    if (other) this.magnify(apart(event) / apart(before));
    else this.turn((event.clientX - before.clientX) / 150, (event.clientY - before.clientY) / 150);
    this.fingers.set(event.pointerId, event);
  }

  // It plays by itself when it is first seen, unless its reader wants less motion; out of view it rests.
  meet(inView) {
    this.inView = inView;
    if (inView && !this.met && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
    this.met ||= inView;
    this.ask();
  }

  play(playing) {
    this.playing = playing && !this.still;
    this.find("[data-do=play]").textContent = playing ? "Pause" : "Play";
    this.ask();
  }

  go(time) {
    this.met = true;
    this.play(false);
    this.time = Math.min(Math.max(time, this.start), this.end);
  }

  change(doublings) {
    this.doublings = Math.min(Math.max(this.doublings + doublings, -MOST_DOUBLINGS), MOST_DOUBLINGS);
    const ratio = this.pace * 2 ** this.doublings;
    const figures = ratio < 1e5 ? Number(ratio.toPrecision(2)) : ratio.toExponential(1);
    this.find(".speed").textContent = `${figures} × real time`;
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(Math.max(this.pitch + pitch, -Math.PI), 0);
    this.ask();
  }

  magnify(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.2), 20);
    this.ask();
  }

  reset() {
    [this.yaw, this.pitch] = VIEWS[this.stage.flat ? "flat" : "space"];
    this.zoom = 1;
    this.ask();
  }

  choose(place) {
    this.stage = this.stages[place];
    this.dress();
    this.reset();
  }

  // The legend, whose boxes show and hide, and the labels, in the colours of the page.
  dress() {
    const [r, g, b] = getComputedStyle(this.figure).color.match(/[\d.]+/g);
    const colours = this.colours = +r + +g + +b > 384 ? DARK : LIGHT;
    const legend = this.find(".legend"), labels = this.find(".labels"), named = new Set();
    legend.replaceChildren();
    labels.replaceChildren();
    labels.style.textShadow = `0 0 3px ${colours[HALO]}, 0 0 3px ${colours[HALO]}`;
    for (const part of this.stage.parts) {
      part.colour = colours[part.quiet ? QUIET : part.style % QUIET];
      const name = part.name = part.group || part.label;
      if (part.form === "arrow") {
        part.sign = Object.assign(document.createElement("span"), { textContent: part.label });
        labels.append(part.sign);
        part.sign.style.color = part.colour;
      }
      if (!name || named.has(name)) continue;
      named.add(name);
      const entry = legend.appendChild(document.createElement("label")), box = document.createElement("input");
      const toggle = () => { this.hidden[box.checked ? "delete" : "add"](name); this.ask(); };
      Object.assign(box, { type: "checkbox", checked: !this.hidden.has(name), onchange: toggle });
      box.style.accentColor = part.colour;
      entry.append(box, " ", name);
    }
    this.ask();
  }

  tell(words) {
    Object.assign(this.find(".trouble"), { textContent: words, hidden: !words });
  }

  // --- What is drawn

  ask() {
    this.asked ||= requestAnimationFrame((now) => this.frame(now));
  }

  frame(now) {
    this.asked = 0;
    const passed = Math.min((now - this.before) / 1000 || 0, LONGEST_FRAME);
    this.before = this.playing && this.inView ? now : NaN;
    if (!this.inView) return;
    if (this.playing) {
      const gone = this.time + passed * this.pace * 2 ** this.doublings - this.start;
      this.time = this.start + gone % this.duration;
      this.ask();
    }
    this.read();
    if (this.painter || this.open()) this.draw();
  }

  // A painter for the canvas; for a new one where the browser has taken what the old one held.
  open() {
    if (this.lacking) return null;
    if (this.taken) {
      const fresh = this.canvas.cloneNode();
      this.canvas.replaceWith(fresh);
      this.listenTo(fresh);
    }
    const gl = this.canvas.getContext("webgl2", { antialias: true });
    this.lacking = !gl;
    this.tell(gl ? "" : "This browser has no WebGL2, which the picture needs; the readings go on without it.");
    this.painter = gl && new Painter(gl);
    for (const { stages } of this.motions) for (const { parts } of stages) for (const part of parts) part.held = null;
    return this.painter;
  }

  // The readings are those of the nearest sample, so that each digit is right.
  read() {
    if (this.still) return;
    // The last sample that is not later, and how far the time is on the way from it to the next.
    const row = this.row = Math.min(this.times.findLastIndex((t) => t <= this.time), this.times.length - 2);
    this.share = (this.time - this.times[row]) / (this.times[row + 1] - this.times[row]);
    const shown = this.figure.querySelectorAll(".readings dd"), nearest = row + Math.round(this.share);
    this.readings.forEach(({ unit, values }, place) => {
      shown[place].textContent = `${this.rounded(values[nearest])} ${unit}`;
    });
    this.slider.value = (this.time - this.start) / this.duration * this.slider.max;
    this.slider.setAttribute("aria-valuetext", `t = ${shown[0].textContent}`);
  }

  rounded(value) {
    const isSmall = value && Math.abs(value) < 1e-3;
    return isSmall ? value.toExponential(this.digits - 1) : value.toPrecision(this.digits);
  }

  // The points of a part now, which lie between two of its samples, and the place of the earlier one.
  now(part) {
    if (part.motion === "still") return { points: part.points };
    const row = this.row, size = part.size, from = row * size, way = this.share;
    const points = Float32Array.from({ length: size }, (_, k) => {
      const value = part.points[from + k];
      return value + way * (part.points[from + size + k] - value);
    });
    return { points, row };
  }

  // The matrix from the body to space: the turn from one sample to the next goes on evenly, on the sphere.
  attitude() {
    if (!this.orientation) return IDENTITY;
    const turn = [...this.turns.subarray(3 * this.row, 3 * this.row + 3)].map((x) => x * this.share);
    const angle = Math.hypot(...turn), factor = angle ? Math.sin(angle / 2) / angle : 0;
    const way = [Math.cos(angle / 2), ...turn.map((x) => x * factor)];
    return matrix(compose([...this.orientation.subarray(4 * this.row, 4 * this.row + 4)], way));
  }

  // Half of the width and of the height of all that a stage shows, as it is seen at the beginning.
  // It is that of all values of a sweep, so that they can be compared.
  extent(place) {
    const each = this.motions.map((motion) => this.seen(motion, motion.stages[place])).filter(Boolean);
    return [0, 1].map((k) => Math.max(...each.map((extent) => extent[k])));
  }

  seen({ orientation }, stage) {
    if (!stage || stage.flat) return stage?.half;
    const seen = viewed(...VIEWS.space), count = (orientation?.length ?? 4) / 4;
    const poses = Array.from({ length: POSES }, (_, k) => 4 * Math.round(k * (count - 1) / (POSES - 1)));
    let [x, y] = [LEAST_SEEN, LEAST_SEEN];
    for (const { points, carried, motion } of stage.parts) {
      const turns = carried ? poses.map((at) => matrix([...orientation.subarray(at, at + 4)])) : [IDENTITY];
      const most = (motion === "still" ? 1 : POSES) * MOST_CORNERS / this.motions.length;
      const step = 3 * Math.ceil(points.length / 3 / most);
      for (let i = 0; i < points.length; i += step) {
        for (const turn of turns) {
          const eye = turned(seen, less(turned(turn, points.subarray(i, i + 3)), stage.centre));
          const near = DISTANCE / (DISTANCE - eye[2]);
          [x, y] = [Math.max(x, Math.abs(eye[0]) * near), Math.max(y, Math.abs(eye[1]) * near)];
        }
      }
    }
    return [x, y];
  }

  camera() {
    const { width, height } = this.canvas, [x, y] = this.stage.extent ??= this.extent(this.stages.indexOf(this.stage));
    const filled = Math.min(MOST_FILLED, 1 - ROOM / this.canvas.clientHeight);
    const focus = filled * DISTANCE * this.zoom * Math.min(width / height / (x || 1e-9), 1 / (y || 1e-9));
    return {
      matrix: viewed(this.yaw, this.pitch),
      centre: this.stage.centre,
      zoom: [focus * height / width, focus],
    };
  }

  draw() {
    const canvas = this.canvas, ratio = this.ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * ratio) || 1);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const camera = this.camera(), attitude = this.attitude();
    this.painter.begin(camera);
    this.signs = [];
    for (const part of this.stage.parts) {
      const shown = !this.hidden.has(part.name), turn = part.carried ? attitude : IDENTITY;
      if (part.sign) part.sign.hidden = !shown;
      if (shown) this[part.form](part, turn, camera);
    }
  }

  // The array of all points of a part, which the card keeps.
  held(part) {
    return part.held ||= part.form === "faces"
      ? this.painter.array(part.points, normalsOf([...part.points])) : this.painter.array(part.points);
  }

  faces(part, turn) {
    // Paint shows how a body turns; on one at rest it looks like damage. A hole is dark, to be seen on its body.
    const [opacity, painted] = part.quiet ? [0.55, 0] : [1, part.carried ? PAINTED : 0];
    const look = { colour: rgba(part.colour, opacity), turn, painted };
    this.painter.draw(FACES, this.held(part), part.points.length / 3, look);
  }

  line(part, turn) {
    const { points, row } = this.now(part), opacity = part.quiet && part.motion === "traced" ? 0.5 : 1;
    const width = (part.quiet ? WIDTHS.thin : WIDTHS.line) * this.ratio;
    const look = { colour: rgba(part.colour, opacity), turn, width };
    if (part.motion === "sampled") {
      this.painter.draw(LINE, this.painter.once(points), points.length / 3, look);
    } else if (part.motion === "still" || part.quiet) {
      this.painter.draw(LINE, this.held(part), part.points.length / 3, look);
    } else {
      const ahead = { colour: faint(part.colour, this.colours[HALO]), turn, width: WIDTHS.thin * this.ratio };
      this.painter.draw(LINE, this.held(part), part.points.length / 3, ahead);
      const last = [...part.points.subarray(3 * row, 3 * row + 3), ...points];
      this.painter.draw(LINE, this.held(part), row + 1, look);
      this.painter.draw(LINE, this.painter.once(last), 2, look);
    }
  }

  dots(part, turn) {
    const { points } = this.now(part), count = points.length / 3;
    const size = part.quiet || count > 100 ? SIZES.many : count > 12 ? SIZES.some : SIZES.few;
    const held = part.motion === "still" ? this.held(part) : this.painter.once(points);
    this.painter.draw(DOTS, held, count, { colour: rgba(part.colour), turn, width: size * this.ratio });
  }

  arrow(part, turn, camera) {
    const { points } = this.now(part);
    const [from, to] = [points.slice(0, 3), points.slice(3)].map((p) => turned(turn, p));
    const way = less(to, from), length = Math.hypot(...way), axis = unit(way), colour = rgba(part.colour);
    const [width, size] = part.quiet ? [WIDTHS.thin, 0.6] : [WIDTHS.arrow, 1];
    if (length) {
      const end = to.map((x, k) => x - axis[k] * Math.min(HEAD * size, length) / 2);
      const shaft = { colour, turn: IDENTITY, width: width * this.ratio };
      this.painter.draw(LINE, this.painter.once([...from, ...end]), 2, shaft);
      const head = onto(axis).map((x) => x * Math.min(size, length / HEAD));
      this.painter.draw(FACES, this.painter.cone, CONE.length / 3, { colour, turn: head, shift: to });
    }
    this.sign(part, from, to, camera);
  }

  // The name of an arrow stands beyond its tip; a long one beside it, so that it stays in the picture.
  sign(part, from, to, camera) {
    const [[x0, y0], [x, y]] = [from, to].map((point) => {
      const eye = turned(camera.matrix, less(point, camera.centre)), depth = DISTANCE - eye[2];
      return [(1 + eye[0] * camera.zoom[0] / depth) / 2, (1 - eye[1] * camera.zoom[1] / depth) / 2];
    });
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [dx, dy] = unit([(x - x0) * width, (y - y0) * height, 0]), isLong = part.label.length > 3;
    const beyond = (d) => `calc(${50 * d - 50}% + ${0.4 * d}em)`;
    const transform = isLong && Math.abs(dx) > Math.abs(dy) ? "translate(-100%, .4em)"
      : `translate(${isLong ? "-1em" : beyond(dx)}, ${beyond(dy)})`;
    // Names at one place stand side by side.
    let left = x * width;
    while (this.signs.some(([a, b]) => Math.hypot(a - left, b - y * height) < APART)) left += APART;
    this.signs.push([left, y * height]);
    Object.assign(part.sign.style, { left: `${left}px`, top: `${100 * y}%`, transform });
  }
}

for (const figure of document.querySelectorAll(".rigidcli-replay:not([data-begun])")) {
  figure.dataset.begun = "";
  new Replay(figure);
}
