// Dragging across a fit wipes in its target. Without scripts both simply stand side by side.
for (const view of document.querySelectorAll(".view")) {
  const [target, fit] = view.querySelectorAll(".triple .frame");
  const over = target.querySelector("img").cloneNode();
  const slider = document.createElement("input");
  const [line, grip] = [0, 1].map(() => document.createElement("span"));
  Object.assign(slider, { type: "range", min: 0, max: 100, step: 0.1, value: 0 });
  slider.setAttribute("aria-label", "share of the target shown over the fit");
  over.className = "over";
  over.alt = "";
  line.className = "wipe";
  grip.className = "grip";
  grip.textContent = "↔";
  const show = () => fit.style.setProperty("--at", slider.value + "%");
  slider.addEventListener("input", show);
  fit.append(over, line, grip, slider);
  fit.classList.add("live");
  view.querySelector(".hint").hidden = false;
  show();
}
