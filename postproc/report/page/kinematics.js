// The machine: product of exponentials of its joints, as docs/machine_file.md has it. Joint values
// are in the units of people.
function jointMotion(axis, value) {
  return axis.kind === 'rotary'
    ? rotation(axis.direction, value * Math.PI / 180, axis.origin)
    : shifted([axis.direction[0] * value, axis.direction[1] * value, axis.direction[2] * value]);
}

// Poses in M: of every link (`links`, by axis), of what carries the part (`table`), of the part, of
// the tool of length 0.
function machineAt(scene, q) {
  let tool = identity(), table = identity();
  const links = scene.axes.map((axis, j) => {
    const motion = jointMotion(axis, q[j]);
    if (axis.side === 'tool') return (tool = multiply(tool, motion));
    return (table = multiply(table, motion));
  });
  return {links, table, part: multiply(table, scene.home), tool: multiply(tool, scene.tool_home)};
}

// Tip, tool axis and wrist in the part's frame.
function toolAt(scene, q, length) {
  const m = machineAt(scene, q);
  const toPart = inverseOf(m.part);
  const axis = turned(toPart, turned(m.tool, scene.tool_axis));
  const holder = moved(toPart, [m.tool[12], m.tool[13], m.tool[14]]);
  const wrist = scene.wrist && moved(toPart, moved(m.links[scene.wrist.joint], scene.wrist.point));
  return {tip: sum(holder, axis, -length), axis, wrist};
}
