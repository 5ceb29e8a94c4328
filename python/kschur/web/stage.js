// The stage: shapes side by side, in motion, with what governs them. A shape is seen under a title and words below it.
const model = new Model();
const state = {seen: [], shapes: [], playing: true, phase: 0, frames: 0, ready: false};
let renderer, camera, pixel = 1;
// More edges than this hide what they bound, some pixels apart, and cost most of a frame: they are drawn where they are asked for.
const DENSE = 100000;

async function see(seen) {
  state.seen = seen;
  const shapes = await Promise.all(seen.map(one => model.shape(one.shape)));
  if (state.seen === seen) state.shapes = shapes;
}

function listParts() {
  const parts = [...new Set(model.parts)].sort((p, q) => p - q);
  by("parts").style.display = parts.length > 1 ? "" : "none";
  for (const part of parts) {
    const label = document.createElement("label"), box = document.createElement("input");
    Object.assign(box, {type: "checkbox", checked: true});
    box.addEventListener("change", () => { model.hidden[box.checked ? "delete" : "add"](part); model.show(); see([...state.seen]); });
    label.append(box, `part ${part + 1}`);
    document.querySelector("#parts div").append(label);
  }
}

// Panes that fill the stage with what is nearest to squares.
function panes(count, width, height) {
  let best = null;
  for (let columns = 1; columns <= count; ++columns) {
    const rows = Math.ceil(count / columns), side = Math.min(width / columns, height / rows);
    if (!best || side > best.side) best = {side, columns, rows};
  }
  return Array.from({length: count}, (_, k) => ({x: Math.round(k % best.columns * width / best.columns), y: Math.round(Math.floor(k / best.columns) * height / best.rows),
    width: Math.floor(width / best.columns), height: Math.floor(height / best.rows)}));
}

function draw() {
  const width = by("stage").clientWidth, height = by("stage").clientHeight, ratio = window.devicePixelRatio, over = by("overlay"), pen = over.getContext("2d");
  renderer.setPixelRatio(ratio);
  renderer.setSize(width, height, false);
  if (over.width !== Math.round(width * ratio) || over.height !== Math.round(height * ratio)) Object.assign(over, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  const colour = Number(by("colour").value), amplitude = Number(by("amplitude").value);
  Object.assign(model.uniforms.c, {value: Math.cos(state.phase)});
  Object.assign(model.uniforms.s, {value: Math.sin(state.phase)});
  Object.assign(model.uniforms.a, {value: amplitude * camera.size});
  model.uniforms.colour.value = colour;
  model.uniforms.palette.value = model.palettes[colour > 1 ? 1 : 0];
  renderer.setScissorTest(false);
  renderer.clear();
  renderer.setScissorTest(true);
  panes(state.shapes.length, width, height).forEach((pane, k) => {
    const shape = state.shapes[k];
    pixel = camera.place(pane.width, pane.height, amplitude);
    model.uniforms.pane.value.set(pane.width, pane.height);
    shape.rest.forEach(piece => { if (piece) piece.visible = by("rest").checked; });
    shape.edges.forEach(piece => { if (piece) piece.visible = by("edges").checked; });
    renderer.setViewport(pane.x, height - pane.y - pane.height, pane.width, pane.height);
    renderer.setScissor(pane.x, height - pane.y - pane.height, pane.width, pane.height);
    renderer.render(shape.scene, camera.lens);
    drawOverlay(pen, pane, state.seen[k], camera, pixel, colour);
  });
}

let last = null;
function step(now) {
  if (state.playing && last !== null) state.phase = (state.phase + 2 * Math.PI * Number(by("speed").value) * (now - last) / 1000) % (2 * Math.PI);
  last = now;
  if (state.playing) by("phase").value = state.phase * 180 / Math.PI;
  if (state.shapes.length === state.seen.length) draw();
  state.composed?.();
  ++state.frames;
  requestAnimationFrame(step);
}

// The stage as one picture.
function composed(canvas = document.createElement("canvas")) {
  const [space, over] = [by("space"), by("overlay")];
  if (canvas.width !== over.width || canvas.height !== over.height) Object.assign(canvas, {width: over.width, height: over.height});
  const pen = canvas.getContext("2d");
  pen.drawImage(space, 0, 0, canvas.width, canvas.height);
  pen.drawImage(over, 0, 0);
  return canvas;
}

function save(blob, name) {
  state.saved = {name, size: blob.size};
  const link = Object.assign(document.createElement("a"), {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// Two periods, longer where pictures come slowly.
function film() {
  const canvas = composed(), pieces = [], recorder = new MediaRecorder(canvas.captureStream(30), {mimeType: "video/webm"});
  recorder.ondataavailable = event => pieces.push(event.data);
  recorder.onstop = () => { state.composed = null; by("film").disabled = false; save(new Blob(pieces, {type: "video/webm"}), "shapes.webm"); };
  const end = performance.now() + 2000 / Number(by("speed").value);
  let frames = 0;
  state.composed = () => {
    composed(canvas);
    if (++frames >= 12 && performance.now() >= end && recorder.state === "recording") recorder.stop();
  };
  state.playing = true;
  by("film").disabled = true;
  recorder.start();
}

// Loads the model; `first` chooses what is seen first.
async function beginStage(first) {
  await model.load();
  renderer = new THREE.WebGLRenderer({canvas: by("space"), antialias: true, preserveDrawingBuffer: true});
  renderer.autoClear = false;
  renderer.setClearColor(0xffffff, 1);
  camera = new Camera(model.box);
  camera.follow(by("overlay"), () => pixel);
  listParts();
  if (model.edges.length / 2 > DENSE) for (const name of ["edges", "rest"]) by(name).checked = false;
  by("play").addEventListener("click", () => { state.playing = !state.playing; by("play").textContent = state.playing ? "Pause" : "Play"; });
  by("phase").addEventListener("input", () => { state.playing = false; by("play").textContent = "Play"; state.phase = by("phase").value * Math.PI / 180; });
  by("views").addEventListener("click", event => { if (event.target.dataset.view) camera.look(...event.target.dataset.view.split(",").map(Number)); });
  by("picture").addEventListener("click", () => composed().toBlob(blob => save(blob, "shapes.png")));
  by("film").addEventListener("click", film);
  await first();
  state.ready = true;
  requestAnimationFrame(step);
}
