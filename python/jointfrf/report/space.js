// A view in space: plotly draws it, this moves it.
for (const box of document.querySelectorAll("figure.space")) {
  if (!document.createElement("canvas").getContext("webgl")) continue;  // the sketch shows where everything is
  const data = JSON.parse(box.dataset.content), plot = box.querySelector(".plot3d");
  const [source, hit, line, play] = ["source", "hit", "line", "play"].map((name) => box.querySelector("." + name));
  const bytes = new Int8Array(Uint8Array.from(atob(data.shapes), (c) => c.charCodeAt(0)).buffer);
  box.querySelector(".stage").hidden = false;
  data.sources.forEach((name, i) => source.add(new Option(name, i)));
  data.hits.forEach(([name], i) => hit.add(new Option(name, i)));
  line.max = data.freq.length - 1;
  line.value = data.peak;
  const every = [...data.at, ...data.centres, ...data.nodes.flat()];
  const sizes = [0, 1, 2].map((a) => Math.max(...every.map((p) => p[a])) - Math.min(...every.map((p) => p[a])));
  const lowest = [0, 1, 2].map((a) => Math.min(...every.map((p) => p[a])));
  const extent = Math.hypot(...sizes), room = 0.15 * extent, reach = 0.1 * extent, arrow = 0.07 * extent;
  const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim();
  const sides = [colour("--shade"), colour("--side-k")], ink = colour("--ink"), grid = colour("--rule");
  const plus = (p, way, factor) => p.map((x, a) => x + factor * way[a]);
  const moved = (phase) => {
    const first = ((+source.value * data.freq.length + +line.value) * data.hits.length + +hit.value) * data.at.length;
    return data.at.map((p, i) => p.map((x, a) => {
      const at = 2 * (3 * (first + i) + a);
      return x + reach / 127 * (bytes[at] * Math.cos(phase) - bytes[at + 1] * Math.sin(phase));
    }));
  };
  const broken = (pairs) => pairs.flatMap(([p, q]) => [p, q, [null, null, null]]);
  const axes = (points) => Object.fromEntries(["x", "y", "z"].map((name, a) => [name, points.map((p) => p[a])]));
  // What moves, trace by trace: points of both sides, lines to the joint, directions; then the force.
  const traces = (phase) => {
    const now = moved(phase), own = (side) => now.filter((_, i) => data.sides[i] === side);
    const arrows = (side) => broken(data.sensors.filter(([i]) => data.sides[i] === side).map(([i, ...way]) =>
      [now[i], plus(now[i], way, arrow)]));
    const links = (side) => broken(own(side).map((p) => [data.centres[side], p]));
    const [, at, ...way] = data.hits[hit.value];
    const struck = at === undefined ? [] : [plus(now[at], way, -arrow)];
    return [own(0), own(1), links(0), links(1), arrows(0), arrows(1), struck].map(axes);
  };
  const lines = (side, width, dash) => ({ type: "scatter3d", mode: "lines", hoverinfo: "skip", showlegend: false,
    line: { color: sides[side], width, dash } });
  const still = traces(0), [, , ...way] = data.hits[hit.value];
  const kinds = [
    ...[0, 1].map((side) => ({ type: "scatter3d", mode: "markers+text", name: data.nodes.length ? "AB"[side] : "side " + "jk"[side],
      text: data.points.filter((_, i) => data.sides[i] === side), textfont: { color: ink, size: 11 }, textposition: "top center",
      marker: { color: sides[side], size: 5 }, hovertemplate: "%{text}: %{x:.4g}, %{y:.4g}, %{z:.4g} mm<extra></extra>" })),
    ...[0, 1].map((side) => lines(side, data.nodes.length ? 0.01 : 2, "solid")), ...[0, 1].map((side) => lines(side, 4, "solid")),
    { type: "cone", anchor: "tip", showscale: false, name: "force", colorscale: [[0, ink], [1, ink]], sizemode: "absolute",
      sizeref: arrow, u: [way[0] ?? 1], v: [way[1] ?? 0], w: [way[2] ?? 0], hoverinfo: "name" },
  ].map((kind, i) => ({ ...kind, ...still[i] }));
  const joint = { ...axes(data.centres), type: "scatter3d", mode: "lines+markers", name: "joint", hoverinfo: "name",
    line: { color: ink, width: 8 }, marker: { color: ink, size: 6, symbol: "diamond" } };
  const nodes = data.nodes.map((own, side) => ({ ...axes(own), type: "scatter3d", mode: "markers", hoverinfo: "skip",
    showlegend: false, opacity: 0.35, marker: { color: sides[side], size: 2 } }));
  const axis = (name) => ({ title: { text: name + ", mm" }, color: ink, gridcolor: grid, showbackground: false, nticks: 5 });
  const range = (a) => ({ range: [lowest[a] - room, lowest[a] + sizes[a] + room] });
  const away = 1.05 * Math.max(1, 0.8 * plot.clientHeight / plot.clientWidth + 0.35);
  Plotly.newPlot(plot, [...kinds, joint, ...nodes], {
    margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", font: { color: ink }, uirevision: "kept",
    legend: { orientation: "h", x: 0, y: 1 },
    scene: { aspectmode: "manual", aspectratio: Object.fromEntries(["x", "y", "z"].map((name, a) => [name, (sizes[a] + 2 * room) / extent])),
      xaxis: { ...axis("x"), ...range(0) }, yaxis: { ...axis("y"), ...range(1) }, zaxis: { ...axis("z"), ...range(2) },
      camera: { eye: { x: 0.55 * away, y: -1.05 * away, z: 0.5 * away } } },
  }, { responsive: true, displaylogo: false, displayModeBar: false });
  const draw = (phase) => {
    const now = traces(phase), all = (name) => now.map((trace) => trace[name]);
    box.querySelector(".hz").textContent = data.freq[line.value] + " Hz";
    Plotly.restyle(plot, { x: all("x"), y: all("y"), z: all("z") }, now.map((_, i) => i));
  };
  const turn = () => {
    const [, , ...way] = data.hits[hit.value];
    Plotly.restyle(plot, { u: [[way[0] ?? 1]], v: [[way[1] ?? 0]], w: [[way[2] ?? 0]] }, [6]);
    draw(0);
  };
  [source, line].forEach((one) => one.addEventListener("input", () => draw(0)));
  hit.addEventListener("input", turn);
  let seen = false, before = 0;
  new IntersectionObserver((all) => { seen = all[0].isIntersecting; }).observe(plot);
  play.checked = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const step = (time) => {
    if (seen && play.checked && time - before > 50) { draw(time / 400); before = time; }
    requestAnimationFrame(step);
  };
  draw(0);
  requestAnimationFrame(step);
}
