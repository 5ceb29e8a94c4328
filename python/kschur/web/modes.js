// The page of modes: their list, and the stage.
function fillList() {
  by("message").textContent = `${facts.message}. ${facts.nodes} nodes, ${facts.unknowns} unknowns.`;
  const directions = Object.keys((facts.modes[0] || {}).masses || {});
  const heads = ["", "mode", "Hz", "damping %", "kind", "backward error", ...directions.map(name => `mass ${name} %`)];
  document.querySelector("#list thead").innerHTML = `<tr>${heads.map(head => `<th>${head}</th>`).join("")}</tr>`;
  facts.modes.forEach((mode, k) => {
    const row = document.querySelector("#list tbody").insertRow();
    row.className = mode.kind;
    row.title = `eigenvalue ${shown(mode.re)} ${mode.im < 0 ? "-" : "+"} ${shown(Math.abs(mode.im))} i (1/s), damped ${shown(mode.damped)} Hz`;
    row.dataset.frequency = mode.frequency;
    const box = document.createElement("input");
    box.type = "checkbox";
    row.insertCell().append(box);
    const damping = mode.damping === null ? "–" : shown(100 * mode.damping, 3), masses = directions.map(name => (100 * mode.masses[name]).toFixed(1));
    for (const text of [mode.number, shown(mode.frequency, 6), damping, mode.kind, mode.backward === null ? "–" : mode.backward.toExponential(1), ...masses])
      row.insertCell().textContent = text;
    row.addEventListener("click", event => choose(event.target === box || event.ctrlKey ? toggled(state.chosen, k) : [k]));
  });
  by("notes").style.display = facts.notes.length ? "" : "none";
  for (const note of facts.notes) by("notes").append(Object.assign(document.createElement("p"), {textContent: note}));
}

const toggled = (list, k) => list.includes(k) ? list.filter(other => other !== k) : [...list, k].sort((p, q) => p - q);

function seenAs(mode, shape) {
  return {shape, title: `Mode ${mode.number}: ${shown(mode.frequency)} Hz`, words: mode.kind + (mode.damping ? `, damping ${shown(100 * mode.damping, 3)} %` : "")};
}

async function choose(modes) {
  if (!modes.length) modes = state.chosen;
  state.chosen = modes;
  await see(modes.map(k => seenAs(facts.modes[k], k)));
  document.querySelectorAll("#list tbody tr").forEach((row, k) => {
    row.classList.toggle("shown", modes.includes(k));
    row.querySelector("input").checked = modes.includes(k);
  });
}

fillList();
drawMac(by("mac"), by("mac-value"));
window.kschur = {facts, state, models, choose, camera: () => camera};
beginStage(() => choose([Math.max(0, facts.modes.findIndex(mode => mode.kind !== "rigid" && mode.kind !== "real"))]));
