// Dragging across the second picture wipes in the first. Without scripts both simply stand side by side.
for (const triple of document.querySelectorAll(".triple")) {
  const [target, fit] = triple.querySelectorAll(".frame");
  const over = target.querySelector("img").cloneNode();
  const slider = document.createElement("input");
  const [line, grip] = [0, 1].map(() => document.createElement("span"));
  Object.assign(slider, { type: "range", min: 0, max: 100, step: 0.1, value: 0 });
  slider.setAttribute("aria-label", "share of the first picture shown over the second");
  over.className = "over";
  over.alt = "";
  line.className = "wipe";
  grip.className = "grip";
  grip.textContent = "↔";
  const show = () => fit.style.setProperty("--at", slider.value + "%");
  slider.addEventListener("input", show);
  fit.append(over, line, grip, slider);
  fit.classList.add("live");
  triple.querySelector(".hint").hidden = false;
  show();
}
/* A click on a heading sorts by its column, a second one the other way round; what has no number stays last. */
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0];
  const headings = [...table.tHead.rows[0].cells];
  const sort = (heading) => {
    const column = headings.indexOf(heading);
    const numeric = heading.classList.contains("n");
    const down = heading.getAttribute("aria-sort") === (numeric ? "descending" : "ascending") ? !numeric : numeric;
    headings.forEach((other) => other.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const number = (row) => row.cells[column].dataset.sort;
    const text = (row) => row.cells[column].textContent;
    const compare = (a, b) => {
      if (!numeric) return (down ? -1 : 1) * text(a).localeCompare(text(b), "en", { numeric: true });
      const [x, y] = [number(a), number(b)];
      if (x === undefined || y === undefined) return (x === undefined) - (y === undefined);
      return down ? y - x : x - y;
    };
    body.append(...[...body.rows].sort(compare));
  };
  for (const heading of headings) {
    heading.classList.add("can");
    heading.tabIndex = 0;
    heading.addEventListener("click", () => sort(heading));
    heading.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      sort(heading);
    });
  }
}
