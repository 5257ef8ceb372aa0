// Runs in each of the page's workers, after the library's glue (`wasm_bindgen`): one draws, the other fits.
"use strict";

// What the worker has been told to be.
let role = null, stage = null, fitter = null;
// Panes that the page shows.
let shown = [];

const say = (message, transfer) => postMessage(message, transfer ?? []);
// What a panic of the library's has said is more than the error that it ends with.
function fail(error) {
  const fault = globalThis.fault;
  const words = fault
    ? `a fault of skinfit's: ${fault.split("\n").join(" ")}. Please report it; reload the page to go on.`
    : String(error?.message ?? error);
  // Nobody waits any longer for a fit that has failed; its worker is not used again.
  if (role === "fit") say({ said: [JSON.stringify({ is: "failed", words })], broken: true });
  else say({ failed: words });
}

// Turns of the event loop without a timer's delay, so that what is asked in between is heard.
const turns = new MessageChannel();
let queued = null;
function soon(work) {
  if (queued === null) {
    queued = work;
    turns.port2.postMessage(null);
  }
}
turns.port1.onmessage = () => {
  const work = queued;
  queued = null;
  try {
    work();
  } catch (error) {
    fail(error);
  }
};

function poll() {
  const state = JSON.parse(stage.poll());
  say({ state });
  for (const name of shown) {
    const image = stage.pixels(name);
    if (image) {
      const size = new DataView(image.buffer, image.byteOffset, 8);
      const [width, height] = [size.getUint32(0, true), size.getUint32(4, true)];
      say({ pane: name, width, height, image: image.buffer }, [image.buffer]);
    }
  }
  const asks = stage.asks();
  if (asks.length) say({ asks });
}

function slice() {
  const more = fitter.slice();
  const said = fitter.said();
  if (said.length) say({ said });
  if (more) soon(slice);
}

const does = {
  async draw({ module, scene, cpu }) {
    role = "draw";
    await wasm_bindgen({ module_or_path: module });
    stage = new wasm_bindgen.Stage(new Uint8Array(scene), cpu, () => soon(poll), (words) => say({ progress: words }));
    say({ ramps: [stage.ramp(false), stage.ramp(true)] });
    soon(poll);
  },
  async fit({ module, scene }) {
    role = "fit";
    await wasm_bindgen({ module_or_path: module });
    fitter = new wasm_bindgen.Fitter(new Uint8Array(scene), (words) => say({ progress: words }));
  },
  command({ command }) {
    stage.command(JSON.stringify(command));
    soon(poll);
  },
  shown({ names }) {
    shown = names;
    stage.command(JSON.stringify({ do: "panes", names }));
    soon(poll);
  },
  probe({ x, y }) {
    say({ probe: JSON.parse(stage.probe(x, y)), x, y });
  },
  tables() {
    say({ tables: JSON.parse(stage.tables()) });
  },
  save() {
    say({ saved: stage.params_file() });
    soon(poll);
  },
  constants({ number }) {
    say({ constants: JSON.parse(stage.constants()), number });
  },
  said({ said }) {
    for (const words of said) stage.hear(words);
    soon(poll);
  },
  ask({ asks }) {
    for (const words of asks) fitter.ask(words);
    soon(slice);
  },
};

// In their order: what is asked of a library that is still being unpacked waits for it.
let before = Promise.resolve();
onmessage = ({ data }) => {
  before = before.then(() => does[data.does](data)).catch(fail);
};
