// The page: what one does goes to the worker that draws, what that says is shown. Nothing is computed here.
"use strict";

const $ = (id) => document.getElementById(id);
const make = (name, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
};

// ---- the workers ----

// Bytes that the page holds as gzip in base64.
async function unpacked(id) {
  if (!globalThis.DecompressionStream) {
    throw new Error("this browser cannot unpack it. Use one of 2023 or later.");
  }
  const text = $(id).textContent.trim();
  $(id).remove();
  const letters = atob(text);
  const packed = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i += 1) packed[i] = letters.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

// Whether there is an adapter to draw with; without one the CPU engine draws.
async function adapter() {
  if (location.hash === "#cpu") return "the page was asked for it (#cpu)";
  if (!navigator.gpu) return "this browser has no WebGPU";
  try {
    return (await navigator.gpu.requestAdapter()) ? null : "this browser's WebGPU has no adapter";
  } catch (error) {
    return `this browser's WebGPU has no adapter (${error.message})`;
  }
}

let drawer = null, fitter = null, begun = () => {};
const send = (does, more = {}) => drawer?.postMessage({ does, ...more });
const command = (name, more = {}) => send("command", { command: { do: name, ...more } });

async function begin() {
  const source = [$("glue").textContent, $("worker").textContent].join("\n");
  const url = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
  const [library, scene, without] = await Promise.all([unpacked("library"), unpacked("scene"), adapter()]);
  const module = await WebAssembly.compile(library);
  const worker = (name) => {
    const made = new Worker(url, { name });
    made.onmessage = ({ data }) => heard(data, name);
    made.onerror = (event) => {
      if (name === "draw") tell(`the worker that draws has failed: ${event.message}. Reload the page.`);
      else heard({ said: [JSON.stringify({ is: "failed", words: event.message })], broken: true }, name);
    };
    return made;
  };
  // One that has failed is not used again.
  begun = () => {
    fitter?.terminate();
    fitter = worker("fit");
    fitter.postMessage({ does: "fit", module, scene });
  };
  drawer = worker("draw");
  if (without) note = `The CPU engine draws: ${without}.`;
  send("draw", { module, scene, cpu: without !== null });
  begun();
  chosen(["target", "now", "error"]);
}

function heard(data, from) {
  if (data.state) show(data.state);
  if (data.pane) {
    const bytes = new Uint8ClampedArray(data.image, 8);
    const number = (drawn += 1);
    createImageBitmap(new ImageData(bytes, data.width, data.height)).then((bitmap) => {
      const old = images.get(data.pane);
      // Bitmaps may be made in another order.
      if (old?.number > number) return;
      old?.bitmap.close();
      images.set(data.pane, { bitmap, bytes, number, width: data.width, height: data.height });
      paint();
    }).catch((error) => tell(`an image cannot be shown: ${error.message}`));
  }
  if (data.asks) fitter.postMessage({ does: "ask", asks: data.asks });
  if (data.said) send("said", { said: data.said });
  if (data.broken) begun();
  if (data.probe) showProbe(data);
  if (data.saved) download("params.toml", data.saved);
  if (data.ramps) ramps = data.ramps;
  if (data.progress !== undefined) {
    progress[from] = data.progress;
    status();
  }
  if (data.constants) waiting.get(data.number)?.(data.constants);
  if (data.failed) tell(data.failed);
}

function tell(words) {
  failures.push(words);
  showTold();
}

function download(name, text) {
  const href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  make("a", { href, download: name }).click();
  URL.revokeObjectURL(href);
}

// ---- state ----

let state = null, note = "", drawn = 0, ramps = null;
const progress = { draw: "", fit: "" };
let calls = 0;
const failures = [], images = new Map(), waiting = new Map();
let panes = [], zoom = { scale: 1, x: 0.5, y: 0.5 }, wipe = 0.5, flipped = false;

function chosen(names) {
  panes = names;
  send("shown", { names: visible() });
}

// Panes by themselves, and terms after them.
const visible = () => [...panes, ...(state?.terms ? state.panes.filter((pane) => pane.title && isTerm(pane.name)).map((pane) => pane.name) : [])];
const offered = ["target", "now", "start", "fit", "other run", "error"];
const isTerm = (name) => !offered.includes(name);
let wanted = "";

