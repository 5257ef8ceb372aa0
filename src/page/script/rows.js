// Parameters, gains and effects: a row each.
function showEffects() {
  sync($("effects"), state.effects, (row) => row.name,
    () => make("li", {}, make("label", {}, make("input", { type: "checkbox" }), make("b")), make("span")),
    (item, row) => {
      const [label, change] = item.children;
      const [box, name] = label.children;
      label.title = row.meaning;
      name.textContent = ` ${row.name} `;
      box.checked = row.on;
      box.disabled = state.fitting !== null;
      box.setAttribute("aria-label", `effect ${row.name}`);
      box.onchange = () => command("effect", { name: row.name, on: box.checked });
      change.textContent = row.change ?? "";
    });
}

// A slider's place from 0 to 1 and its value; by decades where the parameter is so.
const place = ({ lower, upper, log, least }, value) => {
  if (!log) return (value - lower) / (upper - lower);
  return value <= least ? 0 : Math.log(value / least) / Math.log(upper / least);
};
const valueAt = ({ lower, upper, log, least }, at) => {
  if (!log) return lower + at * (upper - lower);
  return at <= 0 ? lower : least * (upper / least) ** at;
};
const written = (value) => String(Number(value.toPrecision(6)));

function showRows() {
  sync($("rows"), state.rows, (row) => row.name, () => {
    const cells = [make("input", { type: "checkbox" }), make("button"), make("div", { className: "value" }),
      make("div", { className: "error" }), make("details", { className: "reset", name: "reset" }, make("summary", { textContent: "…" }), make("div"))];
    const row = make("tr", {}, make("td", {}, cells[0]), make("th", { scope: "row" }, cells[1]),
      make("td", {}, cells[2]), make("td", {}, cells[3]), make("td", {}, cells[4]));
    row.cells_ = cells;
    return row;
  }, (item, row) => {
    const [free, name, values, errors, reset] = item.cells_;
    const idle = state.fitting === null;
    free.checked = row.free;
    free.disabled = !idle;
    free.setAttribute("aria-label", `fit ${row.name}`);
    free.onchange = () => command("free", { param: row.name, on: free.checked });
    name.textContent = row.name;
    name.title = `${row.meaning}\nbounds ${row.bounds} ${row.unit}\n${row.source}`
      + (row.rgb ? "\nClick: a value for each channel, or one for all." : "");
    name.disabled = !row.rgb || !idle;
    name.setAttribute("aria-label", row.rgb ? `channels of ${row.name}` : row.name);
    if (row.rgb) name.setAttribute("aria-pressed", String(row.apart));
    else name.removeAttribute("aria-pressed");
    name.onclick = () => command("apart", { param: row.name, on: !row.apart });
    errors.replaceChildren(...row.sliders.map((slider) => make("div", { textContent: slider.error ?? "" })));
    const [summary, list] = reset.children;
    summary.setAttribute("aria-label", `reset ${row.name}`);
    sync(list, row.resets, (to) => to, () => make("button"), (button, to) => {
      button.textContent = `to the ${to}`;
      button.setAttribute("aria-label", `reset ${row.name} to the ${to}`);
      button.disabled = !idle;
      button.onclick = () => {
        command("reset", { param: row.name, to });
        reset.open = false;
        summary.focus();
      };
    });
    showSliders(values, row, idle);
  });
}

