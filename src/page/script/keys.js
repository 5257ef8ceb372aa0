// Keys, and what the mouse does, for the list of them.
const cycle = (all, now) => all[(all.findIndex(([value]) => value === now) + 1) % all.length][0];
const KEYS = [
  ["F1", "this list", () => $("keys").open ? $("keys").close() : $("keys").showModal()],
  ["F2", "all constants, side by side", toggleTables],
  ["Ctrl+Z", "undo", () => command("undo")],
  ["Ctrl+Shift+Z", "redo", () => command("redo")],
  ["Ctrl+Y", "redo", () => command("redo")],
  ["Ctrl+Enter", "fit from where the sliders stand", () => command("fit")],
  ["P", "pause the fit, or let it go on", () => command("pause")],
  ["Escape", "stop the fit; what it has found stays", () => command("stop")],
  ["V", "next view", () => command("next_view")],
  ["L", "side by side, wipe, or flip", () => look({ layout: cycle(state.layouts, state.look.layout) })],
  ["F", "flip between the first two panes", () => { flipped = !flipped; showPanes(); }],
  ["E", "error: FLIP, signed, relative", () => look({ error: cycle(state.errors, state.look.error) })],
  ["O", "error of now, the fit, the start, or the other run", () => look({ error_of: cycle(state.error_of, state.look.error_of) })],
  ["T", "terms of the image, or none", () => command("terms", { on: !state.terms })],
  ["+", "half a stop brighter", () => look({ exposure: state.look.exposure + 0.5 })],
  ["-", "half a stop darker", () => look({ exposure: state.look.exposure - 0.5 })],
  ["C", "luminance as a colour", () => look({ false_colour: !state.look.false_colour })],
  ["W", "whole image", () => { zoom = { scale: 1, x: 0.5, y: 0.5 }; paint(); }],
  ["H", "the view's own camera", () => command("home")],
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
// Those of panes, whose names the worker knows; and the list of all keys.
function listKeys() {
  KEYS.push(...state.offered.map((name, i) => [String(i + 1), `pane ${name}`, () => toggle(name)]));
  $("key-rows").replaceChildren(...[...KEYS, ...MOUSE].map(([key, words]) => make("tr", {},
    make("th", { scope: "row", textContent: key }), make("td", { textContent: words }))));
}
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
  if (($("keys").open && event.key !== "F1") || ($("tables").open && event.key !== "F2")) return;
  const list = document.querySelector("details.reset[open]");
  if (event.key === "Escape" && list) {
    list.open = false;
    list.firstChild.focus();
    return;
  }
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
  if (!row?.[2] || state === null || (writing && !["F1", "F2", "Ctrl+Enter"].includes(name))) return;
  row[2]();
  event.preventDefault();
}
