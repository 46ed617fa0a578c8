// Added to a page that is complete without it: a cursor that reads values, legends that hide curves, sliders.
const numbers = (text) => text.split(" ").map(Number);
const add = (parent, name, properties) => parent.appendChild(Object.assign(document.createElement(name), properties));
const told = (value, range) => value.toFixed(Math.min(Math.max(0, 3 - Math.floor(Math.log10(Math.abs(range)))), 7)).replace("-", "−");
const controlsOf = (figure) => figure.querySelector(".panels").insertAdjacentElement("beforebegin",
  Object.assign(document.createElement("div"), { className: "controls" }));

// A drawing over time: its frame [left, top, right, bottom] in points, the limits of its axes, and the points of its curves.
function plotOf(svg) {
  const [frame, x, y] = ["frame", "x", "y"].map((name) => numbers(svg.dataset[name]));
  const curves = [...svg.querySelectorAll("[data-curve]")].map((group) => ({ group, name: group.dataset.curve,
    points: group.querySelector(":scope > path").getAttribute("d").match(/-?[\d.]+ -?[\d.]+/g).map(numbers) }));
  const [readout, line] = ["readout", "cursor"].map((className) => add(svg.parentElement, "div", { className, hidden: true }));
  return { svg, frame, x, y, curves, readout, line, name: svg.dataset.names.split("|")[0] };
}

// Height of a curve at x, straight between its points; undefined beyond its ends.
function heightAt(points, x) {
  const after = points.findIndex((point) => point[0] >= x);
  if (after < 0 || (after === 0 && points[0][0] > x)) return;
  const [[xa, ya], [xb, yb]] = [points[Math.max(after - 1, 0)], points[after]];
  return xb > xa ? ya + ((x - xa) / (xb - xa)) * (yb - ya) : yb;
}

// Show the value of every curve at a share of the time axis.
function read({ svg, frame: [left, top, right, bottom], x, y, curves, readout, line, name }, share) {
  const { width, height } = svg.viewBox.baseVal, place = left + share * (right - left);
  const heights = curves.filter((curve) => !curve.group.hasAttribute("hidden")).map((curve) => [curve.name, heightAt(curve.points, place)]);
  const rows = heights.filter(([, at]) => at !== undefined)
    .map(([curve, at]) => [curve, told(y[0] + ((at - bottom) / (top - bottom)) * (y[1] - y[0]), y[1] - y[0])]);
  readout.replaceChildren();
  for (const [label, value] of [[name, told(x[0] + share * (x[1] - x[0]), x[1] - x[0])], ...rows]) {
    add(add(readout, "p", { textContent: label }), "b", { textContent: value });
  }
  readout.style.cssText = share > 0.5 ? `left:${(100 * left) / width + 1}%` : `right:${100 - (100 * right) / width}%`;
  const above = 100 * (1 - svg.clientHeight / svg.parentElement.clientHeight), down = (at) => above + ((100 - above) * at) / height;
  line.style.cssText = `left:${(100 * place) / width}%;top:${down(top)}%;bottom:${100 - down(bottom)}%`;
  readout.hidden = line.hidden = false;
}

document.querySelectorAll("figure").forEach((figure) => {
  const plots = [...figure.querySelectorAll("svg[data-trace=time]")].map(plotOf);
  for (const { svg, frame } of plots) {
    svg.addEventListener("pointermove", (event) => {
      const { x } = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      plots.forEach((plot) => read(plot, Math.min(Math.max((x - frame[0]) / (frame[2] - frame[0]), 0), 1)));
    });
    svg.addEventListener("pointerleave", () => plots.forEach(({ readout, line }) => { readout.hidden = line.hidden = true; }));
  }
  if (figure.querySelector("[data-trace]")) figure.querySelectorAll(".legend li[data-curve]").forEach((entry) => {
    const button = add(entry, "button", { type: "button", title: `Hide or show ${entry.dataset.curve}`, ariaPressed: "true" });
    button.append(...[...entry.childNodes].slice(0, -1));
    button.addEventListener("click", () => {
      button.ariaPressed = `${button.ariaPressed !== "true"}`;
      figure.querySelectorAll("svg [data-curve]").forEach((part) => {
        if (part.dataset.curve === entry.dataset.curve) part.toggleAttribute("hidden", button.ariaPressed !== "true");
      });
    });
  });
  const states = [...figure.querySelectorAll("[data-state]")];
  if (states.length) { // pictures, of which a slider shows one
    const { state: value } = states.find((state) => !state.hasAttribute("display")).dataset;
    const tilts = states.flatMap((state) => state.textContent.match(/[\d.]+°/) ?? []);
    const label = add(controlsOf(figure), "label", { textContent: `Tilt from ${tilts[0]} ` });
    const slider = add(label, "input", { type: "range", min: 0, max: states.at(-1).dataset.state, value });
    label.append(` to ${tilts.at(-1)}`);
    slider.addEventListener("input", () => states.forEach((state) => state.setAttribute("display", state.dataset.state === slider.value ? "inline" : "none")));
  }
});

// A link into something folded unfolds it.
const unfold = () => {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let place = target; place; place = place.parentElement) if (place.tagName === "DETAILS") place.open = true;
  if (target) target.scrollIntoView();
};
window.addEventListener("hashchange", unfold), unfold();
