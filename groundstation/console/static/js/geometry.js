// Ellipses, footprints, arrows: numbers only, in world coordinates.

const CHI2_95 = -2 * Math.log(0.05);
const FARTHEST_M = 7;

// Semi-axes [m] and direction [rad] of the 95 % ellipse of the covariance (xx, xy, yy).
export function ellipse95([a, b, c]) {
  const middle = (a + c) / 2, spread = Math.hypot((a - c) / 2, b);
  const axis = (value) => Math.sqrt(Math.max(0, value) * CHI2_95);
  return { major: axis(middle + spread), minor: axis(middle - spread), angle: 0.5 * Math.atan2(2 * b, a - c) };
}

// Where the border of a camera's view meets a horizontal plane; rays that do not come down end far away.
export function footprint(rays, position, yaw, height) {
  const c = Math.cos(yaw), s = Math.sin(yaw), drop = position[2] - height;
  if (drop <= 0.02) return [];
  return rays.map(([x, y, z]) => {
    const across = Math.hypot(x, y) || 1e-9;
    const reach = z < -1e-3 ? Math.min((drop / -z) * across, FARTHEST_M) : FARTHEST_M;
    const k = reach / across;
    return [position[0] + k * (c * x - s * y), position[1] + k * (s * x + c * y)];
  });
}

export function bodyToWorld([x, y], yaw) {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  return [c * x - s * y, s * x + c * y];
}

// Line width [px] of a link that brings so much information [1/m^2].
export const thickness = (information) => Math.min(10, 1.2 + 2.1 * Math.log10(1 + Math.max(0, information) / 8));
