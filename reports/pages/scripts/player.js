// Playback of runs. The films of a figure share one clock; each is drawn into the layers of its still picture.
// Poses are x, y, z (units of the picture, y up) and a quaternion for each body and moment; see film.py.

const HEIGHT = 300;
const PLACE_STEPS = 40; // of a mark, per unit
const ANGLE_STEPS = 10000; // of a mark, per radian
const TURN_STEPS = 32000;
const STRENGTH_STEPS = 1000;
const SPEEDS = [1, 1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50];
const PLEASANT = 8; // seconds that a whole run may take
const AFTERGLOW = 0.35; // seconds on the screen that an impulse stays

function wholeNumbers(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 2 }, (_, k) => view.getInt16(2 * k, true));
}

// The point p of a body whose pose is [x, y, z, quaternion]: p + 2 w (u × p) + 2 u × (u × p), then the origin.
function placed([ox, oy, oz, ux, uy, uz, w], x, y, z) {
  const [a, b, c] = [uy * z - uz * y, uz * x - ux * z, ux * y - uy * x];
  return [ox + x + 2 * (w * a + uy * c - uz * b), HEIGHT - (oy + y + 2 * (w * b + uz * a - ux * c)),
    oz + z + 2 * (w * c + ux * b - uy * a)];
}

class Film {
  constructor(panel) {
    const told = JSON.parse(panel.querySelector("script.film").textContent);
    Object.assign(this, told);
    this.poses = wholeNumbers(told.poses);
    this.marks = wholeNumbers(told.marks);
    this.stage = panel.querySelector("svg > .cell");
    panel.querySelectorAll("svg > .cell:not(:first-of-type)").forEach((cell) => cell.remove());
    for (const [name, value] of Object.entries({ x: 0, y: 0, width: 400, height: 300 })) this.stage.setAttribute(name, value);
    this.layer = (name) => this.stage.querySelector(`[data-layer=${name}]`);
    this.clock = this.stage.querySelector("text");
    this.clock.setAttribute("font-size", 13);
  }

  get end() {
    return this.times[this.times.length - 1];
  }

  // Shortly before anything touches; never where nothing does.
  get start() {
    return this.marks.length ? Math.max(this.times[this.marks[0]] - 0.03, 0) : Infinity;
  }

