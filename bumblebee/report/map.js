for (const figure of document.querySelectorAll("figure.map")) {
  const PALETTE = figure.dataset.palette.split(" "), OTHERS = "#9aa3ad", NS = "http://www.w3.org/2000/svg";
  const bones = figure.dataset.bones.split(";").map((bone) => bone.split(" ").map(Number));
  const step = +figure.dataset.step, joints = +figure.dataset.joints;
  const [signs, ...lines] = figure.querySelector("pre").textContent.replace(/\n$/, "").split("\n");
  const fields = ["name", "cluster", "x", "y", "split", "family", "licence", "seconds", "source", "caption", "poses"];
  const points = lines.map((line) => Object.fromEntries(line.split("\t").map((value, i) => [fields[i], value])));
  const box = figure.querySelector(".explore"), plot = box.querySelector(".plot"), about = box.querySelector(".about");
  const by = box.querySelector("select"), search = box.querySelector("input"), legend = box.querySelector(".legend");
  const svg = document.createElementNS(NS, "svg"), ring = document.createElementNS(NS, "circle");
  let chosen = -1, size = [0, 0];

  const draw = (name, attributes, parent) => {
    const made = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    parent.append(made);
    return made;
  };
  const say = (name, text, parent, kind) => {
    const made = document.createElement(name);
    made.textContent = text;
    if (kind) made.className = kind;
    parent.append(made);
    return made;
  };

  const radius = points.length > 1500 ? 2.6 : points.length > 400 ? 4 : 5.5;
  for (const point of points) {
    const held = point.split === "test";
    point.dot = draw("circle", {r: radius, "stroke-width": 1.6, "fill-opacity": held ? 0 : 0.75}, svg);
  }
  draw("g", {}, svg).append(ring);
  for (const [key, value] of Object.entries({r: radius + 5, fill: "none", stroke: "currentColor", "stroke-width": 2.5}))
    ring.setAttribute(key, value);
  svg.setAttribute("aria-hidden", "true");
  plot.append(svg);

  const place = () => {
    const width = plot.clientWidth, height = plot.clientHeight, edge = 16;
    if (!width) return;
    size = [width, height];
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    for (const point of points) {
      point.at = [edge + (width - 2 * edge) * point.x / 1000, height - edge - (height - 2 * edge) * point.y / 1000];
      point.dot.setAttribute("cx", point.at[0]);
      point.dot.setAttribute("cy", point.at[1]);
    }
    mark();
  };
  const mark = () => {
    ring.setAttribute("visibility", chosen < 0 ? "hidden" : "visible");
    if (chosen < 0 || !points[chosen].at) return;
    ring.setAttribute("cx", points[chosen].at[0]);
    ring.setAttribute("cy", points[chosen].at[1]);
  };
  const paint = () => {
    const key = by.value, counts = new Map();
    for (const point of points) counts.set(point[key], (counts.get(point[key]) || 0) + 1);
    const order = [...counts].sort(key === "cluster" ? (a, b) => a[0].localeCompare(b[0], "en", {numeric: true}) : (a, b) => b[1] - a[1]);
    const named = order.length > PALETTE.length ? PALETTE.length - 1 : order.length;
    const shade = new Map(order.map(([value], i) => [value, i < named ? PALETTE[i] : OTHERS]));
    for (const point of points) {
      point.dot.setAttribute("fill", shade.get(point[key]));
      point.dot.setAttribute("stroke", shade.get(point[key]));
    }
    legend.replaceChildren();
    const entries = order.slice(0, named).map(([value, count], i) => [value || "unknown", count, PALETTE[i]]);
    const rest = order.slice(named).reduce((sum, [, count]) => sum + count, 0);
    if (rest) entries.push([`${order.length - named} others`, rest, OTHERS]);
    for (const [value, count, colour] of entries) {
      const entry = say("span", `${value} (${count})`, legend);
      entry.style.setProperty("--shade", colour);
    }
  };
  const figures = (point) => {
    const count = point.poses.length / (2 * joints), wide = 1.15;
    const ups = [...point.poses].filter((_, i) => i % 2).map((sign) => signs.indexOf(sign) * step);
    const high = Math.max(1.4, Math.max(...ups) + 0.17);
    const made = draw("svg", {viewBox: `0 0 ${(count * wide).toFixed(2)} ${high}`, class: "poses", role: "img"}, about);
    const seconds = [...Array(count).keys()].map((i) => (point.seconds * i / (count - 1)).toFixed(1));
    made.setAttribute("aria-label", `The robot at ${seconds.join(", ")} s`);
    draw("path", {d: `M0 ${high - 0.03}H${count * wide}`, stroke: "#c9d0d8", "stroke-width": 0.015}, made);
    for (let pose = 0; pose < count; pose++) {
      const xy = [];
      for (let joint = 0; joint < joints; joint++) {
        const at = 2 * (pose * joints + joint);
        const [across, up] = [signs.indexOf(point.poses[at]) * step, signs.indexOf(point.poses[at + 1]) * step];
        xy.push([(pose * wide + across - 0.9 + wide / 2).toFixed(2), (high - 0.05 - up).toFixed(2)]);
      }
      const shades = ["currentColor", "#2f6db5", "#b06d0a", "#2f6db5", "#b06d0a"];
      bones.forEach((bone, i) => {
        const d = "M" + bone.map((joint) => xy[joint].join(" ")).join("L");
        draw("path", {d, fill: "none", stroke: shades[i], "stroke-width": 0.035, "stroke-linecap": "round", "stroke-linejoin": "round"}, made);
      });
      const [x, y] = xy[bones[0][bones[0].length - 1]];
      draw("circle", {cx: x, cy: y, r: 0.07, fill: "currentColor"}, made);
    }
    say("div", `At ${seconds.join(", ")} s; its left in blue.`, about, "quiet");
  };
  const choose = (index) => {
    if (index === chosen || index < 0) return;
    chosen = index;
    mark();
    const point = points[index];
    about.replaceChildren();
    say("b", point.name, about);
    say("p", point.caption ? `“${point.caption}”` : "No caption.", about);
    if (point.source === "name") say("p", "(words of its file's name)", about, "quiet");
    const split = point.split === "test" ? "held out" : "trained on";
    say("p", [point.cluster, `${point.seconds} s`, split, point.family, point.licence].filter(Boolean).join(" · "), about);
    if (point.poses) figures(point);
    else say("p", "No poses are kept of this motion; cluster.map_poses keeps more.", about, "quiet");
  };
  const nearest = (x, y, most) => {
    let best = -1, least = most * most;
    points.forEach((point, i) => {
      const away = (point.at[0] - x) ** 2 + (point.at[1] - y) ** 2;
      if (away < least) [best, least] = [i, away];
    });
    return best;
  };
  const pointed = (event, most) => {
    const frame = plot.getBoundingClientRect();
    choose(nearest(event.clientX - frame.left - plot.clientLeft, event.clientY - frame.top - plot.clientTop, most));
  };
  const ways = {ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  const walk = ([dx, dy]) => {
    if (chosen < 0) return choose(nearest(size[0] / 2, size[1] / 2, Infinity));
    const from = points[chosen].at;
    let best = -1, least = Infinity;
    points.forEach((point, i) => {
      const [x, y] = [point.at[0] - from[0], point.at[1] - from[1]], along = x * dx + y * dy;
      if (i === chosen || along <= 0.01) return;
      const cost = along + 2.5 * Math.abs(x * dy - y * dx);
      if (cost < least) [best, least] = [i, cost];
    });
    choose(best);
  };
  const find = (start) => {
    const words = search.value.trim().toLowerCase();
    const hit = (point) => words && `${point.name} ${point.caption} ${point.family}`.toLowerCase().includes(words);
    points.forEach((point) => point.dot.setAttribute("opacity", !words || hit(point) ? 1 : 0.12));
    for (let i = 0; words && i < points.length; i++) {
      const at = (start + i) % points.length;
      if (hit(points[at])) return choose(at);
    }
  };
  plot.addEventListener("pointermove", (event) => event.pointerType === "mouse" && pointed(event, 18));
  plot.addEventListener("click", (event) => pointed(event, 30));
  plot.addEventListener("focus", () => chosen < 0 && walk([1, 0]));
  plot.addEventListener("keydown", (event) => {
    if (!ways[event.key]) return;
    event.preventDefault();
    walk(ways[event.key]);
  });
  by.addEventListener("change", paint);
  search.addEventListener("input", () => find(0));
  search.addEventListener("keydown", (event) => event.key === "Enter" && find(chosen + 1));
  box.hidden = false;
  figure.querySelector(".still").hidden = true;
  paint();
  place();
  new ResizeObserver(place).observe(plot);
  choose(nearest(size[0] / 2, size[1] / 2, Infinity));
}
