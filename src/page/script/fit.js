// A fit, and how it goes.
function showFit() {
  const { fitting } = state;
  const idle = fitting === null && !state.opening;
  $("begin").disabled = !idle;
  $("resume").disabled = !idle || !state.can_resume;
  $("pause").disabled = $("stop").disabled = idle;
  $("pause").textContent = fitting?.paused ? "go on" : "pause";
  const views = state.views.map((view, index) => ({ ...view, index })).filter((view) => view.target);
  sync($("fitted-views"), views, (view) => view.name,
    () => make("label", {}, make("input", { type: "checkbox" }), make("span")),
    (label, view) => {
      const [box, name] = label.children;
      name.textContent = view.name;
      box.checked = view.fitted;
      box.disabled = !idle;
      box.setAttribute("aria-label", `fit view ${view.name}`);
      box.onchange = () => command("fit_view", { index: view.index, on: box.checked });
    });
  $("fit-words").textContent = fitting
    ? `${fitting.paused ? "paused at" : "fitting:"} iteration ${fitting.iteration ?? 0}, loss ${fitting.loss?.toExponential(6) ?? "…"}`
    : state.found ?? "";
  $("scores").hidden = state.scores.length === 0;
  $("scores").tBodies[0].replaceChildren(...state.scores.map((score) => make("tr", {},
    make("th", { scope: "row", textContent: score.view + (score.held_out ? " (held out)" : "") }),
    ...[score.psnr?.toFixed(2), score.ssim?.toFixed(4), score.flip?.toFixed(4)].map((words) => make("td", { textContent: words })))));
}

function showCurves() {
  const losses = state.losses.map((loss) => Math.log10(Math.max(loss, 1e-300)));
  lines($("loss"), [losses]);
  if (losses.length) {
    $("loss-words").textContent = `lg loss: ${losses[0].toFixed(3)} to ${losses.at(-1).toFixed(3)} in ${losses.length - 1} iterations`;
  }
  const moved = state.ways.filter((way) => way.at.length);
  lines($("ways"), moved.map((way) => way.at));
  $("ways-words").replaceChildren("How far each constant has come. ", ...moved.map((way, i) => {
    const name = make("span", { textContent: `${way.name} ` });
    name.style.color = hue(i, moved.length);
    return name;
  }));
}

const hue = (i, count) => `light-dark(hsl(${360 * i / count} 80% 32%), hsl(${360 * i / count} 70% 70%))`;

function lines(svg, all) {
  const values = all.flat();
  const low = Math.min(...values), high = Math.max(...values), span = high - low || 1;
  svg.replaceChildren(...all.map((line, k) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", "polyline");
    const point = (value, i) => `${5 + 390 * i / Math.max(1, line.length - 1)},${115 - 110 * (value - low) / span}`;
    made.setAttribute("points", line.map(point).join(" "));
    made.style.stroke = all.length > 1 ? hue(k, all.length) : "currentColor";
    return made;
  }));
}
