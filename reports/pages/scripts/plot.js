// One drawing with axes. It reads its curves from the SVG paths, shows a part of them, and tells values.
// Lengths are the drawing's points; a window is the part [x0, x1, y0, y1] of the printed frame that is shown.
const SVG = "http://www.w3.org/2000/svg";
const NARROWEST = 1 / 200; // of the frame: closer up, the printed decimals would show

function element(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

const numbers = (text) => text.split(" ").map(Number);

function readCurve(group) {
  const path = group.querySelector(":scope > path");
  const points = path.getAttribute("d").match(/-?[\d.]+ -?[\d.]+/g).map(numbers);
  const marks = [...group.querySelectorAll("use")].map((use) => ({ use, x: +use.getAttribute("x"), y: +use.getAttribute("y") }));
  return { name: group.dataset.curve, group, path, points, marks };
}

// About six round values between two limits.
function roundValues(from, to) {
  const rough = Math.abs(to - from) / 6;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const [low, high] = [Math.min(from, to), Math.max(from, to)];
  const values = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) values.push([k * step, (k * step).toFixed(decimals)]);
  return values.map(([value, text]) => [value, text.replace("-", "−")]);
}

class Plot {
  constructor(svg) {
    this.svg = svg;
    this.overTime = svg.dataset.trace === "time";
    this.frame = numbers(svg.dataset.frame);
    this.limits = { x: numbers(svg.dataset.x), y: numbers(svg.dataset.y) };
    this.names = svg.dataset.names.split("|");
    this.curves = [...svg.querySelectorAll("[data-curve]")].map(readCurve);
    this.window = this.whole;
    this.ticks = element("g", { class: "ticks" }, svg);
    this.curves[0].group.before(this.ticks); // below the curves
    this.cursor = element("g", { class: "cursor" }, svg);
    this.cursorLine = element("path", {}, this.cursor);
    this.selection = element("rect", { class: "selection", width: 0, height: 0 }, svg);
  }

  // Width of the drawing, in its own points.
  get width() {
    return this.svg.viewBox.baseVal.width;
  }

  get whole() {
    const [left, top, right, bottom] = this.frame;
    return [left, right, top, bottom];
  }

  get zoomed() {
    return this.window.some((edge, k) => edge !== this.whole[k]);
  }

  // From a place in the printed frame to its value, and back.
  value(axis, place) {
    const [low, high] = this.limits[axis];
    const [from, to] = axis === "x" ? [this.frame[0], this.frame[2]] : [this.frame[3], this.frame[1]];
    return low + ((place - from) / (to - from)) * (high - low);
  }

  place(axis, value) {
    const [low, high] = this.limits[axis];
    const [from, to] = axis === "x" ? [this.frame[0], this.frame[2]] : [this.frame[3], this.frame[1]];
    return from + ((value - low) / (high - low)) * (to - from);
  }

  // From a place in the printed frame to where it is now, and back.
  seenX(x) {
    const [left, , right] = this.frame;
    return left + ((x - this.window[0]) / (this.window[1] - this.window[0])) * (right - left);
  }

  seenY(y) {
    const [, top, , bottom] = this.frame;
    return top + ((y - this.window[2]) / (this.window[3] - this.window[2])) * (bottom - top);
  }

  printed(x, y) {
    const [left, top, right, bottom] = this.frame;
    const [x0, x1, y0, y1] = this.window;
    return [x0 + ((x - left) / (right - left)) * (x1 - x0), y0 + ((y - top) / (bottom - top)) * (y1 - y0)];
  }

  // Show a part, kept within the frame; over time, the height follows the curves that are shown.
  show(window) {
    const [x0, x1, y0, y1] = this.whole;
    const within = (from, to, low, high) => {
      const size = Math.min(Math.max(to - from, NARROWEST * (high - low)), high - low);
      const start = Math.min(Math.max((from + to - size) / 2, low), high - size);
      return size === high - low ? [low, high] : [start, start + size];
    };
    const across = within(window[0], window[1], x0, x1);
    const heights = this.overTime ? this.heights(across) : window.slice(2);
    this.window = [...across, ...within(...heights, y0, y1)];
    this.redraw();
  }

  heights([from, to]) {
    if (from === this.whole[0] && to === this.whole[1]) return this.whole.slice(2);
    const all = this.curves.filter((curve) => !curve.group.hasAttribute("hidden")).flatMap((curve) => {
      const inside = curve.points.filter(([x]) => x >= from && x <= to).map(([, y]) => y);
      return [...inside, this.heightAt(curve, from), this.heightAt(curve, to)].filter(Number.isFinite);
    });
    if (!all.length) return this.whole.slice(2);
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const air = 0.06 * (high - low) + 0.004 * (this.frame[3] - this.frame[1]);
    return [low - air, high + air];
  }

