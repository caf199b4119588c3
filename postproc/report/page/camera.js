// An orthographic view of a target, Z up: angles in rad, `reach` mm from the middle to the top.
function cameraOf(size) {
  const start = {yaw: -0.9, pitch: 0.6, reach: 0.52 * size, target: [0, 0, 0]};
  const c = Object.assign({}, start, {target: start.target.slice()});

  const frame = () => {
    const cp = Math.cos(c.pitch), sp = Math.sin(c.pitch), cy = Math.cos(c.yaw), sy = Math.sin(c.yaw);
    const to = [cp * cy, cp * sy, sp], right = [-sy, cy, 0];
    return {to, right, up: cross(to, right)};
  };

  // Clip coordinates of points in the part's frame from its centre; depth `deep` mm either way.
  c.matrix = (aspect, deep) => {
    const {to, right, up} = frame(), x = 1 / (c.reach * aspect), y = 1 / c.reach, z = -1 / deep;
    return [
      right[0] * x, up[0] * y, to[0] * z, 0, right[1] * x, up[1] * y, to[1] * z, 0, right[2] * x, up[2] * y,
      to[2] * z, 0, -dot(right, c.target) * x, -dot(up, c.target) * y, -dot(to, c.target) * z, 1];
  };
  c.turn = (yaw, pitch) => {
    c.yaw += yaw;
    c.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, c.pitch + pitch));
  };
  // By shares of half the height.
  c.pan = (x, y) => {
    const {right, up} = frame();
    c.target = sum(sum(c.target, right, x * c.reach), up, y * c.reach);
  };
  c.zoom = (factor) => {
    c.reach = Math.min(100 * size, Math.max(1e-5 * size, c.reach * factor));
  };
  c.reset = () => {
    Object.assign(c, start, {target: start.target.slice()});
  };
  c.look = (yaw, pitch) => Object.assign(c, {yaw, pitch});
  c.axes = () => frame();
  return c;
}