  // The last moment that is not after a time.
  momentAt(time) {
    let [low, high] = [0, this.times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  // Poses of all bodies, straight between two moments.
  posesAt(time) {
    const before = this.momentAt(time);
    const after = Math.min(before + 1, this.times.length - 1);
    const gap = this.times[after] - this.times[before];
    const share = gap > 0 ? Math.min((time - this.times[before]) / gap, 1) : 0;
    return Array.from({ length: this.bodies }, (_, body) => {
      const entry = (moment, k) => this.poses[7 * (moment * this.bodies + body) + k];
      const pose = Array.from({ length: 7 }, (_unused, k) => (1 - share) * entry(before, k) + share * entry(after, k));
      const size = Math.hypot(...pose.slice(3)) || TURN_STEPS;
      return pose.map((value, k) => value / (k < 3 ? this.factor : size));
    });
  }

  draw(time, glow) {
    const poses = this.posesAt(time);
    this.layer("bodies").replaceChildren();
    this.layer("links").replaceChildren();
    this.layer("marks").replaceChildren();
    this.drawLinks(poses);
    this.drawBodies(poses);
    this.drawMarks(time, glow);
    this.clock.textContent = `${time.toFixed(3)} s`;
  }

  drawLinks(poses) {
    for (const [first, second, ...ends] of this.links) {
      const [x0, y0] = placed(poses[first], ...ends.slice(0, 3));
      const [x1, y1] = placed(poses[second], ...ends.slice(3));
      element("path", { d: `M${x0} ${y0}L${x1} ${y1}` }, this.layer("links"));
    }
  }

  drawBodies(poses) {
    const faces = this.rings.map((ring) => this.face(poses, ring)).filter(Boolean);
    const discs = this.balls.map(([body, spoke, x, y, z, r]) => {
      const [cx, cy, depth] = placed(poses[body], x, y, z);
      const [ex, ey] = placed(poses[body], x + r, y, z);
      const line = spoke ? `M${cx} ${cy}L${ex} ${ey}` : "";
      return { depth, d: `M${cx - r} ${cy}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0z${line}` };
    });
    for (const { d } of [...faces, ...discs].sort((a, b) => a.depth - b.depth)) element("path", { d }, this.layer("bodies"));
  }

  face(poses, [body, flat, ...corners]) {
    const points = [];
    for (let k = 0; k < corners.length; k += 3) points.push(placed(poses[body], corners[k], corners[k + 1], corners[k + 2]));
    const area = points.reduce((sum, [x, y], k) => {
      const [u, v] = points[(k + 1) % points.length];
      return sum + x * v - u * y;
    }, 0);
    if (!flat && area >= 0) return undefined; // y is down: seen from behind
    const depth = points.reduce((sum, point) => sum + point[2], 0) / points.length;
    return { depth, d: `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}z` };
  }

  drawMarks(time, glow) {
    const now = this.momentAt(time);
    for (let k = 0; k < this.marks.length; k += 5) {
      const [moment, px, py, angle, size] = this.marks.slice(k, k + 5);
      const age = time - this.times[moment];
      const [x, y, strength] = [px / PLACE_STEPS, py / PLACE_STEPS, Math.abs(size) / STRENGTH_STEPS];
      if (size > 0 && moment === now) this.drawContact(x, y, angle / ANGLE_STEPS, strength);
      if (size < 0 && moment <= now && age < glow) this.drawImpulse(x, y, strength, 1 - age / glow);
    }
  }

  drawContact(x, y, angle, strength) {
    const length = 6 + 26 * strength;
    const mark = element("g", { class: "contact" }, this.layer("marks"));
    element("circle", { cx: x, cy: y, r: 3 }, mark);
    element("path", { d: `M${x} ${y}l${length * Math.cos(angle)} ${length * Math.sin(angle)}` }, mark);
  }

  drawImpulse(x, y, strength, opacity) {
    const [near, far] = [5, 9 + 12 * strength];
    const rays = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [Math.cos((k * Math.PI) / 4), Math.sin((k * Math.PI) / 4)]);
    const d = rays.map(([c, s]) => `M${x + near * c} ${y + near * s}L${x + far * c} ${y + far * s}`).join("");
    element("path", { d, class: "impulse", opacity }, this.layer("marks"));
  }
}

class Player {
  constructor(figure) {
    this.films = [...figure.querySelectorAll(".panel")].map((panel) => new Film(panel));
    this.end = Math.max(...this.films.map((film) => film.end));
    this.speed = SPEEDS.find((speed) => this.end / speed >= PLEASANT * 0.7) || SPEEDS[SPEEDS.length - 1];
    const start = Math.min(...this.films.map((film) => film.start));
    this.start = Number.isFinite(start) ? start : 0;
    this.time = this.start;
    this.playing = false;
    this.makeControls(figure);
    this.seek(this.start);
  }

  makeControls(figure) {
    const controls = document.createElement("div");
    controls.className = "controls";
    controls.setAttribute("role", "group");
    controls.setAttribute("aria-label", "Playback");
    this.button = controls.appendChild(document.createElement("button"));
    this.button.type = "button";
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.slider = controls.appendChild(document.createElement("input"));
    Object.assign(this.slider, { type: "range", min: 0, max: this.end, step: "any", value: 0 });
    this.slider.setAttribute("aria-label", "Time");
    this.slider.addEventListener("input", () => { this.pause(); this.seek(+this.slider.value); });
    this.slider.addEventListener("keydown", (event) => this.step(event));
    const speeds = controls.appendChild(document.createElement("select"));
    speeds.setAttribute("aria-label", "Speed");
    for (const speed of SPEEDS) speeds.add(new Option(speed === 1 ? "real time" : `1 : ${1 / speed}`, speed));
    speeds.value = this.speed;
    speeds.addEventListener("change", () => { this.speed = +speeds.value; this.seek(this.time); });
    figure.querySelector(".panels").after(controls);
    this.label();
  }

  label() {
    this.button.textContent = this.playing ? "❚❚ Pause" : "▶ Play";
  }

  // Arrow keys go from moment to moment.
  step(event) {
    const direction = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (!direction) return;
    event.preventDefault();
    this.pause();
    const [film] = this.films;
    const next = Math.min(Math.max(film.momentAt(this.time) + direction, 0), film.times.length - 1);
    this.seek(film.times[next]);
  }

  seek(time) {
    this.time = time;
    this.slider.value = time;
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(3)} seconds`);
    this.films.forEach((film) => film.draw(Math.min(time, film.end), AFTERGLOW * this.speed));
  }

  play() {
    if (this.time >= this.end) this.time = this.start;
    this.playing = true;
    this.label();
    let last;
    const tick = (now) => {
      if (!this.playing) return;
      if (last !== undefined) this.seek(Math.min(this.time + ((now - last) / 1000) * this.speed, this.end));
      last = now;
      if (this.time >= this.end) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.label();
  }
}

document.querySelectorAll("figure.player").forEach((figure) => new Player(figure));