function show(next) {
  const before = state;
  state = { ...next, losses: next.losses ?? before?.losses ?? [], ways: next.ways ?? before?.ways ?? [] };
  if (before === null) once();
  follow();
  announce(before);
  $("undo").disabled = !state.can_undo;
  $("redo").disabled = !state.can_redo;
  $("home").hidden = state.home;
  buttons($("views"), state.views.map((view) => view.name), "view", (i) => i === state.view,
    (i) => command("view", { index: i }));
  const names = state.panes.map((pane) => pane.name).filter((name) => !isTerm(name));
  buttons($("pane-names"), names, "pane", (i) => panes.includes(names[i]),
    (i) => toggle(names[i]));
  $("terms").checked = state.terms;
  const shownNow = JSON.stringify(visible());
  if (shownNow !== wanted) {
    wanted = shownNow;
    send("shown", { names: visible() });
  }
  showEffects();
  showRows();
  showPanes();
  showFit();
  if (next.losses) showCurves();
  showTold();
  status();
}

// What never changes: choices.
function once() {
  const options = (select, all, now) => select.replaceChildren(
    ...all.map(([value, name]) => make("option", { value, textContent: name, selected: value === now })));
  options($("layout"), state.layouts, state.look.layout);
  options($("error"), state.errors, state.look.error);
  options($("tone"), state.tones.map((name) => [name, name]), state.look.operator);
}

// What is shown and how, ahead of what is told of it: two keys in a row are two changes.
function look(change) {
  state.look = { ...state.look, ...change };
  command("look", { look: state.look });
  follow();
}
// Controls of the look as it is.
function follow() {
  const { layout, error, operator, exposure, false_colour } = state.look;
  $("layout").value = layout;
  $("error").value = error;
  $("tone").value = operator;
  if (document.activeElement !== $("exposure")) $("exposure").value = exposure;
  $("false-colour").checked = false_colour;
}

// Beginnings and ends, for those who do not see them.
function announce(before) {
  const words = [];
  if (before?.opening !== false && !state.opening) words.push("The scene is there.");
  if (!before?.fitting && state.fitting) words.push("A fit begins.");
  if (before?.fitting && !state.fitting) words.push(state.found ?? "The fit has ended.");
  if (words.length) $("live").textContent = words.join(" ");
}

function buttons(place, names, kind, on, press) {
  sync(place, names.map((name, i) => ({ name, i })), (row) => row.name,
    () => make("button"),
    (button, { name, i }) => {
      button.textContent = name;
      button.setAttribute("aria-label", `${kind} ${name}`);
      button.setAttribute("aria-pressed", String(on(i)));
      button.onclick = () => press(i);
    });
}

// One child for each of a list, kept where its key is.
function sync(place, list, key, create, update) {
  const old = new Map([...place.children].map((child) => [child.dataset.key, child]));
  const children = list.map((item) => {
    const child = old.get(key(item)) ?? create(item);
    child.dataset.key = key(item);
    update(child, item);
    return child;
  });
  if (children.length !== place.children.length || children.some((child, i) => place.children[i] !== child)) {
    place.replaceChildren(...children);
  }
}

function status() {
  const words = [];
  if (note) words.push(note);
  if (!state || state.opening) words.push("The scene is being read.");
  words.push(...Object.values(progress).filter(Boolean));
  if (state?.image) {
    const { milliseconds, bytes, psnr, flip } = state.image;
    words.push(`${state.engine}: ${milliseconds.toFixed(1)} ms an image, ${(bytes / 1e6).toFixed(1)} MB.`);
    if (psnr !== null) words.push(`now: ${psnr.toFixed(2)} dB, FLIP ${flip.toFixed(4)}.`);
  }
  $("status").textContent = words.join(" ");
}

function showTold() {
  const words = [...(state?.told ?? []), ...failures];
  $("told").hidden = words.length === 0;
  $("told").firstElementChild.textContent = words.at(-1) ?? "";
  $("told").title = words.join("\n");
}

