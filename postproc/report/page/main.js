// Puts the 3D view, its panel and the time slider into the page.
function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (key === 'text') made.textContent = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

function startView(box, scene) {
  const path = pathOf(scene);
  const canvas = element('canvas', {
    tabindex: '0', role: 'application',
    'aria-label': 'Path in the part. Arrows turn, shift and arrows move, plus and minus zoom, comma and full stop go from line to line, 1 2 3 look from above, front, side, Home resets.'});
  const labels = element('div', {id: 'marks'});
  const compass = element('canvas', {id: 'axes', width: '148', height: '148'});
  const panel = element('div', {id: 'panel'});
  const bar = element('div', {id: 'time'});
  box.append(element('div', {class: 'stage'}, canvas, labels, compass), panel, bar);
  box.hidden = false;
  const draw = drawingOn(canvas);
  if (!draw) {
    box.replaceChildren(element('p', {class: 'noscript', text: 'This browser has no WebGL 2: the views below stand in for the 3D view.'}));
    return null;
  }
  const things = objectsOf(scene, path, draw);
  const camera = cameraOf(scene.size);
  const state = {time: 0, index: 0, joints: path.count ? path.jointsAt(0) : scene.axes.map(() => 0), playing: false, mode: 'plain', gain: 1};
  const shown = {part: true, original: true, program: true, links: false, axes: true, wrist: false, head: true, machine: false, marks: true};
  const duration = path.count ? path.time[path.count - 1] : 0;
  let due = false;

  const view = () => camera.matrix(canvas.clientWidth / Math.max(1, canvas.clientHeight), 60 * scene.size);

  const headAt = () => {
    const m = machineAt(scene, state.joints), toPart = multiply(shifted(scene.centre.map((v) => -v)), inverseOf(m.part));
    return (link) => (link === -2 ? multiply(toPart, m.table) : link < 0 ? toPart : multiply(toPart, m.links[link]));
  };

  const needle = () => {
    const length = path.lengthAt(state.index), tool = toolAt(scene, state.joints, length);
    const tip = sum(tool.tip, scene.centre, -1);
    const end = sum(tip, tool.axis, Math.max(length, 0.25 * scene.size));
    return draw.lines(new Float32Array([...tip, ...end]), new Uint8Array([20, 20, 20, 255, 20, 20, 20, 255]));
  };

  function render() {
    due = false;
    draw.begin();
    const v = view(), stretch = [canvas.clientWidth / Math.max(1, canvas.clientHeight) * camera.reach, camera.reach, -60 * scene.size];
    if (shown.part && things.part) draw.drawSurface(things.part, v, identity(), [0.80, 0.82, 0.85, 1], stretch);
    // Bodies are glass: paths are drawn over them, the part hides both.
    if (shown.head && path.count) {
      const pose = headAt();
      for (const body of things.bodies)
        if (shown.machine || !body.large) draw.drawSurface(body.surface, v, pose(body.link), [0.45, 0.52, 0.62, 0.34], stretch);
    }
    if (shown.links) draw.drawLines(things.links, v, 1.2, 0.0001);
    if (shown.original) draw.drawLines(things.original, v, 4.5, 0.0001);
    if (shown.program) draw.drawLines(things.program, v, 2.2, 0.00015);
    if (shown.axes) draw.drawLines(things.axes, v, 1, 0.0001);
    if (shown.wrist) draw.drawLines(things.wrist, v, 1.4, 0.0001);
    if (path.count) {
      const tip = draw.dots(new Float32Array(sum(toolAt(scene, state.joints, path.lengthAt(state.index)).tip, scene.centre, -1)));
      if (shown.marks) draw.drawDots(things.marks, v, 9, [0.70, 0.13, 0.16, 1]);
      if (shown.head) {
        const line = needle();
        draw.drawLines(line, v, 2, 0.00012);
        draw.forget(line);
      }
      draw.drawDots(tip, v, 12, [0.08, 0.08, 0.08, 1]);
      draw.forget(tip);
    }
    placeLabels(v);
    drawCompass();
    canvas.dataset.frames = String(1 + Number(canvas.dataset.frames || 0));
  }
  const refresh = () => {
    if (!due) requestAnimationFrame(render);
    due = true;
  };

  const important = (mark) => mark.failed || /^(tip|axis|lead|tilt|rotation)_deviation|^clearance|^gap/.test(mark.name);
  const buttons = scene.marks.filter(important).slice(0, 10).map((mark) => {
    const button = element('button', {type: 'button', title: mark.text, tabindex: '-1', text: mark.name});
    button.addEventListener('click', () => select(mark.point));
    labels.append(button);
    return {button, mark};
  });
  function placeLabels(v) {
    const taken = [];
    for (const {button, mark} of buttons) {
      const p = moved(v, path.tip(mark.point));
      const x = 0.5 * (p[0] + 1) * canvas.clientWidth;
      let y = 0.5 * (1 - p[1]) * canvas.clientHeight;
      while (taken.some(([a, b]) => Math.abs(a - x) < 150 && Math.abs(b - y) < 19)) y += 19;
      taken.push([x, y]);
      button.hidden = !shown.marks || Math.abs(p[0]) > 1 || Math.abs(p[1]) > 1;
      button.style.left = x + 'px';
      button.style.top = y + 'px';
    }
  }

  function drawCompass() {
    const pen = compass.getContext('2d'), {right, up} = camera.axes();
    pen.setTransform(2, 0, 0, 2, 0, 0);
    pen.clearRect(0, 0, 74, 74);
    pen.font = '11px sans-serif';
    [['X', [1, 0, 0], '#b3202a'], ['Y', [0, 1, 0], '#1e7a3c'], ['Z', [0, 0, 1], '#1f4e9c']].forEach(([name, e, ink]) => {
      const x = 37 + 26 * dot(right, e), y = 37 - 26 * dot(up, e);
      pen.strokeStyle = pen.fillStyle = ink;
      pen.beginPath();
      pen.moveTo(37, 37);
      pen.lineTo(x, y);
      pen.stroke();
      pen.fillText(name, x + 2, y);
    });
  }

  // --- time -------------------------------------------------------------------------------------
  const slider = element('input', {type: 'range', min: '0', max: String(duration), step: 'any', value: '0', 'aria-label': 'Time in the program'});
  const clock = element('output', {});
  const play = element('button', {type: 'button', class: 'plain', text: 'Play'});
  const rate = element('select', {'aria-label': 'Speed of playing'});
  for (const k of [0.1, 1, 10, 100]) rate.append(element('option', {value: String(k), text: `${k} x`}));
  rate.value = duration > 300 ? '10' : '1';
  bar.append(play, rate, slider, clock);

  const table = element('table', {class: 'pairs', id: 'place'});
  function tell() {
    clock.textContent = `${figure(state.time, 3)} of ${figure(duration, 3)} s`;
    slider.value = String(state.time);
    slider.setAttribute('aria-valuetext', clock.textContent);
    if (!path.count) return;
    table.replaceChildren(...wordsOf(scene, path, state).map(([name, text]) =>
      name === null
        ? element('tr', {}, element('td', {colspan: '2'}, element('span', {class: 'source code', text})))
        : element('tr', {}, element('th', {text: name}), element('td', {text}))));
    for (const cursor of cursors) cursor(state.time);
    refresh();
  }

  function setTime(time) {
    state.time = Math.min(duration, Math.max(0, time));
    if (!path.count) return;
    const i = path.indexAt(state.time), next = Math.min(i + 1, path.count - 1);
    const span = path.time[next] - path.time[i], t = span > 0 ? (state.time - path.time[i]) / span : 0;
    const a = path.jointsAt(i), b = path.jointsAt(next);
    state.joints = a.map((v, j) => v + t * (b[j] - v));
    state.index = t > 0 ? next : i;
    tell();
  }
  function select(i) {
    state.index = i;
    state.time = path.time[i];
    state.joints = path.jointsAt(i);
    tell();
  }
  slider.addEventListener('input', () => setTime(Number(slider.value)));
  play.addEventListener('click', () => {
    state.playing = !state.playing;
    play.textContent = state.playing ? 'Pause' : 'Play';
    if (state.playing && state.time >= duration) setTime(0);
    let last = null;
    const step = (now) => {
      if (!state.playing) return;
      if (last !== null) setTime(state.time + (now - last) / 1000 * Number(rate.value));
      last = now;
      if (state.time < duration) requestAnimationFrame(step);
      else play.click();
    };
    requestAnimationFrame(step);
  });

  const cursors = [...document.querySelectorAll('svg.of-time')].map((plot) => {
    const from = Number(plot.dataset.from), to = Number(plot.dataset.to), left = Number(plot.dataset.left), right = Number(plot.dataset.right);
    const line = document.createElementNS('http://www.w3.org/2000/svg', 'line');
    line.setAttribute('y1', '30');
    line.setAttribute('y2', String(plot.viewBox.baseVal.height - 36));
    line.setAttribute('stroke', '#1c2430');
    plot.append(line);
    plot.addEventListener('click', (event) => {
      const x = (event.clientX - plot.getBoundingClientRect().left) / plot.getBoundingClientRect().width * 760;
      setTime(from + (x - left) / (right - left) * (to - from));
    });
    return (time) => {
      const x = left + (Math.min(to, Math.max(from, time)) - from) / (to - from) * (right - left);
      line.setAttribute('x1', x.toFixed(1));
      line.setAttribute('x2', x.toFixed(1));
    };
  });

  // --- panel ------------------------------------------------------------------------------------
  const controls = element('div', {class: 'controls'});
  const toggle = (name, text, ink, possible) => {
    if (!possible) return;
    const input = element('input', {type: 'checkbox'});
    input.checked = shown[name];
    input.addEventListener('change', () => {
      shown[name] = input.checked;
      refresh();
    });
    const key = element('span', {class: 'key'});
    key.style.borderColor = ink;
    controls.append(element('label', {}, input, ' ', key, text));
  };
  const rgb = (ink) => `rgb(${ink.join(',')})`;
  const hasLinks = path.flags.some((f) => f & FLAG.link);
  toggle('part', 'Workpiece', '#c9cdd3', things.part);
  toggle('original', 'Input path', rgb(INK.input), things.original.count > 0);
  toggle('program', 'Program, as certified', rgb(INK.program), path.count > 0);
  toggle('links', 'Links between cuts', rgb(INK.link), hasLinks);
  toggle('axes', 'Tool axes', rgb(INK.axis), path.count > 0);
  toggle('wrist', 'Path of the wrist', rgb(INK.wrist), path.wrists && path.count > 0);
  toggle('head', things.bodies.some((b) => !b.large) ? 'Head and tool' : 'Tool', '#737e8c', path.count > 0);
  toggle('machine', 'Large bodies of the machine', '#737e8c', things.bodies.some((b) => b.large));
  toggle('marks', 'Tightest places', '#b3202a', scene.marks.length > 0);
  const choice = (text, options, change) => {
    const list = element('select', {});
    for (const [value, name] of options) list.append(element('option', {value, text: name}));
    list.addEventListener('change', () => change(list.value));
    controls.append(element('label', {}, text, ' ', list));
  };
  const legend = element('p', {class: 'faint'});
  const paint = () => {
    things.paint(state.mode, state.gain);
    legend.replaceChildren();
    if (state.mode === 'deviation') legend.append(element('div', {class: 'ramp'}), `0 to the tolerance of ${scene.tip_tolerance} mm`);
    if (state.mode === 'speed') legend.append(element('div', {class: 'ramp'}), 'fastest to standing');
    refresh();
  };
  if (path.count) {
    choice('Colour', [['plain', 'one'], ['deviation', 'deviation of the tip'], ['speed', 'tip speed']], (value) => {
      state.mode = value;
      paint();
    });
    if (path.flags.some((f) => f & FLAG.compared))
      choice('Deviation drawn', [['1', 'as it is'], ['10', '10 times'], ['100', '100 times'], ['1000', '1000 times']], (value) => {
        state.gain = Number(value);
        paint();
      });
  }
  controls.append(legend);
  panel.append(controls, element('h3', {text: 'At the point'}), table);
  if (scene.in_all > path.count)
    panel.append(element('p', {class: 'faint', text: `Drawn: ${path.count} of ${scene.in_all} places.`}));
  if (scene.part && scene.part.in_all * 3 > decoded(Uint32Array, scene.part.triangles).length)
    panel.append(element('p', {class: 'faint', text: 'The workpiece is drawn coarser than it was checked.'}));
  panel.append(element('p', {class: 'faint controls', text: 'Drag to turn, shift-drag to move, wheel to zoom, click a point of the path. Keys: arrows, + and -, comma and full stop from line to line, 1 2 3, Home.'}));

  // --- mouse and keys ---------------------------------------------------------------------------
  const pointers = new Map();
  let way = 0;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    way = 0;
  });
  canvas.addEventListener('pointermove', (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last[0], dy = event.clientY - last[1];
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    way += Math.hypot(dx, dy);
    const half = 0.5 * canvas.clientHeight;
    if (pointers.size > 1 || event.shiftKey || event.ctrlKey || event.buttons & 6) camera.pan(-dx / half / pointers.size, dy / half / pointers.size);
    else camera.turn(-0.008 * dx, 0.008 * dy);
    refresh();
  });
  const release = (event) => {
    if (pointers.delete(event.pointerId) && event.type === 'pointerup' && way < 4) {
      const box2 = canvas.getBoundingClientRect();
      const i = pickedPoint(path, view(), canvas, event.clientX - box2.left, event.clientY - box2.top, 14, shown.links);
      if (i >= 0) select(i);
    }
  };
  canvas.addEventListener('pointerup', release);
  canvas.addEventListener('pointercancel', release);
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(0.0012 * event.deltaY));
    refresh();
  }, {passive: false});

  const nextLine = (step) => {
    let i = state.index;
    do i += step; while (i > 0 && i + 1 < path.count && !path.has(i, FLAG.lineEnd));
    if (i >= 0 && i < path.count) select(i);
  };
  const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
  const keys = {
    '+': () => camera.zoom(0.8), '=': () => camera.zoom(0.8), '-': () => camera.zoom(1.25), Home: camera.reset,
    '1': () => camera.look(-Math.PI / 2, Math.PI / 2), '2': () => camera.look(-Math.PI / 2, 0), '3': () => camera.look(0, 0),
    ',': () => nextLine(-1), '.': () => nextLine(1)};
  canvas.addEventListener('keydown', (event) => {
    const arrow = arrows[event.key];
    if (arrow) {
      if (event.shiftKey) camera.pan(0.1 * arrow[0], 0.1 * arrow[1]);
      else camera.turn(0.1 * arrow[0], 0.1 * arrow[1]);
    } else if (keys[event.key] && !event.ctrlKey && !event.metaKey && !event.altKey) {
      keys[event.key]();
    } else {
      return;
    }
    event.preventDefault();
    refresh();
  });
  if (window.ResizeObserver) new ResizeObserver(refresh).observe(canvas);
  window.addEventListener('beforeprint', render);

  // Links of the tables lead to their place.
  const leads = (name, places) => document.querySelectorAll(`a[data-${name}-line]`).forEach((link) => link.addEventListener('click', () => {
    const line = Number(link.getAttribute(`data-${name}-line`));
    let found = places.indexOf(line);
    if (found < 0) found = places.findIndex((v) => v > line);
    if (found < 0) return;
    select(found);
    camera.target = path.tip(found);
    refresh();
  }));
  leads('output', path.outputLine);
  leads('input', path.inputLine);

  paint();
  const first = scene.marks.find((m) => m.name === 'tip_deviation');
  if (path.count) select(first ? first.point : 0);
  else refresh();
  return {
    count: path.count, state, select, setTime,
    screenOf: (i) => {
      const p = moved(view(), path.tip(i)), r = canvas.getBoundingClientRect();
      return [r.left + 0.5 * (p[0] + 1) * r.width, r.top + 0.5 * (1 - p[1]) * r.height];
    },
    tipOf: (i) => sum(path.tip(i), scene.centre, 1), jointsOf: path.jointsAt,
    linesOf: (i) => [path.inputLine[i], path.outputLine[i]], isLink: (i) => path.has(i, FLAG.link),
  };
}

document.querySelectorAll('table.sortable').forEach(makeSortable);
const viewBox = document.getElementById('view');
const sceneData = JSON.parse(document.getElementById('scene').textContent);
if (viewBox && sceneData.axes) window.smoothpost = {view: startView(viewBox, sceneData)};
document.documentElement.dataset.ready = 'yes';
