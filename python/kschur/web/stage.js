// The stage: shapes side by side, in motion, with what governs them. A shape is seen under a title and words below it.
// It is drawn again where something has changed.
const models = new Map();
const state = {seen: [], shapes: [], playing: true, phase: 0, frames: 0, ready: false, slow: false, still: false};
let renderer, camera, software, pixel = 1;
// More edges than this hide what they bound, some pixels apart, and cost most of a frame: they are drawn where they are asked for.
const DENSE = 100000;
// More edges than this are left out of slow motion.
const FEW = 5000;
// Milliseconds: pictures that come more slowly are slow; what has not changed for so long is at rest.
const SLOW = 50, REST = 250;

function modelAt(place) {
  if (!models.has(place)) models.set(place, new Model().load(place));
  return models.get(place);
}

// Shapes by number, each on its model.
async function see(seen) {
  state.seen = seen;
  const shapes = await Promise.all(seen.map(async one => (await modelAt(one.model || 0)).shape(one.shape)));
  if (state.seen === seen) state.shapes = shapes;
}

function listParts(model) {
  const parts = [...new Set(model.parts)].sort((p, q) => p - q);
  const tied = model.ties.length + model.marks.length > 0;
  by("parts").style.display = parts.length > 1 || tied ? "" : "none";
  for (const part of tied ? [...parts, "constraints"] : parts) {
    const label = document.createElement("label"), box = document.createElement("input");
    Object.assign(box, {type: "checkbox", checked: true});
    box.addEventListener("change", async () => {
      hidden[box.checked ? "delete" : "add"](part);
      for (const one of models.values()) (await one).show();
      see([...state.seen]);
    });
    label.append(box, part === "constraints" ? part : `part ${part + 1}`);
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

// What a picture depends on but for the phase.
const asked = () => [by("stage").clientWidth, by("stage").clientHeight, window.devicePixelRatio, camera.azimuth, camera.elevation, camera.zoom, ...camera.shift,
  by("colour").value, by("amplitude").value, by("rest").checked, by("edges").checked].join();

function resize(canvas, width, height, set) {
  if (canvas.width !== Math.floor(width) || canvas.height !== Math.floor(height)) set();
}

// A picture, in full or of coarse surfaces; what is written over it, where that may have changed.
function draw(full, written) {
  const width = by("stage").clientWidth, height = by("stage").clientHeight, ratio = window.devicePixelRatio, over = by("overlay"), pen = over.getContext("2d");
  // Software draws each point several times to smooth edges: at rest alone, in a larger picture that is made smaller.
  const fine = software && full ? 2 * ratio : ratio;
  resize(by("space"), width * fine, height * fine, () => { renderer.setPixelRatio(fine); renderer.setSize(width, height, false); });
  resize(over, width * ratio, height * ratio, () => Object.assign(over, {width: Math.floor(width * ratio), height: Math.floor(height * ratio)}));
  if (written) {
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
  }
  const colour = Number(by("colour").value), amplitude = Number(by("amplitude").value);
  Object.assign(uniforms.c, {value: Math.cos(state.phase)});
  Object.assign(uniforms.s, {value: Math.sin(state.phase)});
  Object.assign(uniforms.a, {value: amplitude * camera.size});
  uniforms.colour.value = colour;
  uniforms.dots.value = fine;
  uniforms.palette.value = palettes[colour > 1 && colour < 5 ? 1 : 0];
  renderer.setScissorTest(false);
  renderer.clear();
  renderer.setScissorTest(true);
  const show = (pieces, shown) => pieces.forEach(piece => { if (piece) piece.visible = shown(piece); });
  panes(state.shapes.length, width, height).forEach((pane, k) => {
    const shape = state.shapes[k], coarse = !full && shape.coarse[0], light = piece => full || piece.geometry.index.count <= 2 * FEW;
    pixel = camera.place(pane.width, pane.height, amplitude);
    uniforms.pane.value.set(pane.width, pane.height);
    show(shape.fine, () => !coarse);
    show(shape.coarse, () => coarse);
    show(shape.rest, piece => by("rest").checked && light(piece));
    show(shape.edges, piece => by("edges").checked && light(piece));
    renderer.setViewport(pane.x, height - pane.y - pane.height, pane.width, pane.height);
    renderer.setScissor(pane.x, height - pane.y - pane.height, pane.width, pane.height);
    renderer.render(shape.scene, camera.lens);
    if (written) drawOverlay(pen, pane, state.seen[k], camera, pixel, colour);
  });
}

const before = {at: null, shapes: null, view: "", phase: null, changed: 0, slow: 0};

// Motion is drawn in full unless several pictures one after the other were slow; what is at rest always is.
function redraw(now, passed) {
  const view = asked(), written = view !== before.view || state.shapes !== before.shapes;
  if (written || state.phase !== before.phase) {
    before.slow = passed > SLOW && before.changed === now - passed && state.shapes === before.shapes ? before.slow + 1 : 0;
    state.slow ||= before.slow > 4;
    state.still = false;
    draw(!software && !state.slow, written);
    Object.assign(before, {view, shapes: state.shapes, phase: state.phase, changed: now});
  } else if (!state.still && now - before.changed > REST) {
    draw(true, false);
    state.still = true;
  }
}

function step(now) {
  const passed = before.at === null ? 0 : now - before.at;
  before.at = now;
  if (state.playing) {
    state.phase = (state.phase + 2 * Math.PI * Number(by("speed").value) * passed / 1000) % (2 * Math.PI);
    by("phase").value = state.phase * 180 / Math.PI;
  }
  if (state.shapes.length === state.seen.length) redraw(now, passed);
  state.composed?.();
  ++state.frames;
  requestAnimationFrame(step);
}

// Whether there is no graphics hardware, or the browser does not use it.
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl"), names = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl ? gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name);
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
  const model = await modelAt(0);
  software = drawnBySoftware();
  renderer = new THREE.WebGLRenderer({canvas: by("space"), antialias: !software, preserveDrawingBuffer: true});
  renderer.autoClear = false;
  renderer.setClearColor(0xffffff, 1);
  camera = new Camera(new THREE.Box3(...facts.box.map(corner => new THREE.Vector3(...corner))));
  camera.follow(by("overlay"), () => pixel);
  listParts(model);
  if (document.querySelector("[id$=-energy]")) by("colour").add(new Option("strain energy", 5));
  if (model.edges.length / 2 > DENSE) for (const name of ["edges", "rest"]) by(name).checked = false;
  by("play").addEventListener("click", () => { state.playing = !state.playing; state.slow = false; by("play").textContent = state.playing ? "Pause" : "Play"; });
  by("phase").addEventListener("input", () => { state.playing = false; by("play").textContent = "Play"; state.phase = by("phase").value * Math.PI / 180; });
  by("views").addEventListener("click", event => { if (event.target.dataset.view) camera.look(...event.target.dataset.view.split(",").map(Number)); });
  by("picture").addEventListener("click", () => { draw(true, false); state.still = !state.playing; composed().toBlob(blob => save(blob, "shapes.png")); });
  by("film").addEventListener("click", film);
  await first();
  state.ready = true;
  requestAnimationFrame(step);
}