// ---- parameters ----

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
const DECADES = 4;
const place = ({ lower, upper, log }, value) => {
  if (!log) return (value - lower) / (upper - lower);
  const least = lower > 0 ? lower : upper * 10 ** -DECADES;
  return value <= least ? 0 : Math.log(value / least) / Math.log(upper / least);
};
const valueAt = ({ lower, upper, log }, at) => {
  if (!log) return lower + at * (upper - lower);
  const least = lower > 0 ? lower : upper * 10 ** -DECADES;
  return at <= 0 ? lower : least * (upper / least) ** at;
};
const written = (value) => String(Number(value.toPrecision(6)));

function showRows() {
  sync($("rows"), state.rows, (row) => row.name, () => {
    const cells = [make("input", { type: "checkbox" }), make("button"), make("div", { className: "value" }),
      make("div", { className: "error" }), make("select")];
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
    const resets = ["", ...row.resets].join("|");
    if (reset.dataset.resets !== resets) {
      reset.dataset.resets = resets;
      reset.replaceChildren(make("option", { value: "", textContent: "…" }),
        ...row.resets.map((to) => make("option", { value: to, textContent: `to the ${to}` })));
    }
    reset.disabled = !idle;
    reset.setAttribute("aria-label", `reset ${row.name}`);
    reset.onchange = () => {
      if (reset.value) command("reset", { param: row.name, to: reset.value });
      reset.value = "";
    };
    showSliders(values, row, idle);
  });
}

function showSliders(values, row, idle) {
  const cells = row.sliders.flatMap((slider) => ["channel", "slider", "number"].map((kind) => ({ slider, kind })));
  sync(values, cells, ({ slider, kind }) => `${slider.name} ${kind}`, ({ kind }) => ({
    channel: () => make("span"),
    slider: () => make("input", { type: "range", min: 0, max: 1, step: 0.0005 }),
    number: () => make("input", { type: "number", step: "any" }),
  })[kind](), (cell, { slider, kind }) => {
    if (kind === "channel") {
      cell.textContent = slider.channel;
      return;
    }
    const label = `${slider.channel} ${row.name}`.trim();
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
      if (document.activeElement !== cell) cell.value = written(slider.value);
      cell.onchange = () => {
        if (cell.value !== "") {
          command("slide", { slider: slider.name, value: Number(cell.value) });
          command("settle");
        }
      };
    }
  });
}

// ---- panes ----

function showPanes() {
  const layout = state.look.layout;
  let names = visible();
  if (layout === "Wipe") names = names.slice(0, 1);
  if (layout === "Flip") names = names.slice(flipped && names.length > 1 ? 1 : 0).slice(0, 1);
  const rows = names.map((name) => state.panes.find((pane) => pane.name === name)).filter(Boolean);
  sync($("panes"), rows, (pane) => pane.name, (pane) => {
    const canvas = make("canvas", { tabIndex: 0 });
    // Keys and the pointer move what it shows.
    canvas.setAttribute("role", "application");
    pointer(canvas);
    return make("figure", {}, canvas, make("p", { className: "lacking" }), make("figcaption"));
  }, (figure, pane) => {
    const [canvas, lacking, caption] = figure.children;
    canvas.dataset.name = pane.name;
    canvas.hidden = pane.lacking !== null;
    if (canvas.hidden) {
      images.get(pane.name)?.bitmap.close();
      images.delete(pane.name);
    }
    lacking.hidden = !canvas.hidden;
    lacking.textContent = pane.lacking ?? "";
    const title = layout === "Wipe" && visible().length > 1 ? `${pane.name} | ${visible()[1]}` : pane.title;
    canvas.setAttribute("aria-label", title);
    const key = [title, pane.name, state.look.error, state.look.false_colour].join("|");
    if (caption.dataset.key !== key) {
      caption.dataset.key = key;
      caption.replaceChildren(title);
      if (ramps && (pane.name === "error" || state.look.false_colour)) caption.append(ramp(pane.name));
    }
  });
  paint();
}

