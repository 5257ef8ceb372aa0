// Controls that are there from the beginning, and the beginning itself.
function listen() {
  const pairs = { undo: "undo", redo: "redo", home: "home", begin: "fit", resume: "resume", pause: "pause", stop: "stop" };
  for (const [id, name] of Object.entries(pairs)) $(id).onclick = () => command(name);
  $("forget").onclick = () => {
    failures.length = 0;
    command("forget");
  };
  $("terms").onchange = () => command("terms", { on: $("terms").checked });
  $("layout").onchange = () => look({ layout: $("layout").value });
  $("error-of").onchange = () => look({ error_of: $("error-of").value });
  $("free-gains").onchange = () => command("free_gains", { on: $("free-gains").checked });
  $("free-white-balance").onchange = () =>
    command("free_white_balance", { on: $("free-white-balance").checked });
  $("table").onclick = toggleTables;
  $("error").onchange = () => look({ error: $("error").value });
  $("tone").onchange = () => look({ operator: $("tone").value });
  $("exposure").onchange = () => look({ exposure: Number($("exposure").value) || 0 });
  $("false-colour").onchange = () => look({ false_colour: $("false-colour").checked });
  $("help").onclick = () => $("keys").showModal();
  $("save").onclick = () => send("save");
  $("load").onchange = async () => {
    const [file] = $("load").files;
    if (file) command("load", { name: file.name, text: await file.text() });
    $("load").value = "";
  };
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
