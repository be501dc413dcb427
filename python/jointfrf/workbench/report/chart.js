"use strict";
// Zooming and reading of charts. A panel is an SVG image of units WIDE x HIGH; zooming shows a part of it.
for (const chart of document.querySelectorAll("figure.chart")) {
  const panels = [...chart.querySelectorAll(".panel")].map((element) => {
    const svg = element.querySelector("svg.plot");
    const limits = JSON.parse(element.dataset.limits);
    return { element, svg, ...limits, full: { x: limits.x, y: limits.y }, unit: element.dataset.unit,
             wide: svg.viewBox.baseVal.width, high: svg.viewBox.baseVal.height };
  });
  const tools = chart.querySelector(".tools");
  const readout = chart.querySelector(".readout");
  tools.hidden = false;

  // ---- axes, as jointfrf.workbench.report.axes chooses them
  const niceValues = (low, high, most, whole) => {
    const rough = (high - low) / most, size = 10 ** Math.floor(Math.log10(rough));
    const step = whole ? Math.max(1, Math.ceil(rough)) : size * [1, 2, 2.5, 5, 10].find((n) => n * size >= rough * (1 - 1e-9));
    const values = [];
    for (let i = Math.ceil(low / step - 1e-9); i <= high / step + 1e-9; i++) values.push(i * step);
    return values;
  };
  const axisValues = (low, high, most, log) => {
    if (!log || high - low >= 2) return niceValues(low, high, most, log);
    const inside = [];
    for (let n = Math.floor(low); n <= Math.ceil(high); n++)
      for (const v of [1, 2, 5]) inside.push(n + Math.log10(v));
    const seen = inside.filter((value) => value >= low && value <= high);
    if (high - low >= 0.7 && seen.length > 1) return seen;
    return niceValues(10 ** low, 10 ** high, most).filter((value) => value > 0).map(Math.log10);
  };
  const texts = (values) => {
    const largest = Math.max(...values.map(Math.abs));
    for (let d = 0; d < 5; d++)
      if (values.every((v) => Math.abs(v - +v.toFixed(d)) <= 1e-6 * largest))
        return values.map((v) => v.toFixed(d).replace(/^-(?=0(\.0*)?$)/, "").replace("-", "−"));
    return values.map((v) => String(+v.toPrecision(6)).replace("-", "−"));
  };
  const raised = (n) => "10" + String(n).replace(/[-\d]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);

  const draw = (panel) => {
    const { full, x, y, log, size, step, wide, high } = panel;
    const atX = (v) => ((v - full.x[0]) / (full.x[1] - full.x[0])) * wide;
    const atY = (v) => (1 - (v - full.y[0]) / (full.y[1] - full.y[0])) * high;
    const box = [atX(x[0]), atY(y[1]), atX(x[1]) - atX(x[0]), atY(y[0]) - atY(y[1])];
    panel.svg.setAttribute("viewBox", box.join(" "));
    const narrow = panel.svg.clientWidth < 260;
    const xs = niceValues(x[0], x[1], narrow ? 4 : 6), decades = log && y[1] - y[0] >= 2;
    const ys = step && y[1] - y[0] > 2 * step ? niceValues(y[0] / step, y[1] / step, 5, true).map((v) => v * step)
                                             : axisValues(y[0], y[1], 5, log);
    const yTexts = decades ? ys.map((v) => (Math.round(v) ? raised(Math.round(v)) : "1"))
                           : texts(ys.map((v) => (log ? 10 ** v : v) / size));
    const marks = (names, values, low, high, side, words) => {
      const place = panel.element.querySelector(names);
      if (place)
        place.replaceChildren(...values.map((v, i) => {
          const mark = document.createElement("span");
          mark.style[side] = `${(100 * (v - low)) / (high - low)}%`;
          mark.textContent = words[i];
          return mark;
        }));
    };
    if (panel.element.querySelector(".x-label")) marks(".x-ticks", xs, x[0], x[1], "left", texts(xs));
    marks(".y-ticks", ys, y[0], y[1], "bottom", yTexts);
    const grid = xs.map((v) => `M${atX(v)} ${box[1]}v${box[3]}`).concat(ys.map((v) => `M${box[0]} ${atY(v)}h${box[2]}`));
    panel.svg.querySelector(".grid").setAttribute("d", grid.join(""));
  };

  // ---- zooming: along x in all panels, along y in one
  const clamp = (range, full) => {
    const span = Math.min(Math.max(range[1] - range[0], (full[1] - full[0]) / 400), full[1] - full[0]);
    const low = Math.min(Math.max(range[0], full[0]), full[1] - span);
    return [low, low + span];
  };
  const show = (x, own, y) => {
    for (const panel of panels) {
      if (x) panel.x = clamp(x, panel.full.x);
      if (panel === own && y) panel.y = clamp(y, panel.full.y);
      draw(panel);
    }
    tools.querySelector(".reset").disabled = panels.every((p) => String(p.x) === String(p.full.x) && String(p.y) === String(p.full.y));
  };
  const reset = () => { for (const p of panels) p.y = p.full.y; show(panels[0].full.x); };
  const scale = (factor, at = 0.5) => {
    const [low, high] = panels[0].x, centre = low + at * (high - low);
    show([centre - factor * (centre - low), centre + factor * (high - centre)]);
  };
  const move = (share) => { const [low, high] = panels[0].x; show([low + share * (high - low), high + share * (high - low)]); };
  tools.querySelector(".in").onclick = () => scale(0.5);
  tools.querySelector(".out").onclick = () => scale(2);
  tools.querySelector(".reset").onclick = reset;
  const keys = { "+": () => scale(0.5), "=": () => scale(0.5), "-": () => scale(2), "0": reset, Escape: reset,
                 ArrowLeft: () => move(-0.25), ArrowRight: () => move(0.25) };

  // ---- reading: the curves' points, from their paths
  const points = (panel) => panel.curves ??= [...panel.svg.querySelectorAll("path[data-label]")].map((path) => {
    const x = [], y = [];
    let a = 0, b = 0;
    for (const piece of path.getAttribute("d").split("m").slice(1)) {
      const steps = piece.split("h")[0].match(/-?\d+/g).map(Number);
      for (let i = 0; i < steps.length; i += 2) { x.push((a += steps[i])); y.push((b += steps[i + 1])); }
    }
    return { label: path.dataset.label, x, y };
  });
  const value = (panel, curve, x) => {
    const at = ((x - panel.full.x[0]) / (panel.full.x[1] - panel.full.x[0])) * panel.wide;
    let low = 0, high = curve.x.length - 1;
    if (high < 0) return null;
    while (high - low > 1) { const mid = (low + high) >> 1; curve.x[mid] > at ? (high = mid) : (low = mid); }
    const i = Math.abs(curve.x[low] - at) < Math.abs(curve.x[high] - at) ? low : high;
    if (Math.abs(curve.x[i] - at) > 0.02 * panel.wide) return null;
    const up = panel.full.y[0] + (1 - curve.y[i] / panel.high) * (panel.full.y[1] - panel.full.y[0]);
    return panel.log ? 10 ** up : up;
  };

  for (const panel of panels) {
    let from = null;
    const { svg } = panel, drag = svg.parentElement.querySelector(".drag");
    const at = (event) => {
      const box = svg.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width, 1 - (event.clientY - box.top) / box.height].map((v) => Math.min(Math.max(v, 0), 1));
    };
    svg.addEventListener("pointerdown", (event) => { if (event.button === 0) { from = at(event); svg.setPointerCapture(event.pointerId); } });
    svg.addEventListener("pointermove", (event) => {
      const here = at(event), x = panel.x[0] + here[0] * (panel.x[1] - panel.x[0]);
      const said = points(panel).map((curve) => [curve.label, value(panel, curve, x)]).filter(([, v]) => v !== null);
      readout.textContent = `${+x.toPrecision(5)} Hz` + said.map(([label, v]) => `; ${label} ${+v.toPrecision(4)}`).join("") + (panel.unit && said.length ? ` ${panel.unit}` : "");
      if (!from) return;
      const tall = Math.abs(here[1] - from[1]) * svg.clientHeight > 25;
      const [low, high] = tall ? [Math.min(from[1], here[1]), Math.max(from[1], here[1])] : [0, 1];
      Object.assign(drag.style, { display: "block", left: `${100 * Math.min(from[0], here[0])}%`, bottom: `${100 * low}%`,
                                  width: `${100 * Math.abs(here[0] - from[0])}%`, height: `${100 * (high - low)}%` });
    });
    const end = (event) => {
      drag.style.display = "none";
      if (!from) return;
      const begun = from, to = at(event);
      from = null;
      if (event.type !== "pointerup" || Math.abs(to[0] - begun[0]) * svg.clientWidth < 8) return;
      const part = ([low, high], i) => [begun[i], to[i]].sort((a, b) => a - b).map((share) => low + share * (high - low));
      const tall = Math.abs(to[1] - begun[1]) * svg.clientHeight > 25;
      show(part(panel.x, 0), panel, tall ? part(panel.y, 1) : null);
    };
    svg.addEventListener("pointerup", end);
    svg.addEventListener("pointercancel", end);
    svg.addEventListener("pointerleave", () => { readout.textContent = ""; });
    svg.addEventListener("dblclick", reset);
    svg.addEventListener("keydown", (event) => { if (keys[event.key] && !event.ctrlKey && !event.metaKey) { keys[event.key](); event.preventDefault(); } });
    svg.tabIndex = 0;
  }
  addEventListener("resize", () => panels.forEach(draw));
  addEventListener("beforeprint", () => panels.forEach(draw));
  panels.forEach(draw);
}
for (const button of document.querySelectorAll("button.copy")) {
  if (!navigator.clipboard) continue;
  button.hidden = false;
  button.onclick = () => navigator.clipboard.writeText(button.parentElement.querySelector("pre").textContent)
    .then(() => { button.textContent = "copied"; }, () => { button.textContent = "could not be copied"; });
}
