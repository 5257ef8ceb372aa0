// Images, and what the pointer does with them; the pixel that is pointed at.
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
