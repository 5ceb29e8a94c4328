// What is written over a pane: what is seen, the axes, a scale and the key of the colours.
function drawOverlay(pen, pane, seen, camera, pixel, colour) {
  pen.save();
  pen.translate(pane.x, pane.y);
  pen.strokeStyle = "#d5dae0";
  pen.strokeRect(0.5, 0.5, pane.width - 1, pane.height - 1);
  pen.fillStyle = "#1d2733";
  pen.textBaseline = "middle";
  pen.font = "600 14px system-ui, 'DejaVu Sans', sans-serif";
  pen.fillText(seen.title, 12, 20);
  pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  pen.fillText(seen.words, 12, 38);
  drawTriad(pen, camera, 46, pane.height - 46);
  drawScale(pen, pixel, pane.width / 2, pane.height - 18, pane.width / 3);
  drawKey(pen, pane.width - 34, pane.height - 128, colour);
  pen.restore();
}

function drawTriad(pen, camera, x, y) {
  const [right, up, back] = camera.axes();
  const axes = ["x", "y", "z"].map((name, k) => ({name, u: right.getComponent(k), v: up.getComponent(k), w: back.getComponent(k), colour: ["#c0392b", "#1e8449", "#1f5fbf"][k]}));
  pen.lineWidth = 2;
  for (const axis of axes.sort((p, q) => p.w - q.w)) {
    pen.strokeStyle = pen.fillStyle = axis.colour;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + 26 * axis.u, y - 26 * axis.v);
    pen.stroke();
    if (Math.hypot(axis.u, axis.v) > 0.1) pen.fillText(axis.name, x + 36 * axis.u - 3, y - 36 * axis.v);
  }
  pen.lineWidth = 1;
}

// A round length in the units of the coordinates.
function drawScale(pen, pixel, x, y, most) {
  const decade = 10 ** Math.floor(Math.log10(most * pixel)), length = [5, 2, 1].map(k => k * decade).find(l => l <= most * pixel), half = length / pixel / 2;
  pen.strokeStyle = pen.fillStyle = "#1d2733";
  pen.beginPath();
  pen.moveTo(x - half, y - 4); pen.lineTo(x - half, y + 4); pen.moveTo(x - half, y); pen.lineTo(x + half, y); pen.moveTo(x + half, y - 4); pen.lineTo(x + half, y + 4);
  pen.stroke();
  pen.textAlign = "center";
  pen.fillText(shown(length, 3), x, y - 11);
  pen.textAlign = "left";
}

function drawKey(pen, x, y, colour) {
  const signed = colour > 1 && colour < 5, stops = signed ? STOPS.diverging : STOPS.sequential, gradient = pen.createLinearGradient(0, y + 100, 0, y);
  stops.forEach((stop, k) => gradient.addColorStop(k / (stops.length - 1), stop));
  pen.fillStyle = gradient;
  pen.fillRect(x, y, 12, 100);
  pen.fillStyle = "#1d2733";
  pen.textAlign = "right";
  if (colour > 4) pen.fillText("energy", x + 12, y - 12);
  pen.fillText("1", x - 4, y + 5);
  pen.fillText(signed ? "−1" : "0", x - 4, y + 96);
  pen.textAlign = "left";
}
