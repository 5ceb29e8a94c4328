// What the page holds: facts as JSON, numbers as compressed bytes.
const by = id => document.getElementById(id);
const facts = JSON.parse(document.getElementById("facts").textContent);

async function unpackedBytes(id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), letter => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Whole numbers from their differences, which stand byte after byte of all of them.
async function wholeNumbers(id, Kind) {
  const bytes = await unpackedBytes(id), size = Kind.BYTES_PER_ELEMENT, numbers = new Kind(bytes.length / size);
  for (let i = 0, value = 0; i < numbers.length; ++i) {
    let step = 0;
    for (let b = 0; b < size; ++b) step |= bytes[b * numbers.length + i] << (8 * b);
    value = (value + step) | 0;
    numbers[i] = value;
  }
  return numbers;
}

async function floatingNumbers(id) {
  const bytes = await unpackedBytes(id), count = bytes.length / 4, turned = new Uint8Array(bytes.length);
  for (let i = 0; i < count; ++i) for (let b = 0; b < 4; ++b) turned[4 * i + b] = bytes[b * count + i];
  return new Float32Array(turned.buffer);
}

// Displacements of the nodes, x y z of each, of which 32767 is the largest; null where a shape has no such part.
async function displacements(id) {
  if (!document.getElementById(id)) return null;
  const rows = await wholeNumbers(id, Int16Array), nodes = rows.length / 3, moved = new Int16Array(rows.length);
  for (let i = 0; i < nodes; ++i) for (let c = 0; c < 3; ++c) moved[3 * i + c] = Math.round(rows[c * nodes + i] * 32767 / facts.steps);
  return moved;
}

// Strain energies of the nodes, of which 32767 is the largest; null where there are none.
async function energies(id) {
  return document.getElementById(id) ? (await wholeNumbers(id, Int16Array)).map(value => Math.round(value * 32767 / facts.steps)) : null;
}

// A number for people.
function shown(value, digits = 5) {
  if (value === null || value === undefined) return "–";
  return value !== 0 && (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e6) ? value.toExponential(2) : String(Number(value.toPrecision(digits)));
}
