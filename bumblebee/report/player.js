for (const figure of document.querySelectorAll("figure.film")) {
  const {frames, columns, rows, fps} = figure.dataset;
  const sheet = figure.querySelector("img"), bar = figure.querySelector(".controls");
  const play = bar.querySelector(".play"), slider = bar.querySelector("input"), clock = bar.querySelector("output");
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const last = frames - 1;
  let timer = 0;
  const show = (at) => {
    const column = at % columns, row = Math.floor(at / columns);
    sheet.style.transform = `translate(${-100 * column / columns}%, ${-100 * row / rows}%)`;
    slider.value = at;
    clock.textContent = `${(at / fps).toFixed(1)} of ${(last / fps).toFixed(1)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
  };
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    play.textContent = "Play";
    figure.dataset.state = "paused";
  };
  const next = () => {
    const at = +slider.value;
    if (at < last) show(at + 1);
    else if (still.matches) stop();
    else show(0);
  };
  const start = () => {
    if (+slider.value >= last) show(0);
    timer = setInterval(next, 1000 / fps);
    play.textContent = "Pause";
    figure.dataset.state = "playing";
  };
  const go = (at) => { stop(); show(Math.min(Math.max(at, 0), last)); };
  play.addEventListener("click", () => (timer ? stop() : start()));
  bar.querySelector(".back").addEventListener("click", () => go(+slider.value - 1));
  bar.querySelector(".ahead").addEventListener("click", () => go(+slider.value + 1));
  slider.addEventListener("input", () => go(+slider.value));
  addEventListener("beforeprint", stop);
  bar.hidden = false;
  stop();
  show(0);
  if (!still.matches) start();
}
