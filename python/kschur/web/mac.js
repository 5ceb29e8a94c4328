// The MAC matrix, white where shapes have nothing in common, dark where they are the same.
function drawMac(canvas, words) {
  const count = facts.mac.length, cell = Math.max(4, Math.min(24, Math.floor(390 / count)));
  canvas.width = canvas.height = count * cell;
  const pen = canvas.getContext("2d");
  facts.mac.forEach((row, i) => row.forEach((value, j) => {
    pen.fillStyle = `hsl(210, 60%, ${100 - 70 * value}%)`;
    pen.fillRect(j * cell, i * cell, cell, cell);
  }));
  pen.strokeStyle = "#d5dae0";
  pen.strokeRect(0.5, 0.5, canvas.width - 1, canvas.height - 1);
  canvas.addEventListener("pointermove", event => {
    const at = place => Math.max(0, Math.min(count - 1, Math.floor(place / cell))), i = at(event.offsetY), j = at(event.offsetX);
    words.textContent = `modes ${facts.modes[i].number} and ${facts.modes[j].number}: ${facts.mac[i][j].toFixed(3)}`;
  });
}
