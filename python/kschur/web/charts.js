// A diagram on a canvas: axes, lines of points that one hovers over and picks, marks, guides. The wheel zooms, dragging shifts, a
// double click shows all again. A line is {x, y, colour, dash, radius, hidden, red: k => whether, tip: k => text}, numbers null where there
// is nothing; a mark {x, y, form, colour, text, hidden}; a guide {x: [from, to], y: [from, to], text}.
class Chart {
  constructor(canvas, axes, lines, {marks = [], guides = [], redFrom = null, pick = null} = {}) {
    Object.assign(this, {canvas, axes, lines, marks, guides, redFrom, pick, near: null, picked: null});
    this.showAll();
    canvas.addEventListener("wheel", event => { event.preventDefault(); this.zoom(Math.exp(0.0012 * event.deltaY), event); }, {passive: false});
    canvas.addEventListener("dblclick", () => { this.showAll(); this.draw(); });
    canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); this.dragged = 0; });
    canvas.addEventListener("pointermove", event => this.move(event));
    canvas.addEventListener("pointerleave", () => this.hover(null));
    canvas.addEventListener("click", () => { if (this.near && this.pick && this.dragged < 4) this.pick(this.near.line, this.near.k); });
    new ResizeObserver(() => this.draw()).observe(canvas);
    this.draw();
  }

  // Limits about all lines that are shown, in the units of the axis: logarithms where it is one of them.
  showAll() {
    for (const name of ["x", "y"]) {
      const axis = this.axes[name], numbers = this.lines.filter(line => !line.hidden).flatMap(line => line[name]).map(value => this.on(axis, value)).filter(Number.isFinite);
      let low = axis.from ?? numbers.reduce((p, q) => Math.min(p, q), Infinity), high = axis.to ?? numbers.reduce((p, q) => Math.max(p, q), -Infinity);
      if (!(low <= high)) [low, high] = [0, 1];
      if (axis.log) low = Math.max(low, high - 12);  // below is what is zero but for rounding
      const room = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
      Object.assign(axis, {low: axis.from ?? low - room, high: axis.to ?? high + room});
    }
  }

  on(axis, value) { return value === null || value === undefined ? NaN : axis.log ? Math.log10(value) : value; }

  room() {
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    return {left: 80, top: 10, right: width - 14, bottom: height - 40, width, height};
  }

  at(x, y) {
    const r = this.room(), along = (axis, value) => (this.on(axis, value) - axis.low) / (axis.high - axis.low);
    return [r.left + along(this.axes.x, x) * (r.right - r.left), r.bottom - along(this.axes.y, y) * (r.bottom - r.top)];
  }

  zoom(factor, event) {
    const r = this.room(), places = {x: (event.offsetX - r.left) / (r.right - r.left), y: (r.bottom - event.offsetY) / (r.bottom - r.top)};
    for (const name of ["x", "y"]) {
      const axis = this.axes[name], middle = axis.low + places[name] * (axis.high - axis.low);
      Object.assign(axis, {low: middle + factor * (axis.low - middle), high: middle + factor * (axis.high - middle)});
    }
    this.draw();
  }

  move(event) {
    if (!event.buttons) return this.hover(event);
    const r = this.room(), steps = {x: -event.movementX / (r.right - r.left), y: event.movementY / (r.bottom - r.top)};
    this.dragged += Math.abs(event.movementX) + Math.abs(event.movementY);
    for (const name of ["x", "y"]) {
      const axis = this.axes[name], step = steps[name] * (axis.high - axis.low);
      Object.assign(axis, {low: axis.low + step, high: axis.high + step});
    }
    this.draw();
  }

  // The nearest point within a finger's width, and what there is to say about it.
  hover(event) {
    this.near = null;
    let best = 22;
    for (const line of event ? this.lines : []) {
      if (line.hidden) continue;
      line.x.forEach((x, k) => {
        const [u, v] = this.at(x, line.y[k]), far = Math.hypot(u - event.offsetX, v - event.offsetY);
        if (far < best) [best, this.near] = [far, {line, k}];
      });
    }
    const tip = by("tip");
    tip.style.display = this.near ? "" : "none";
    this.canvas.style.cursor = this.near && this.pick ? "pointer" : "default";
    if (this.near) {
      tip.textContent = this.near.line.tip(this.near.k);
      tip.style.left = `${Math.min(event.clientX + 14, window.innerWidth - tip.offsetWidth - 6)}px`;
      tip.style.top = `${Math.min(event.clientY + 14, window.innerHeight - tip.offsetHeight - 6)}px`;
    }
    this.draw();
  }

  draw() {
    const pen = penOf(this.canvas), r = this.room();
    pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
    pen.clearRect(0, 0, r.width, r.height);
    this.drawAxes(pen, r);
    pen.save();
    pen.beginPath();
    pen.rect(r.left, r.top, r.right - r.left, r.bottom - r.top);
    pen.clip();
    if (this.redFrom !== null) {
      pen.fillStyle = "rgba(179, 38, 30, 0.08)";
      const from = Math.max(this.at(this.redFrom, null)[0], r.left);
      pen.fillRect(from, r.top, Math.max(r.right - from, 0), r.bottom - r.top);
    }
    this.guides.forEach(guide => this.drawGuide(pen, guide, r));
    this.lines.forEach(line => { if (!line.hidden) this.drawLine(pen, line); });
    this.marks.forEach(mark => { if (!mark.hidden?.()) drawMark(pen, ...this.at(mark.x, mark.y), mark); });
    for (const [point, width] of [[this.picked, 2.5], [this.near, 1.2]]) {
      if (!point || point.line.hidden) continue;
      pen.lineWidth = width;
      pen.strokeStyle = "#1d2733";
      pen.beginPath();
      pen.arc(...this.at(point.line.x[point.k], point.line.y[point.k]), 8, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.restore();
  }

  drawAxes(pen, r) {
    pen.lineWidth = 1;
    for (const name of ["x", "y"]) {
      const axis = this.axes[name];
      pen.textAlign = name === "x" ? "center" : "right";
      pen.textBaseline = name === "x" ? "top" : "middle";
      for (const {place, text} of ticks(axis, name === "x" ? (r.right - r.left) / 90 : (r.bottom - r.top) / 34)) {
        const along = (place - axis.low) / (axis.high - axis.low), u = r.left + along * (r.right - r.left), v = r.bottom - along * (r.bottom - r.top);
        pen.strokeStyle = "#e9eef3";
        pen.beginPath();
        if (name === "x") { pen.moveTo(u, r.top); pen.lineTo(u, r.bottom); } else { pen.moveTo(r.left, v); pen.lineTo(r.right, v); }
        pen.stroke();
        pen.fillStyle = "#1d2733";
        if (name === "x") pen.fillText(text, u, r.bottom + 6); else pen.fillText(text, r.left - 6, v);
      }
    }
    pen.strokeStyle = "#66727f";
    pen.strokeRect(r.left + 0.5, r.top + 0.5, r.right - r.left - 1, r.bottom - r.top - 1);
    pen.textAlign = "center";
    pen.fillText(this.axes.x.label, (r.left + r.right) / 2, r.bottom + 23);
    pen.save();
    pen.translate(12, (r.top + r.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(this.axes.y.label, 0, 0);
    pen.restore();
  }

  drawGuide(pen, guide, r) {
    const [first, last] = [this.at(guide.x[0], guide.y[0]), this.at(guide.x[1], guide.y[1])];
    pen.strokeStyle = pen.fillStyle = "#8a939d";
    pen.lineWidth = 1;
    pen.setLineDash([5, 4]);
    pen.beginPath();
    pen.moveTo(...first);
    pen.lineTo(...last);
    pen.stroke();
    pen.setLineDash([]);
    // Its name where it leaves the frame.
    const inside = Math.min(1, ...[0, 1].map(k => last[k] === first[k] ? 1 : ((last[k] > first[k] ? [r.right, r.bottom] : [r.left, r.top])[k] - first[k]) / (last[k] - first[k])));
    pen.textAlign = "right";
    pen.textBaseline = "bottom";
    pen.fillText(guide.text, first[0] + inside * (last[0] - first[0]) - 4, Math.max(first[1] + inside * (last[1] - first[1]), r.top + 14));
  }

  drawLine(pen, line) {
    const places = line.x.map((x, k) => this.at(x, line.y[k]));
    pen.strokeStyle = line.colour;
    pen.lineWidth = 1.5;
    pen.setLineDash(line.dash);
    pen.beginPath();
    let down = false;
    for (const [u, v] of places) {
      const there = Number.isFinite(u) && Number.isFinite(v);
      if (there) pen[down ? "lineTo" : "moveTo"](u, v);
      down = there;
    }
    pen.stroke();
    pen.setLineDash([]);
    places.forEach(([u, v], k) => {
      if (!Number.isFinite(u) || !Number.isFinite(v)) return;
      pen.strokeStyle = pen.fillStyle = line.red(k) ? "#d11507" : line.colour;
      pen.beginPath();
      pen.arc(u, v, line.radius, 0, 2 * Math.PI);
      if (line.open) pen.stroke(); else pen.fill();
    });
  }
}

function penOf(canvas) {
  const ratio = window.devicePixelRatio, width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return pen;
}

function drawMark(pen, u, v, mark) {
  const corners = {square: [[-6, -6], [6, -6], [6, 6], [-6, 6]], diamond: [[0, -8], [8, 0], [0, 8], [-8, 0]], triangle: [[0, -7], [7, 5], [-7, 5]], circle: null}[mark.form];
  pen.strokeStyle = pen.fillStyle = mark.colour;
  pen.lineWidth = 1.5;
  pen.beginPath();
  if (corners) corners.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](u + x, v + y)); else pen.arc(u, v, 5, 0, 2 * Math.PI);
  pen.closePath();
  if (mark.form === "triangle") pen.fill(); else pen.stroke();
  pen.textAlign = "center";
  pen.textBaseline = "bottom";
  if (mark.text) pen.fillText(mark.text, u, v - 9);
}

// About so many round numbers within the limits of an axis; whole decades where it is one of logarithms and has any.
function ticks(axis, most) {
  const span = axis.high - axis.low, raw = span / Math.max(most, 2), decade = 10 ** Math.floor(Math.log10(raw));
  let step = axis.step ?? [1, 2, 5, 10].map(k => k * decade).find(s => s >= raw * 0.999);
  if (axis.log) step = Math.max(1, Math.ceil(raw));
  const found = [], decades = axis.log && span >= 1.5 ? step : null;
  if (axis.log && decades === null) {
    for (let d = Math.floor(axis.low); d <= axis.high; ++d)
      for (const k of [1, 2, 3, 5, 7]) found.push({place: d + Math.log10(k), text: shown(k * 10 ** d, 3)});
    return found.filter(tick => tick.place >= axis.low && tick.place <= axis.high);
  }
  for (let k = Math.ceil(axis.low / step); k * step <= axis.high; ++k)
    found.push({place: k * step, text: axis.log ? shown(10 ** (k * step), 3) : shown(Number((k * step).toPrecision(10)), 6)});
  return found;
}

// The colours and dashes of lines; eight colours, then the next dash.
const COLOURS = ["#1f77b4", "#e07b00", "#2a8f2a", "#7e57c2", "#8c564b", "#d052a5", "#8f8f1a", "#0f9fb5"];
const lineStyle = k => ({colour: COLOURS[k % COLOURS.length], dash: [[], [7, 4], [2, 3], [7, 3, 2, 3]][Math.floor(k / COLOURS.length) % 4]});

// A list of lines, a click on one of which hides or shows it in all diagrams.
function fillLegend(host, entries, charts) {
  entries.forEach(({text, title, lines}) => {
    const row = document.createElement("button"), key = document.createElement("canvas"), line = lines[0];
    row.title = title;
    Object.assign(key, {width: 30, height: 12});
    const pen = key.getContext("2d");
    Object.assign(pen, {strokeStyle: line.colour, fillStyle: line.colour, lineWidth: 2});
    pen.setLineDash(line.dash);
    pen.beginPath(); pen.moveTo(0, 6); pen.lineTo(30, 6); pen.stroke();
    pen.setLineDash([]);
    pen.beginPath(); pen.arc(15, 6, Math.min(line.radius, 5.5), 0, 2 * Math.PI);
    if (line.open) pen.stroke(); else pen.fill();
    row.append(key, text);
    row.addEventListener("click", () => {
      lines.forEach(one => { one.hidden = !one.hidden; });
      row.classList.toggle("off", lines[0].hidden);
      charts.forEach(chart => chart.draw());
    });
    host.append(row);
  });
}
