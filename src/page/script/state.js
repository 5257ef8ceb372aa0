// What the worker has told, shown; what does not fit elsewhere.
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
const visible = () => [...panes, ...(state?.terms ? state.panes.filter((pane) => pane.term).map((pane) => pane.name) : [])];
const isTerm = (name) => state.panes.find((pane) => pane.name === name)?.term;
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
  sync($("error-of"), state.error_of, ([slot]) => slot, ([slot, name]) => make("option", { value: slot, textContent: `of ${name}` }), () => {});
  $("error-of").value = state.error_shown;
  const shownNow = JSON.stringify(visible());
  if (shownNow !== wanted) {
    wanted = shownNow;
    send("shown", { names: visible() });
  }
  showEffects();
  showRows();
  showGains();
  showPanes();
  showFit();
  if (next.losses) showCurves();
  if ($("tables").open) send("tables");
  showTold();
  status();
}

// What never changes: choices.
function once() {
  listKeys();
  const options = (select, all, now) => select.replaceChildren(
    ...all.map(([value, name]) => make("option", { value, textContent: name, selected: value === now })));
  options($("layout"), state.layouts, state.look.layout);
  options($("error"), state.errors, state.look.error);
  options($("tone"), state.tones.map((name) => [name, name]), state.look.operator);
}

// What is shown and how, ahead of what is told of it: two keys in a row are two changes.
function look(change) {
  if (state === null) return;
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
  const kept = new Set(children);
  for (const child of [...place.children]) if (!kept.has(child)) child.remove();
  // What stays where it is keeps the focus.
  children.forEach((child, i) => {
    if (place.children[i] !== child) place.insertBefore(child, place.children[i] ?? null);
  });
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
