// The model in space. Each node is at x + a Re(phi e^{i w t}), which the vertex shader computes of the two parts of phi.
const MOTION = `
  uniform float c, s, a, colour, dots;
  vec3 moved(vec3 re, vec3 im) { return c * re - s * im; }
  float valueOf(vec3 re, vec3 im, float energy) {
    if (colour > 4.5) return energy;
    vec3 u = moved(re, im);
    if (colour < 0.5) return sqrt(dot(re, re) + dot(im, im));
    if (colour < 1.5) return length(u);
    return 0.5 + 0.5 * (colour < 2.5 ? u.x : colour < 3.5 ? u.y : u.z);
  }`;
const SURFACE = {
  vertexShader: `attribute vec3 re, im; attribute float energy; varying float value; varying vec3 seen; ${MOTION}
  void main() {
    vec4 place = modelViewMatrix * vec4(position + a * moved(re, im), 1.0);
    value = valueOf(re, im, energy); seen = place.xyz;
    gl_Position = projectionMatrix * place; gl_PointSize = 9.0 * dots;
  }`,
  fragmentShader: `varying float value; varying vec3 seen; uniform sampler2D palette; uniform vec4 plain; uniform bool flat_;
  void main() {
    if (plain.a > 0.0) { gl_FragColor = plain; return; }
    float light = flat_ ? 1.0 : 0.55 + 0.45 * abs(normalize(cross(dFdx(seen), dFdy(seen))).z);
    gl_FragColor = vec4(light * texture2D(palette, vec2(clamp(value, 0.002, 0.998), 0.5)).rgb, 1.0);
  }`};
// Lines as rectangles of a width in pixels.
const LINE = {
  vertexShader: `attribute vec3 from, to, fromRe, fromIm, toRe, toIm; attribute float fromEnergy, toEnergy; varying float value; varying vec3 seen; uniform vec2 pane; ${MOTION}
  void main() {
    vec4 first = projectionMatrix * modelViewMatrix * vec4(from + a * moved(fromRe, fromIm), 1.0);
    vec4 last = projectionMatrix * modelViewMatrix * vec4(to + a * moved(toRe, toIm), 1.0);
    vec2 along = (last.xy - first.xy) * pane;
    along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
    value = mix(valueOf(fromRe, fromIm, fromEnergy), valueOf(toRe, toIm, toEnergy), position.x); seen = vec3(0.0);
    gl_Position = mix(first, last, position.x);
    gl_Position.xy += 3.6 * position.y * vec2(-along.y, along.x) / pane;
  }`,
  fragmentShader: SURFACE.fragmentShader};

const STOPS = {sequential: ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"],
               diverging: ["#2166ac", "#67a9cf", "#b8c4cc", "#ef8a62", "#b2182b"]};

function colourAt(stops, value) {
  const place = value * (stops.length - 1), k = Math.min(Math.floor(place), stops.length - 2);
  return new THREE.Color(stops[k]).lerp(new THREE.Color(stops[k + 1]), place - k);
}

