// The page of a response: amplitude and phase over frequency, the curve of Nyquist, and the stage where there are shapes.
const hasStage = typeof beginStage === "function";
const amplitudes = facts.unknowns.map(unknown => unknown.re.map((re, k) => Math.hypot(re, unknown.im[k])));
const phases = facts.unknowns.map(unknown => unknown.re.map((re, k) => Math.atan2(unknown.im[k], re) * 180 / Math.PI));

function linesOver(x, y) {
  return facts.unknowns.map((unknown, u) => ({...lineStyle(u), x: x(unknown, u), y: y(unknown, u), radius: 2, red: () => false,
    tip: k => `${unknown.name}\n${shown(facts.frequencies[k])} Hz: amplitude ${shown(amplitudes[u][k])}, phase ${shown(phases[u][k], 4)}°`}));
}

const frequencies = () => facts.frequencies;
const charts = [
  new Chart(by("amplitude-plot"), {x: {label: "frequency (Hz)"}, y: {label: "amplitude", log: true}}, linesOver(frequencies, (_, u) => amplitudes[u]), {pick: choose}),
  new Chart(by("phase-plot"), {x: {label: "frequency (Hz)"}, y: {label: "phase (degrees)", from: -190, to: 190, step: 90}}, linesOver(frequencies, (_, u) => phases[u]), {pick: choose}),
  new Chart(by("nyquist-plot"), {x: {label: "real part"}, y: {label: "imaginary part"}}, linesOver(unknown => unknown.re, unknown => unknown.im), {pick: choose})];

// The frequency with a shape that is nearest.
function shapeNear(k) {
  const there = facts.shapes.map((shape, q) => ({shape, q})).filter(({shape}) => shape);
  return there.sort((first, second) => Math.abs(first.q - k) - Math.abs(second.q - k))[0];
}

async function choose(line, k) {
  const u = Math.max(...charts.map(chart => chart.lines.indexOf(line))), near = shapeNear(k);
  charts.forEach(chart => { chart.picked = {line: chart.lines[u], k}; chart.draw(); });
  by("chosen").textContent = line.tip(k).replace("\n", ", ") + ".";
  if (hasStage && near) await see([{shape: near.shape.number, title: `${shown(facts.frequencies[near.q])} Hz`, words: `operating shape, largest displacement ${shown(near.shape.largest, 4)}`}]);
}

function toggle(id, axes) {
  by(id).addEventListener("change", () => {
    axes.forEach(([chart, name]) => { charts[chart].axes[name].log = by(id).checked; });
    charts.forEach(chart => { chart.showAll(); chart.draw(); });
  });
}

by("message").textContent = `${facts.message}.`;
toggle("log-amplitude", [[0, "y"]]);
toggle("log-frequency", [[0, "x"], [1, "x"]]);
fillLegend(by("legend"), facts.unknowns.map((unknown, u) => ({text: unknown.name, title: "Click to hide or show", lines: charts.map(chart => chart.lines[u])})), charts);
window.kschur = {facts, charts, choose, state: hasStage ? state : null};
const highest = amplitudes[0].reduce((best, value, k) => value > amplitudes[0][best] ? k : best, 0);
if (hasStage) beginStage(() => choose(charts[0].lines[0], highest));
