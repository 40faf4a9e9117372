// The surface as the server sends it (taichifem/live/messages.py), its normals, and what a ray meets.

const TOPOLOGY = 1, UPDATE = 2;

// { topology } or { update }.
export function decode(buffer) {
  const kind = new Uint32Array(buffer, 0, 1)[0];
  if (kind === TOPOLOGY) return { topology: decodeTopology(buffer) };
  if (kind === UPDATE) return { update: decodeUpdate(buffer) };
  throw new Error(`a message of kind ${kind}`);
}

function reader(buffer, at) {
  return (Type, count) => {
    const found = new Type(buffer, at, count);
    at += found.byteLength;
    return found;
  };
}

function decodeTopology(buffer) {
  const [, version, nodes, triangles, normals] = new Uint32Array(buffer, 0, 6);
  const take = reader(buffer, 24);
  return {
    version, normals,
    nodes: take(Uint32Array, nodes),
    triangles: take(Uint32Array, 3 * triangles),
    corners: take(Uint32Array, 3 * triangles),
    colors: take(Uint8Array, 4 * triangles),
  };
}

function decodeUpdate(buffer) {
  const [, version, number, nodes, colliders, hands, hasValues] = new Uint32Array(buffer, 0, 8);
  const [time, low, high] = new Float32Array(buffer, 32, 4);
  const take = reader(buffer, 48);
  return {
    version, number, time, low, high,
    points: take(Float32Array, 3 * nodes),
    colliders: take(Float32Array, 16 * colliders),
    hands: take(Float32Array, 8 * hands),
    values: hasValues ? take(Uint8Array, nodes) : null,
  };
}

// Sums of the normals of the triangles around each corner (4 numbers each), into `out`; the shader makes them units.
export function sumNormals({ triangles, corners }, points, out) {
  out.fill(0);
  for (let c = 0; c < triangles.length; c += 3) {
    const i = 3 * triangles[c], j = 3 * triangles[c + 1], k = 3 * triangles[c + 2];
    const ax = points[j] - points[i], ay = points[j + 1] - points[i + 1], az = points[j + 2] - points[i + 2];
    const bx = points[k] - points[i], by = points[k + 1] - points[i + 1], bz = points[k + 2] - points[i + 2];
    const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
    for (let s = 0; s < 3; s++) {
      const n = 4 * corners[c + s];
      out[n] += x;
      out[n + 1] += y;
      out[n + 2] += z;
    }
  }
}

// The first point of the surface on a ray: { point, node (of the scene), distance }, or null (Moeller & Trumbore 1997).
export function pick({ triangles, nodes }, points, { from, along }) {
  let best = null, nearest = Infinity;
  for (let c = 0; c < triangles.length; c += 3) {
    const i = 3 * triangles[c], j = 3 * triangles[c + 1], k = 3 * triangles[c + 2];
    const ax = points[j] - points[i], ay = points[j + 1] - points[i + 1], az = points[j + 2] - points[i + 2];
    const bx = points[k] - points[i], by = points[k + 1] - points[i + 1], bz = points[k + 2] - points[i + 2];
    const px = along[1] * bz - along[2] * by, py = along[2] * bx - along[0] * bz, pz = along[0] * by - along[1] * bx;
    const det = ax * px + ay * py + az * pz;
    if (Math.abs(det) < 1e-30) continue;
    const tx = from[0] - points[i], ty = from[1] - points[i + 1], tz = from[2] - points[i + 2];
    const u = (tx * px + ty * py + tz * pz) / det;
    if (u < 0 || u > 1) continue;
    const qx = ty * az - tz * ay, qy = tz * ax - tx * az, qz = tx * ay - ty * ax;
    const v = (along[0] * qx + along[1] * qy + along[2] * qz) / det;
    const distance = (bx * qx + by * qy + bz * qz) / det;
    if (v < 0 || u + v > 1 || distance <= 0 || distance >= nearest) continue;
    const shares = [1 - u - v, u, v];
    nearest = distance;
    best = { triangle: c, corner: shares.indexOf(Math.max(...shares)) };
  }
  if (!best) return null;
  return {
    distance: nearest,
    point: from.map((x, axis) => x + nearest * along[axis]),
    node: nodes[triangles[best.triangle + best.corner]],
  };
}