function showSliders(values, row, idle) {
  const cells = row.sliders.flatMap((slider) => ["channel", "slider", "number"].map((kind) => ({ slider, kind })));
  sync(values, cells, ({ slider, kind }) => `${slider.name} ${kind}`, ({ kind }) => ({
    channel: () => make("span"),
    slider: () => make("div", { className: "slider" }, make("input", { type: "range", min: 0, max: 1, step: 0.0005 }), make("i")),
    number: () => make("input", { type: "number", step: "any" }),
  })[kind](), (cell, { slider, kind }) => {
    if (kind === "channel") {
      cell.textContent = slider.channel;
      return;
    }
    const label = `${slider.channel} ${row.name}`.trim();
    if (kind === "slider") {
      errorBar(cell.lastChild, slider);
      cell = cell.firstChild;
    }
    cell.disabled = !idle;
    cell.setAttribute("aria-label", kind === "slider" ? label : `value of ${label}`);
    if (kind === "slider") {
      // What is held by the pointer is ahead of what is told.
      if (!cell.held) cell.value = place(slider, slider.value);
      cell.setAttribute("aria-valuetext", `${written(slider.value)} ${row.unit}`.trim());
      cell.oninput = () => {
        cell.held = true;
        command("slide", { slider: slider.name, value: valueAt(slider, Number(cell.value)) });
      };
      cell.onchange = () => {
        cell.held = false;
        command("settle");
      };
    } else {
      showNumber(cell, slider.value);
      cell.onchange = () => {
        if (cell.value === "") return;
        cell.sent = true;
        command("slide", { slider: slider.name, value: Number(cell.value) });
        command("settle");
      };
    }
  });
}

// A number that can be typed: while it is, and until what was typed is told back, it stays.
function showNumber(cell, value) {
  if (document.activeElement !== cell) cell.value = written(value);
  cell.told = written(value);
  cell.sent = false;
  // What was beyond its bounds is not what was taken.
  cell.onblur = () => {
    if (!cell.sent) cell.value = cell.told;
  };
}

// Where the last fit has it for sure, below the slider.
function errorBar(bar, slider) {
  bar.hidden = slider.interval === null;
  if (bar.hidden) return;
  const [from, to] = slider.interval.map((value) => clamp(place(slider, value)));
  bar.style.setProperty("--from", from);
  bar.style.setProperty("--wide", to - from);
}

function showGains() {
  const idle = state.fitting === null;
  const rows = state.gains?.rows ?? [];
  if (state.gains?.shown && !$("gains").dataset.seen) {
    $("gains").open = true;
    $("gains").dataset.seen = "yes";
  }
  $("free-gains").checked = state.gains?.free ?? false;
  $("free-white-balance").checked = state.gains?.white_balance ?? false;
  $("free-gains").disabled = $("free-white-balance").disabled = !idle;
  sync($("gain-rows"), rows, (gain) => gain.name, () => {
    const cells = [make("th", { scope: "row" }), make("input", { type: "range", min: 0, max: 1, step: 0.0005 }),
      make("input", { type: "number", step: "any", min: 0 }), make("td", { className: "error" })];
    const row = make("tr", {}, cells[0], make("td", {}, make("div", { className: "value" }, cells[1], cells[2])), cells[3]);
    row.cells_ = cells;
    return row;
  }, (item, gain) => {
    const [name, slider, number, error] = item.cells_;
    const { lower, upper } = state.gains;
    const range = { lower, upper, log: true, least: lower };
    const slide = (value) => command("slide_gain", { view: gain.view, channel: gain.channel, value });
    name.textContent = gain.name;
    error.textContent = gain.error ?? "";
    slider.disabled = number.disabled = !idle;
    slider.setAttribute("aria-label", `gain ${gain.name}`);
    number.setAttribute("aria-label", `value of gain ${gain.name}`);
    if (!slider.held) slider.value = place(range, gain.value);
    slider.setAttribute("aria-valuetext", written(gain.value));
    slider.oninput = () => {
      slider.held = true;
      slide(valueAt(range, Number(slider.value)));
    };
    slider.onchange = () => {
      slider.held = false;
      command("settle");
    };
    showNumber(number, gain.value);
    number.onchange = () => {
      if (number.value === "") return;
      number.sent = true;
      slide(Number(number.value));
      command("settle");
    };
  });
}

// All constants and scores side by side.
function showTables(tables) {
  $("tables-shown").replaceChildren(...tables.map(({ heads, rows }) => make("table", {},
    make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", { scope: "col", textContent: head })))),
    make("tbody", {}, ...rows.map(([name, ...cells]) => make("tr", {}, make("th", { scope: "row", textContent: name }),
      ...cells.map((words) => make("td", { textContent: words }))))))));
}
function toggleTables() {
  if ($("tables").open) {
    $("tables").close();
  } else {
    $("tables").showModal();
    send("tables");
  }
}