// The colours of a pane's scale, from its least to its greatest.
function ramp(name) {
  const signed = name === "error" && state.look.error === "Signed";
  const canvas = make("canvas", { width: 256, height: 1, className: "ramp" });
  canvas.setAttribute("aria-hidden", "true");
  canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(ramps[signed ? 1 : 0]), 256, 1), 0, 0);
  return canvas;
}

let painting = false;
function paint() {
  if (painting) return;
  painting = true;
  requestAnimationFrame(() => {
    painting = false;
    for (const canvas of $("panes").querySelectorAll("canvas[data-name]")) paintPane(canvas);
  });
}

function paintPane(canvas) {
  const image = images.get(canvas.dataset.name);
  if (!image || canvas.hidden) return;
  const { bitmap } = image;
  if (canvas.width !== image.width || canvas.height !== image.height) {
    canvas.width = image.width;
    canvas.height = image.height;
  }
  const context = canvas.getContext("2d");
  context.imageSmoothingEnabled = false;
  const across = image.width / zoom.scale, down = image.height / zoom.scale;
  const left = image.width * zoom.x - across / 2, top = image.height * zoom.y - down / 2;
  const put = (bitmap) => context.drawImage(bitmap, left, top, across, down, 0, 0, image.width, image.height);
  context.fillStyle = "#222";
  context.fillRect(0, 0, image.width, image.height);
  put(bitmap);
  const other = images.get(visible()[1]);
  if (state.look.layout === "Wipe" && other && other.width === image.width && other.height === image.height) {
    const line = wipe * image.width;
    context.save();
    context.beginPath();
    context.rect(line, 0, image.width - line, image.height);
    context.clip();
    put(other.bitmap);
    context.restore();
    context.fillStyle = "#ffd933";
    context.fillRect(line - 1, 0, 2, image.height);
  }
}

// The pixel of the image below a pointer.
function pixel(canvas, event) {
  const box = canvas.getBoundingClientRect();
  const [width, height] = state.size;
  const at = (from, size, middle, share) => Math.floor(size * middle + (share - 0.5) * size / zoom.scale);
  const x = at(0, width, zoom.x, (event.clientX - box.left) / box.width);
  const y = at(0, height, zoom.y, (event.clientY - box.top) / box.height);
  return x >= 0 && y >= 0 && x < width && y < height ? { x, y } : null;
}

function pointer(canvas) {
  let held = null;
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    held = { x: event.clientX, y: event.clientY, button: event.button };
    const at = pixel(canvas, event);
    if (at) probeSoon(at);
  };
  canvas.onpointermove = (event) => {
    const at = pixel(canvas, event);
    if (at) probeSoon(at);
    if (!held) return;
    const box = canvas.getBoundingClientRect();
    const x = (event.clientX - held.x) / box.width, y = (event.clientY - held.y) / box.height;
    held = { ...held, x: event.clientX, y: event.clientY };
    if (held.button !== 0) {
      zoom = { ...zoom, x: clamp(zoom.x - x / zoom.scale), y: clamp(zoom.y - y / zoom.scale) };
      paint();
    } else if (event.shiftKey) {
      command("light", { degrees: 180 * x });
    } else if (state.look.layout === "Wipe") {
      wipe = clamp((event.clientX - box.left) / box.width);
      paint();
    } else {
      command("orbit", { yaw: Math.PI * x, pitch: Math.PI * y, distance: 1 });
    }
  };
  canvas.onpointerup = canvas.onpointercancel = canvas.onlostpointercapture = () => {
    if (held) command("settle");
    held = null;
  };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.ondblclick = whole;
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const factor = Math.exp(-event.deltaY / 300);
    if (event.ctrlKey) command("orbit", { yaw: 0, pitch: 0, distance: 1 / factor });
    else zoomBy(factor);
  }, { passive: false });
}

const clamp = (share) => Math.min(1, Math.max(0, share));
function zoomBy(factor) {
  zoom = { ...zoom, scale: Math.min(64, Math.max(0.25, zoom.scale * factor)) };
  paint();
}
function whole() {
  zoom = { scale: 1, x: 0.5, y: 0.5 };
  command("home");
  paint();
}

// ---- probe ----

