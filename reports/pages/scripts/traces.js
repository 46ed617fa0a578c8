// Figures with curves: a cursor that reads values, zoom, and a legend that hides and shows worlds.
// The plots of a figure that share time move together.
const HELP = "Arrow keys read values, plus and minus zoom, shift and arrow keys move, 0 shows all.";

class TraceFigure {
  constructor(figure) {
    this.figure = figure;
    this.plots = [...figure.querySelectorAll("svg[data-trace]")].map((svg) => new Plot(svg));
    this.readouts = new Map(this.plots.map((plot) => [plot, this.prepare(plot)]));
    this.active = this.plots.find((plot) => plot.overTime) || this.plots[0];
    figure.querySelectorAll(".legend li[data-curve]").forEach((entry) => this.makeToggle(entry));
    this.makeTools();
  }

  together(plot) {
    return plot.overTime ? this.plots.filter((other) => other.overTime) : [plot];
  }

  prepare(plot) {
    const { svg } = plot;
    svg.setAttribute("tabindex", "0");
    svg.setAttribute("role", "application");
    svg.setAttribute("aria-label", `${svg.getAttribute("aria-label")} ${HELP}`);
    const readout = document.createElement("div");
    readout.className = "readout";
    readout.hidden = true;
    svg.parentElement.append(readout);
    svg.addEventListener("pointerdown", (event) => this.press(plot, event));
    svg.addEventListener("pointermove", (event) => this.move(plot, event));
    svg.addEventListener("pointerup", (event) => this.release(plot, event));
    svg.addEventListener("pointercancel", () => this.drop(plot));
    svg.addEventListener("pointerleave", () => this.forget(plot));
    svg.addEventListener("blur", () => this.forget(plot));
    svg.addEventListener("dblclick", () => this.showAll(plot));
    svg.addEventListener("wheel", (event) => this.turn(plot, event), { passive: false });
    svg.addEventListener("keydown", (event) => this.key(plot, event));
    return readout;
  }

  makeToggle(entry) {
    const button = document.createElement("button");
    button.type = "button";
    button.setAttribute("aria-pressed", "true");
    button.title = `Hide or show ${entry.dataset.curve}`;
    button.append(...entry.childNodes);
    entry.append(button);
    button.addEventListener("click", () => {
      const shown = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", shown);
      for (const plot of this.plots) {
        const named = plot.curves.filter((curve) => curve.name === entry.dataset.curve);
        named.forEach((curve) => curve.group.toggleAttribute("hidden", !shown));
        const names = [...plot.svg.querySelectorAll("[data-name]")].filter((text) => text.dataset.name === entry.dataset.curve);
        names.forEach((text) => text.toggleAttribute("hidden", !shown));
        plot.show(plot.window);
      }
    });
  }

