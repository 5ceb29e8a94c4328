// The page of a sweep: two diagrams of its branches, and the stage where there are shapes.
const hasStage = typeof beginStage === "function";
const valueText = value => `${facts.name} ${shown(value)}${facts.unit ? ` ${facts.unit}` : ""}`;

// How many branches lie below one, on each other.
function level(b) {
  return facts.branches[b].on === null ? 0 : 1 + level(facts.branches[b].on);
}

function words(b, p) {
  const {hertz, natural, damping, unstable} = facts.branches[b];
  return `${shown(hertz[p])} Hz damped, ${shown(natural[p])} Hz natural, damping ${damping[p] === null ? "–" : shown(100 * damping[p], 3)} %${unstable[p] ? ", unstable" : ""}`;
}

function linesOver(x, y) {
  return facts.branches.map((branch, b) => ({...lineStyle(b), x: x(branch), y: y(branch), b, radius: 2.5 + 2 * Math.min(level(b), 4), open: level(b) > 0,
    red: p => branch.unstable[p], tip: p => `branch ${b + 1}, ${valueText(facts.values[p])}\n${words(b, p)}`}));
}

const campbellLines = linesOver(() => facts.values, branch => branch.hertz);
const rootLines = linesOver(branch => branch.re, branch => branch.hertz);

function marksOfCampbell() {
  const marks = facts.events.filter(event => event.kind !== "unsure").map(event => ({x: event.value, y: event.hertz, form: event.kind === "crossing" ? "square" : "diamond",
    colour: "#1d2733", hidden: () => campbellLines[event.first].hidden || campbellLines[event.second].hidden}));
  return [...marks, ...facts.onsets.map(onset => ({x: onset.value, y: onset.hertz, form: "triangle", colour: onset.unstable ? "#d11507" : "#1e8449", text: shown(onset.value),
    hidden: () => campbellLines[onset.branch].hidden}))];
}

function starts() {
  return rootLines.map(line => ({line, k: line.y.findIndex(y => y !== null)})).filter(({k}) => k >= 0)
    .map(({line, k}) => ({x: line.x[k], y: line.y[k], form: "circle", colour: line.colour, hidden: () => line.hidden}));
}

// From where the axis of the parameter is zero, or the sweep begins, to the highest frequency there is.
function guides() {
  const first = Math.min(0, ...facts.values), last = Math.max(...facts.values);
  const top = facts.branches.flatMap(branch => branch.hertz).reduce((p, q) => Math.max(p, q), 0);
  const rays = facts.orders.map(({order, slope}) => ({x: [first, Math.min(last, slope > 0 ? 1.05 * top / slope : last)], text: `${order}P`, slope}))
    .map(({x, text, slope}) => ({x, y: x.map(value => slope * value), text}));
  return [...rays, ...facts.events.filter(event => event.kind === "unsure").map(event => ({x: [event.value, event.value], y: [0, top], text: "unsure"}))];
}

const charts = [
  new Chart(by("campbell"), {x: {label: facts.parameter}, y: {label: "damped frequency (Hz)", from: 0}}, campbellLines, {marks: marksOfCampbell(), guides: guides(), pick: choose}),
  new Chart(by("roots"), {x: {label: "real part (1/s)"}, y: {label: "damped frequency (Hz)"}}, rootLines, {marks: starts(), redFrom: 0, pick: choose})];

// The shape of a branch at a point, or at the nearest one that has any.
function shapeNear(b, p) {
  const there = facts.shapes[b].map((shape, q) => ({shape, q})).filter(({shape}) => shape !== null);
  return there.sort((first, second) => Math.abs(first.q - p) - Math.abs(second.q - p))[0];
}

async function choose(line, p) {
  const b = line.b, near = shapeNear(b, p);
  charts.forEach(chart => { chart.picked = {line: chart.lines[b], k: p}; chart.draw(); });
  by("chosen").textContent = `Branch ${b + 1} at ${valueText(facts.values[p])}: ${words(b, p)}.`;
  if (hasStage && near) await see([{shape: near.shape, model: facts.models[near.q], title: `Branch ${b + 1} at ${valueText(facts.values[near.q])}`, words: words(b, near.q)}]);
}

function chooseFirst() {
  const places = facts.branches.map((branch, b) => ({b, p: facts.shapes[b].findIndex(shape => shape !== null)})).filter(({p}) => p >= 0);
  const {b, p} = places.find(place => facts.branches[place.b].hertz[place.p] > 0) || places[0];
  return choose(campbellLines[b], p);
}

by("message").textContent = `${facts.message}.`;
fillLegend(by("legend"), facts.branches.map((branch, b) => ({text: `${b + 1}${branch.on === null ? "" : ` on ${branch.on + 1}`}`,
  title: "Click to hide or show", lines: [campbellLines[b], rootLines[b]]})), charts);
window.kschur = {facts, charts, choose, state: hasStage ? state : null};
if (hasStage) beginStage(chooseFirst);