let probing = null;
function probeSoon(at) {
  if (probing === null) requestAnimationFrame(() => {
    send("probe", probing);
    probing = null;
  });
  probing = at;
}

function showProbe({ probe }) {
  $("probe-hint").hidden = true;
  sync($("probe-rows"), probe, ([name]) => name,
    () => make("tr", {}, make("th", { scope: "row" }), make("td")),
    (row, [name, words]) => {
      row.children[0].textContent = name;
      row.children[1].textContent = words;
    });
}

// ---- fit ----

function showFit() {
  const { fitting } = state;
  const idle = fitting === null && !state.opening;
  $("begin").disabled = !idle;
  $("resume").disabled = !idle || !state.can_resume;
  $("pause").disabled = $("stop").disabled = idle;
  $("pause").textContent = fitting?.paused ? "go on" : "pause";
  sync($("fitted-views"), state.views.filter((view) => view.target), (view) => view.name,
    () => make("label", {}, make("input", { type: "checkbox" }), make("span")),
    (label, view) => {
      const [box, name] = label.children;
      name.textContent = view.name;
      box.checked = view.fitted;
      box.disabled = !idle;
      box.setAttribute("aria-label", `fit view ${view.name}`);
      box.onchange = () => command("fit_view", { view: view.name, on: box.checked });
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

// ---- keys ----

const cycle = (all, now) => all[(all.findIndex(([value]) => value === now) + 1) % all.length][0];
const KEYS = [
  ["F1", "this list", () => $("keys").open ? $("keys").close() : $("keys").showModal()],
  ["Ctrl+Z", "undo", () => command("undo")],
  ["Ctrl+Shift+Z", "redo", () => command("redo")],
  ["Ctrl+Y", "redo", () => command("redo")],
  ["Ctrl+Enter", "fit from where the sliders stand", () => command("fit")],
  ["P", "pause the fit, or let it go on", () => command("pause")],
  ["Escape", "stop the fit; what it has found stays", () => command("stop")],
  ["V", "next view", () => command("view", { index: (state.view + 1) % Math.max(1, state.views.length) })],
  ["L", "side by side, wipe, or flip", () => look({ layout: cycle(state.layouts, state.look.layout) })],
  ["F", "flip between the first two panes", () => { flipped = !flipped; showPanes(); }],
  ["E", "error: FLIP, signed, relative", () => look({ error: cycle(state.errors, state.look.error) })],
  ["T", "terms of the image, or none", () => command("terms", { on: !state.terms })],
  ["+", "half a stop brighter", () => look({ exposure: state.look.exposure + 0.5 })],
  ["-", "half a stop darker", () => look({ exposure: state.look.exposure - 0.5 })],
  ["C", "luminance as a colour", () => look({ false_colour: !state.look.false_colour })],
  ["W", "whole image", () => { zoom = { scale: 1, x: 0.5, y: 0.5 }; paint(); }],
  ["H", "the view's own camera", () => command("home")],
  ...["target", "now", "start", "fit", "other run", "error"].map((name, i) => [String(i + 1), `pane ${name}`, () => toggle(name)]),
  ["Shift+Arrows", "turn the camera; in an image, arrows alone do", null],
  ["Alt+ArrowLeft", "turn the light to the left", () => light(-5)],
  ["Alt+ArrowRight", "turn the light to the right", () => light(5)],
  ["[", "line of the wipe to the left", () => moveWipe(-0.02)],
  ["]", "line of the wipe to the right", () => moveWipe(0.02)],
  ["PageUp", "larger", () => zoomBy(1.25)],
  ["PageDown", "smaller", () => zoomBy(0.8)],
  ["N", "nearer", () => command("orbit", { yaw: 0, pitch: 0, distance: 0.9 })],
  ["M", "farther", () => command("orbit", { yaw: 0, pitch: 0, distance: 1 / 0.9 })],
  ["Ctrl+Arrows", "move the image, where it is larger than its pane", null],
  ["Q", "probe the pixel in the middle", () => probeMiddle()],
];
const probeMiddle = () => {
  if (state.size) probeSoon({ x: Math.floor(state.size[0] * zoom.x), y: Math.floor(state.size[1] * zoom.y) });
};
const toggle = (name) => {
  if (state.panes.some((pane) => pane.name === name)) {
    chosen(panes.includes(name) ? panes.filter((other) => other !== name) : [...panes, name]);
  }
};
const light = (degrees) => {
  command("light", { degrees });
  command("settle");
};
const moveWipe = (share) => {
  wipe = clamp(wipe + share);
  paint();
};
const MOUSE = [
  ["drag", "turn the camera about the mesh; in a wipe, move its line"],
  ["Shift and drag", "turn the environment's light"],
  ["right button and drag", "move the image"],
  ["wheel", "zoom to a pixel; with Ctrl nearer or farther"],
  ["double click", "whole image, the view's own camera"],
];
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function pressed(event) {
  const { target } = event;
  if ($("keys").open && event.key !== "F1") return;
  const writing = target.matches?.("input[type=number], input[type=text]")
    || (target.matches?.("select") && !event.ctrlKey && event.key.length === 1)
    || (target.matches?.("input[type=range], select") && /^(Arrow|Page|Home|End)/.test(event.key));
  const control = event.ctrlKey || event.metaKey;
  // Of a letter or a sign that Shift makes, the sign says it.
  const shift = event.shiftKey && (control || event.key.length > 1);
  const name = (control ? "Ctrl+" : "") + (event.altKey ? "Alt+" : "") + (shift ? "Shift+" : "")
    + (event.key.length === 1 ? event.key.toUpperCase() : event.key);
  if (control && ARROWS[event.key] && !writing) {
    const [x, y] = ARROWS[event.key];
    zoom = { ...zoom, x: clamp(zoom.x + 0.1 * x / zoom.scale), y: clamp(zoom.y + 0.1 * y / zoom.scale) };
    paint();
    event.preventDefault();
    return;
  }
  const free = target.matches?.("canvas") || (event.shiftKey && !writing);
  if (free && ARROWS[event.key] && !control && !event.altKey) {
    const [x, y] = ARROWS[event.key];
    command("orbit", { yaw: 0.1 * x, pitch: 0.1 * y, distance: 1 });
    event.preventDefault();
    return;
  }
  const row = KEYS.find(([key]) => key === name);
  if (!row?.[2] || state === null || (writing && !["F1", "Ctrl+Enter"].includes(name))) return;
  row[2]();
  event.preventDefault();
}

function listen() {
  const pairs = { undo: "undo", redo: "redo", home: "home", begin: "fit", resume: "resume", pause: "pause", stop: "stop" };
  for (const [id, name] of Object.entries(pairs)) $(id).onclick = () => command(name);
  $("forget").onclick = () => {
    failures.length = 0;
    command("forget");
  };
  $("terms").onchange = () => command("terms", { on: $("terms").checked });
  $("layout").onchange = () => look({ layout: $("layout").value });
  $("error").onchange = () => look({ error: $("error").value });
  $("tone").onchange = () => look({ operator: $("tone").value });
  $("exposure").onchange = () => look({ exposure: Number($("exposure").value) || 0 });
  $("false-colour").onchange = () => look({ false_colour: $("false-colour").checked });
  $("help").onclick = () => $("keys").showModal();
  $("save").onclick = () => send("save");
  $("load").onchange = async () => {
    const [file] = $("load").files;
    if (file) command("load", { text: await file.text() });
    $("load").value = "";
  };
  $("key-rows").replaceChildren(...[...KEYS, ...MOUSE].map(([key, words]) => make("tr", {},
    make("th", { scope: "row", textContent: key }), make("td", { textContent: words }))));
  addEventListener("keydown", pressed);
}

// For scripts, in the page's console: the state as it is shown, commands, pixels as they are shown.
globalThis.skinfit = {
  state: () => state,
  told: () => [...(state?.told ?? []), ...failures],
  command,
  pixels: (name) => images.get(name),
  drawn: () => drawn,
  constants: () => new Promise((done) => {
    const number = (calls += 1);
    waiting.set(number, done);
    send("constants", { number });
  }),
};

listen();
begin().catch((error) => tell(`the page cannot begin: ${error.message}`));
