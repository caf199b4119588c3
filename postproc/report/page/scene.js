// The data of the page as typed arrays, and what is drawn of them.
function decoded(Type, text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return new Type(bytes.buffer);
}

const FLAG = {beam: 1, link: 2, lineEnd: 4, compared: 8};
const INK = {input: [208, 138, 29], program: [31, 78, 156], link: [150, 158, 170], axis: [42, 138, 74], wrist: [122, 59, 156]};

function ramp(share) {
  const stops = [[44, 111, 187], [57, 169, 107], [230, 185, 60], [194, 48, 45]];
  const at = Math.min(2.9999, Math.max(0, 3 * share)), k = Math.floor(at), t = at - k;
  return [0, 1, 2].map((i) => Math.round(stops[k][i] + t * (stops[k + 1][i] - stops[k][i])));
}

// Columns of the certified path with what follows from the joints.
function pathOf(scene) {
  const p = scene.points;
  const path = {
    time: decoded(Float64Array, p.time),
    outputLine: decoded(Uint32Array, p.output_line),
    inputLine: decoded(Uint32Array, p.input_line),
    deviation: decoded(Float32Array, p.deviation),
    flags: decoded(Uint8Array, p.flags),
    joints: p.joints.map((column) => decoded(Int32Array, column)),
  };
  path.count = path.time.length;
  path.jointsAt = (i) => scene.axes.map((axis, j) => path.joints[j][i] * axis.scale);
  path.lengthAt = (i) => {
    let length = 0;
    for (const [from, mm] of scene.tool_lengths) if (from <= i) length = mm;
    return length;
  };
  path.tips = new Float64Array(3 * path.count);
  path.axes = new Float32Array(3 * path.count);
  path.wrists = scene.wrist ? new Float32Array(3 * path.count) : null;
  for (let i = 0, run = 0; i < path.count; ++i) {
    while (run + 1 < scene.tool_lengths.length && scene.tool_lengths[run + 1][0] <= i) ++run;
    const tool = toolAt(scene, path.jointsAt(i), scene.tool_lengths[run][1]);
    path.tips.set(sum(tool.tip, scene.centre, -1), 3 * i);
    path.axes.set(tool.axis, 3 * i);
    if (path.wrists) path.wrists.set(sum(tool.wrist, scene.centre, -1), 3 * i);
  }
  path.tip = (i) => [path.tips[3 * i], path.tips[3 * i + 1], path.tips[3 * i + 2]];
  path.has = (i, flag) => (path.flags[i] & flag) !== 0;
  // mm/s over the way to point i; NaN: no time passes.
  path.speed = (i) => {
    if (i === 0 || !(path.time[i] > path.time[i - 1])) return NaN;
    const d = sum(path.tip(i), path.tip(i - 1), -1);
    return Math.sqrt(dot(d, d)) / (path.time[i] - path.time[i - 1]);
  };
  path.off = (i) => Math.hypot(path.deviation[3 * i], path.deviation[3 * i + 1], path.deviation[3 * i + 2]);
  path.indexAt = (time) => {
    let low = 0, high = path.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (path.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  };
  return path;
}

function colourOf(path, scene, mode) {
  if (mode === 'deviation') return (i) => ramp(path.off(i) / scene.tip_tolerance);
  if (mode === 'speed') {
    let most = 0;
    for (let i = 1; i < path.count; ++i) if (!path.has(i, FLAG.link)) most = Math.max(most, path.speed(i) || 0);
    return (i) => (path.speed(i) >= 0 ? ramp(1 - path.speed(i) / (most || 1)) : INK.program);
  }
  return () => INK.program;
}

function objectsOf(scene, path, draw) {
  const things = {bodies: [], part: null};
  const originalPoints = decoded(Float32Array, scene.original.xyz);
  const inks = new Uint8Array(originalPoints.length / 3 * 4);
  for (let i = 0; i < inks.length; i += 4) inks.set([...INK.input, 255], i);
  for (const start of decoded(Uint32Array, scene.original.starts)) inks[4 * start + 3] = 0;
  things.original = draw.lines(originalPoints, inks);
  if (scene.part) things.part = draw.surface(decoded(Float32Array, scene.part.xyz), decoded(Uint32Array, scene.part.triangles));
  for (const body of scene.bodies) {
    const xyz = decoded(Float32Array, body.xyz);
    let low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    xyz.forEach((v, i) => {
      low[i % 3] = Math.min(low[i % 3], v);
      high[i % 3] = Math.max(high[i % 3], v);
    });
    // What is larger than the part and its path would hide them.
    const large = Math.hypot(...sum(high, low, -1)) > 1.5 * scene.size;
    things.bodies.push({link: body.link, large, surface: draw.surface(xyz, decoded(Uint32Array, body.triangles))});
  }

  // The program, its links and its wrist; drawn anew when colours or exaggeration change.
  things.paint = (mode, gain) => {
    const colour = colourOf(path, scene, mode);
    const xyz = new Float32Array(3 * path.count), cut = new Uint8Array(4 * path.count), link = new Uint8Array(4 * path.count);
    for (let i = 0; i < path.count; ++i) {
      for (let k = 0; k < 3; ++k)
        xyz[3 * i + k] = path.tips[3 * i + k] + (path.has(i, FLAG.compared) ? (gain - 1) * path.deviation[3 * i + k] : 0);
      const isLink = path.has(i, FLAG.link);
      cut.set([...colour(i), isLink || i === 0 ? 0 : 255], 4 * i);
      link.set([...INK.link, isLink && i > 0 ? 255 : 0], 4 * i);
    }
    for (const name of ['program', 'links']) draw.forget(things[name]);
    things.program = draw.lines(xyz, cut);
    things.links = draw.lines(xyz, link);
  };
  if (path.wrists) {
    const ink = new Uint8Array(4 * path.count);
    for (let i = 0; i < path.count; ++i) ink.set([...INK.wrist, path.has(i, FLAG.link) ? 0 : 255], 4 * i);
    things.wrist = draw.lines(path.wrists, ink);
  }
  const hairs = [], every = Math.max(1, Math.floor(path.count / 300)), long = 0.05 * scene.size;
  for (let i = 0; i < path.count; i += every)
    if (!path.has(i, FLAG.link))
      hairs.push(path.tip(i), sum(path.tip(i), [path.axes[3 * i], path.axes[3 * i + 1], path.axes[3 * i + 2]], long));
  const hairInk = new Uint8Array(4 * hairs.length);
  for (let i = 0; i < hairs.length; ++i) hairInk.set([...INK.axis, i % 2 ? 255 : 0], 4 * i);
  things.axes = draw.lines(new Float32Array(hairs.flat()), hairInk);
  things.marks = draw.dots(new Float32Array(scene.marks.flatMap((m) => path.tip(m.point))));
  return things;
}