  makeTools() {
    const tools = document.createElement("div");
    tools.className = "tools";
    const actions = [["+", "Zoom in", () => this.zoom(this.active, 0.5)], ["−", "Zoom out", () => this.zoom(this.active, 2)],
      ["all", "Show all", () => this.plots.forEach((plot) => plot.show(plot.whole))]];
    for (const [text, label, act] of actions) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      if (text !== "all") button.setAttribute("aria-label", label);
      button.addEventListener("click", act);
      tools.append(button);
    }
    const hint = document.createElement("span");
    hint.textContent = "Point to read values, drag to zoom, double click for all.";
    tools.append(hint);
    this.figure.querySelector(".panels").before(tools);
  }

  // Where a pointer is, in the printed frame.
  place(plot, event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.svg.getScreenCTM().inverse());
    const [left, top, right, bottom] = plot.frame;
    return plot.printed(Math.min(Math.max(point.x, left), right), Math.min(Math.max(point.y, top), bottom));
  }

  press(plot, event) {
    this.active = plot;
    if (event.pointerType === "touch" || event.button !== 0) return;
    plot.svg.setPointerCapture(event.pointerId);
    plot.from = this.place(plot, event);
  }

  move(plot, event) {
    const here = this.place(plot, event);
    this.read(plot, here);
    if (plot.from) this.select(plot, here);
  }

  select(plot, [x, y]) {
    const [left, top, right, bottom] = plot.frame;
    const xs = [plot.seenX(plot.from[0]), plot.seenX(x)].sort((a, b) => a - b);
    const ys = plot.overTime ? [top, bottom] : [plot.seenY(plot.from[1]), plot.seenY(y)].sort((a, b) => a - b);
    const box = { x: xs[0], y: ys[0], width: xs[1] - xs[0], height: ys[1] - ys[0] };
    for (const [name, value] of Object.entries(box)) plot.selection.setAttribute(name, value);
    plot.wide = xs[1] - xs[0] > 0.02 * (right - left) && ys[1] - ys[0] > 0.02 * (bottom - top);
  }

  release(plot, event) {
    const [start, end] = [plot.from, this.place(plot, event)];
    const wide = plot.wide;
    this.drop(plot);
    if (!start || !wide) return;
    const [x0, x1] = [start[0], end[0]].sort((a, b) => a - b);
    const [y0, y1] = [start[1], end[1]].sort((a, b) => a - b);
    this.showTogether(plot, [x0, x1, y0, y1]);
  }

  drop(plot) {
    plot.from = undefined;
    plot.wide = false;
    plot.selection.setAttribute("width", 0);
  }

  // The same times in another plot, whose frame may begin elsewhere.
  shared(plot, other, [x0, x1, y0, y1]) {
    return [other.place("x", plot.value("x", x0)), other.place("x", plot.value("x", x1)), y0, y1];
  }

  turn(plot, event) {
    if (document.activeElement !== plot.svg && !event.ctrlKey) return; // the page scrolls
    event.preventDefault();
    plot.at = this.place(plot, event);
    this.zoom(plot, event.deltaY > 0 ? 1.25 : 0.8);
  }

  zoom(plot, factor) {
    const [x0, x1, y0, y1] = plot.window;
    const [x, y] = plot.at || [(x0 + x1) / 2, (y0 + y1) / 2];
    this.showTogether(plot, [x + factor * (x0 - x), x + factor * (x1 - x), y + factor * (y0 - y), y + factor * (y1 - y)]);
  }

  showTogether(plot, window) {
    this.together(plot).forEach((other) => other.show(this.shared(plot, other, window)));
    if (plot.at) this.read(plot, plot.at);
  }

  showAll(plot) {
    this.together(plot).forEach((other) => other.show(other.whole));
  }

  key(plot, event) {
    const [x0, x1, y0, y1] = plot.window;
    const direction = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (direction && event.shiftKey) {
      const [dx, dy] = [0.2 * direction[0] * (x1 - x0), 0.2 * direction[1] * (y1 - y0)];
      this.showTogether(plot, [x0 + dx, x1 + dx, y0 + dy, y1 + dy]);
    } else if (direction && (direction[0] || !plot.overTime)) {
      const [x, y] = plot.at || [(x0 + x1) / 2, (y0 + y1) / 2];
      this.read(plot, [Math.min(Math.max(x + 0.01 * direction[0] * (x1 - x0), x0), x1),
        Math.min(Math.max(y + 0.01 * direction[1] * (y1 - y0), y0), y1)]);
    } else if (event.key === "+" || event.key === "=") this.zoom(plot, 0.5);
    else if (event.key === "-") this.zoom(plot, 2);
    else if (event.key === "0" || event.key === "Escape") this.showAll(plot);
    else return;
    event.preventDefault();
  }

  read(plot, [x, y]) {
    for (const other of this.together(plot)) {
      const place = other === plot ? [x, y] : [other.place("x", plot.value("x", x)), y];
      other.at = place;
      this.write(other, other.read(...place), other === plot);
    }
  }

  write(plot, rows, spoken) {
    const readout = this.readouts.get(plot);
    readout.replaceChildren(...rows.map(([name, value]) => {
      const row = document.createElement("p");
      row.append(name, Object.assign(document.createElement("b"), { textContent: value }));
      return row;
    }));
    readout.setAttribute("aria-live", spoken ? "polite" : "off");
    const [left, , right] = plot.frame;
    const onLeft = plot.seenX(plot.at[0]) > (left + right) / 2;
    readout.style.left = onLeft ? `${100 * left / plot.width + 1}%` : "auto";
    readout.style.right = onLeft ? "auto" : `${100 - 100 * right / plot.width}%`;
    readout.hidden = rows.length === 0;
  }

  forget(plot) {
    for (const other of this.together(plot)) {
      this.readouts.get(other).hidden = true;
      other.cursorLine.setAttribute("d", "");
      other.cursor.querySelectorAll("circle").forEach((dot) => dot.remove());
    }
  }
}

document.querySelectorAll("figure").forEach((figure) => {
  if (figure.querySelector("svg[data-trace]")) new TraceFigure(figure);
});
