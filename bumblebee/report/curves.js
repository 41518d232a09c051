for (const figure of document.querySelectorAll("figure.curves")) {
  const {most, unit, frames} = figure.dataset;
  const plot = figure.querySelector("svg"), at = plot.querySelector(".at"), said = figure.querySelector("output");
  const lines = [...plot.querySelectorAll("polyline")].map((line) => ({
    name: line.dataset.name,
    points: line.getAttribute("points").split(" ").map((pair) => pair.split(",").map(Number)),
  }));
  plot.addEventListener("pointermove", (event) => {
    const box = plot.getBoundingClientRect();
    const x = Math.min(1000, Math.max(0, 1000 * (event.clientX - box.left) / box.width));
    at.setAttribute("x1", x);
    at.setAttribute("x2", x);
    const told = lines.map(({name, points}) => {
      const nearest = points.reduce((best, point) => (Math.abs(point[0] - x) < Math.abs(best[0] - x) ? point : best));
      return `${name} ${((1 - nearest[1] / 1000) * most).toPrecision(3)} ${unit}`;
    });
    said.textContent = `At ${Math.round(frames * x / 1000).toLocaleString("en")} frames: ${told.join(", ")}.`;
  });
}
