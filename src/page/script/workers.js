// The page: what one does goes to the worker that draws, what that says is shown. Nothing is computed here.
// `pack` puts the scripts of this folder one after another; this is the first.
"use strict";

const $ = (id) => document.getElementById(id);
const make = (name, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
};


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
  if (data.tables) showTables(data.tables);
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
