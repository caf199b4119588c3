// The point of the path nearest to a place of the canvas (CSS pixels), within `near` of it; of
// points that lie above each other the one nearest to the eye. -1: none.
function pickedPoint(path, view, canvas, x, y, near, links) {
  let best = -1, least = near, depth = Infinity;
  for (let i = 0; i < path.count; ++i) {
    if (!links && path.has(i, FLAG.link)) continue;
    const p = moved(view, path.tip(i));
    const d = Math.hypot(0.5 * (p[0] + 1) * canvas.clientWidth - x, 0.5 * (1 - p[1]) * canvas.clientHeight - y);
    if (d > near) continue;
    if (d < least - 1.5 || (d < least + 1.5 && p[2] < depth)) {
      best = i;
      least = Math.min(d, least);
      depth = p[2];
    }
  }
  return best;
}

function textOf(rows, line) {
  let low = 0, high = rows.length - 1;
  while (low <= high) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] === line) return rows[middle][1];
    if (rows[middle][0] < line) low = middle + 1;
    else high = middle - 1;
  }
  return '';
}

const figure = (v, digits) => (Number.isFinite(v) ? v.toFixed(digits) : '-');

// What the panel says of a place: rows of [name, text, source?].
function wordsOf(scene, path, state) {
  const i = state.index, tool = toolAt(scene, state.joints, path.lengthAt(i));
  const rows = [['Time', figure(state.time, 3) + ' s']];
  const line = (name, number, texts) => {
    rows.push([name, number > 0 ? String(number) : 'none: a link of the output']);
    const text = textOf(texts, number);
    if (text) rows.push([null, text]);
  };
  line('Input line', path.inputLine[i], scene.texts.input);
  line('Output line', path.outputLine[i], scene.texts.output);
  scene.axes.forEach((axis, j) => rows.push([axis.name, `${figure(state.joints[j], 4)} ${axis.unit}`]));
  rows.push(['Tip', tool.tip.map((v) => figure(v, 3)).join('  ')]);
  rows.push(['Tool axis', tool.axis.map((v) => figure(v, 5)).join('  ')]);
  if (path.has(i, FLAG.compared)) rows.push(['Off the input', figure(path.off(i), 5) + ' mm']);
  rows.push(['Tip speed', figure(60 * path.speed(i), 0) + ' mm/min']);
  rows.push(['', path.has(i, FLAG.link) ? 'link' : path.has(i, FLAG.beam) ? 'beam on' : 'cut']);
  return rows;
}