  redraw() {
    const at = ([x, y]) => `${this.seenX(x).toFixed(2)} ${this.seenY(y).toFixed(2)}`;
    for (const curve of this.curves) {
      curve.path.setAttribute("d", `M${curve.points.map(at).join("L")}`);
      for (const mark of curve.marks) {
        const [x, y] = [this.seenX(mark.x), this.seenY(mark.y)];
        const outside = x < this.frame[0] || x > this.frame[2] || y < this.frame[1] || y > this.frame[3];
        mark.use.toggleAttribute("hidden", outside);
        mark.use.setAttribute("x", x);
        mark.use.setAttribute("y", y);
      }
    }
    this.svg.classList.toggle("zoomed", this.zoomed);
    this.ticks.replaceChildren();
    if (this.zoomed) this.drawTicks();
  }

  drawTicks() {
    const [left, top, right, bottom] = this.frame;
    const [x0, y0] = this.printed(left, bottom);
    const [x1, y1] = this.printed(right, top);
    for (const [value, text] of roundValues(this.value("x", x0), this.value("x", x1))) {
      const x = this.seenX(this.place("x", value));
      element("path", { d: `M${x} ${bottom}V${top}` }, this.ticks);
      element("text", { x, y: bottom + 13, "text-anchor": "middle" }, this.ticks).textContent = text;
    }
    for (const [value, text] of roundValues(this.value("y", y0), this.value("y", y1))) {
      const y = this.seenY(this.place("y", value));
      element("path", { d: `M${left} ${y}H${right}` }, this.ticks);
      element("text", { x: left - 6, y: y + 3, "text-anchor": "end" }, this.ticks).textContent = text;
    }
  }

  // Height of a curve at x, straight between its points; undefined beyond its ends.
  heightAt({ points }, x) {
    let [low, high] = [0, points.length - 1];
    if (x < points[low][0] || x > points[high][0]) return undefined;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (points[middle][0] <= x) low = middle;
      else high = middle;
    }
    const [[xa, ya], [xb, yb]] = [points[low], points[high]];
    return xb > xa ? ya + ((x - xa) / (xb - xa)) * (yb - ya) : yb;
  }

  format(axis, value) {
    const [low, high] = this.limits[axis];
    const decimals = Math.max(0, 3 - Math.floor(Math.log10(Math.abs(high - low))));
    return value.toFixed(Math.min(decimals, 7)).replace("-", "−");
  }

  // Put the cursor at a place of the printed frame and return what is there: [[name, value], ...].
  read(x, y) {
    this.cursor.querySelectorAll("circle").forEach((dot) => dot.remove());
    const shown = this.curves.filter((curve) => !curve.group.hasAttribute("hidden"));
    return this.overTime ? this.readTime(shown, x) : this.readPath(shown, x, y);
  }

  readTime(shown, x) {
    if (x < this.frame[0] || x > this.frame[2]) { // a plot of a shorter time
      this.cursorLine.setAttribute("d", "");
      return [];
    }
    this.cursorLine.setAttribute("d", `M${this.seenX(x)} ${this.frame[1]}V${this.frame[3]}`);
    const rows = [[this.names[0], this.format("x", this.value("x", x))]];
    for (const curve of shown) {
      const y = this.heightAt(curve, x);
      if (y === undefined) continue;
      const beyond = y < this.frame[1] ? "above" : y > this.frame[3] ? "below" : "";
      rows.push([curve.name, beyond || this.format("y", this.value("y", y))]);
      if (!beyond) this.dot(x, y);
    }
    return rows;
  }

  readPath(shown, x, y) {
    this.cursorLine.setAttribute("d", "");
    const near = (curve) => curve.points.map((point) => [Math.hypot(point[0] - x, point[1] - y), point, curve]);
    const all = shown.flatMap(near);
    if (!all.length) return [];
    const [, point, curve] = all.reduce((best, next) => (next[0] < best[0] ? next : best));
    this.dot(...point);
    return [[curve.name, ""], [this.names[0], this.format("x", this.value("x", point[0]))],
      [this.names[1], this.format("y", this.value("y", point[1]))]];
  }

  dot(x, y) {
    const [cx, cy] = [this.seenX(x), this.seenY(y)];
    const [left, top, right, bottom] = this.frame;
    if (cx >= left && cx <= right && cy >= top && cy <= bottom) element("circle", { cx, cy, r: 2.6 }, this.cursor);
  }
}