function paletteOf(stops) {
  const bytes = new Uint8Array(1024);
  for (let i = 0; i < 256; ++i) bytes.set([...colourAt(stops, i / 255).toArray().map(part => 255 * part), 255], 4 * i);
  const texture = new THREE.DataTexture(bytes, 256, 1, THREE.RGBAFormat);
  texture.magFilter = texture.minFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

// What all models have in common: the state of the shaders, and which parts are hidden.
const palettes = [paletteOf(STOPS.sequential), paletteOf(STOPS.diverging)];
const uniforms = {c: {value: 1}, s: {value: 0}, a: {value: 0}, colour: {value: 0}, dots: {value: 1}, palette: {value: palettes[0]}, pane: {value: new THREE.Vector2(1, 1)}};
const hidden = new Set();

class Model {
  async load(place) {
    this.coordinates = await floatingNumbers(`model-${place}-coordinates`);
    for (const name of ["triangles", "coarse", "edges", "lines", "points"]) this[name] = await wholeNumbers(`model-${place}-${name}`, Int32Array);
    for (const name of ["ties", "marks"])
      this[name] = document.getElementById(`model-${place}-${name}`) ? await wholeNumbers(`model-${place}-${name}`, Int32Array) : new Int32Array();
    this.parts = await wholeNumbers(`model-${place}-parts`, Int16Array);
    this.position = new THREE.BufferAttribute(this.coordinates, 3);
    this.zero = new THREE.BufferAttribute(new Int16Array(this.coordinates.length), 3, true);
    this.shapes = new Map();
    this.show();
    return this;
  }

  // The indices of what is not hidden, one for all shapes.
  show() {
    const seen = (rows, corners) => {
      if (!hidden.size) return new Uint32Array(rows);
      const kept = [];
      for (let i = 0; i < rows.length; i += corners)
        if (!hidden.has(this.parts[rows[i]])) for (let k = 0; k < corners; ++k) kept.push(rows[i + k]);
      return new Uint32Array(kept);
    };
    this.index = {};
    for (const [name, corners] of [["triangles", 3], ["coarse", 3], ["edges", 2], ["lines", 2], ["points", 1], ["ties", 2], ["marks", 1]]) this.index[name] = seen(this[name], corners);
    if (hidden.has("constraints")) this.index.ties = this.index.marks = new Uint32Array();
    for (const shape of this.shapes.values()) shape.pieces.forEach(piece => piece.geometry.dispose());
    this.shapes.clear();
  }

  material(kind, plain, flat, more) {
    const own = {plain: {value: new THREE.Vector4(...plain)}, flat_: {value: flat}};
    return new THREE.ShaderMaterial({...kind, uniforms: {...uniforms, ...own}, side: THREE.DoubleSide, extensions: {derivatives: true}, ...more});
  }

  // The scene of a shape; the same again the next time.
  async shape(number) {
    if (this.shapes.has(number)) return this.shapes.get(number);
    const re = await displacements(`mode-${number}-re`), im = await displacements(`mode-${number}-im`);
    const parts = [new THREE.BufferAttribute(re, 3, true), im ? new THREE.BufferAttribute(im, 3, true) : this.zero];
    const energy = await energies(`mode-${number}-energy`);
    const scene = new THREE.Scene(), still = {...uniforms, a: {value: 0}};
    const add = (Kind, name, attributes, material) => {
      if (!this.index[name].length) return null;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", this.position);
      geometry.setAttribute("re", attributes[0]);
      geometry.setAttribute("im", attributes[1]);
      if (energy) geometry.setAttribute("energy", new THREE.BufferAttribute(energy, 1, true));
      geometry.setIndex(new THREE.BufferAttribute(this.index[name], 1));
      return this.keep(scene, new Kind(geometry, material));
    };
    const gray = {transparent: true, uniforms: {...still, plain: {value: new THREE.Vector4(0.45, 0.5, 0.56, 0.45)}, flat_: {value: true}}};
    const shape = {scene, rest: [], edges: [], fine: [], coarse: []}, surface = {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1};
    for (const name of ["edges", "lines"]) shape.rest.push(add(THREE.LineSegments, name, [this.zero, this.zero], this.material(SURFACE, [0, 0, 0, 0], true, gray)));
    for (const [name, kept] of [["triangles", shape.fine], ["coarse", shape.coarse]]) kept.push(add(THREE.Mesh, name, parts, this.material(SURFACE, [0, 0, 0, 0], false, surface)));
    shape.edges.push(add(THREE.LineSegments, "edges", parts, this.material(SURFACE, [0.05, 0.08, 0.12, 0.3], true, {transparent: true})));
    add(THREE.Points, "points", parts, this.material(SURFACE, [0, 0, 0, 0], true, {}));
    for (const [Kind, name] of [[THREE.LineSegments, "ties"], [THREE.Points, "marks"]]) add(Kind, name, parts, this.material(SURFACE, [0.75, 0.1, 0.55, 1], true, {}));
    if (this.index.lines.length) this.keep(scene, this.thickLines(parts[0].array, parts[1].array, energy));
    shape.pieces = scene.children;
    this.shapes.set(number, shape);
    return shape;
  }

  keep(scene, piece) {
    piece.frustumCulled = false;
    scene.add(piece);
    return piece;
  }

  thickLines(re, im, energy) {
    const geometry = new THREE.InstancedBufferGeometry(), lines = this.index.lines;
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]), 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const give = (name, values, end, Kind, normalised) => {
      const part = new Kind(3 * lines.length / 2);
      for (let i = 0; i < lines.length / 2; ++i) for (let c = 0; c < 3; ++c) part[3 * i + c] = values[3 * lines[2 * i + end] + c];
      geometry.setAttribute(name, new THREE.InstancedBufferAttribute(part, 3, normalised));
    };
    ["from", "to"].forEach((name, end) => {
      give(name, this.coordinates, end, Float32Array, false);
      give(`${name}Re`, re, end, Int16Array, true);
      give(`${name}Im`, im, end, Int16Array, true);
      if (energy) {
        const part = Int16Array.from({length: lines.length / 2}, (_, i) => energy[lines[2 * i + end]]);
        geometry.setAttribute(`${name}Energy`, new THREE.InstancedBufferAttribute(part, 1, true));
      }
    });
    geometry.maxInstancedCount = lines.length / 2;
    return new THREE.Mesh(geometry, this.material(LINE, [0, 0, 0, 0], true, {}));
  }
}
