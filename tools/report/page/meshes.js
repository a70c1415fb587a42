// SPDX-License-Identifier: Apache-2.0
// Meshes of the 3D view: decoded from base64, and their outlines as seen from a point.

const cache = new Map();

// The bytes of a text in base64.
export function decoded(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

// The buffers of a scene's mesh, decoded once: its own, or the shared one that it names.
export function buffers(data, sceneId, meshIndex) {
  const mesh = data.scenes[sceneId].meshes[meshIndex],
        key = mesh.geometry ? 'shared ' + mesh.geometry : sceneId + ' ' + meshIndex;
  if (!cache.has(key)) {
    const source = mesh.geometry ? data.geometries[mesh.geometry] : mesh;
    cache.set(key, {
      vertices: new Float32Array(decoded(source.vertices).buffer),
      triangles: new Uint32Array(decoded(source.triangles).buffer)
    });
  }
  return cache.get(key);
}

// Planes of the triangles, and the edges with the triangles on both sides (-1: none).
function topology(mesh) {
  if (mesh.edges) return mesh;
  const {vertices, triangles} = mesh, count = triangles.length / 3, size = vertices.length / 3;
  mesh.planes = new Float64Array(4 * count);
  const sides = new Map();
  for (let face = 0; face < count; ++face) {
    const [a, b, c] = [triangles[3 * face], triangles[3 * face + 1], triangles[3 * face + 2]];
    const p = [0, 1, 2].map((k) => vertices[3 * b + k] - vertices[3 * a + k]),
          q = [0, 1, 2].map((k) => vertices[3 * c + k] - vertices[3 * a + k]);
    const normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    mesh.planes.set(
        [...normal, -(normal[0] * vertices[3 * a] + normal[1] * vertices[3 * a + 1] + normal[2] * vertices[3 * a + 2])],
        4 * face);
    for (const [from, to] of [[a, b], [b, c], [c, a]]) {
      const key = Math.min(from, to) * size + Math.max(from, to);
      if (sides.has(key))
        sides.get(key)[1] = face;
      else
        sides.set(key, [face, -1]);
    }
  }
  mesh.edges = new Int32Array(4 * sides.size);
  let i = 0;
  for (const [key, faces] of sides) mesh.edges.set([Math.floor(key / size), key % size, ...faces], 4 * i++);
  return mesh;
}

// Both ends of each edge between a triangle that faces the eye and one that faces away: the borders in an X-ray.
export function outline(mesh, eye) {
  const {vertices, planes, edges} = topology(mesh), front = new Uint8Array(planes.length / 4), ends = [];
  for (let face = 0; face < front.length; ++face) {
    const i = 4 * face;
    front[face] = planes[i] * eye[0] + planes[i + 1] * eye[1] + planes[i + 2] * eye[2] + planes[i + 3] > 0 ? 1 : 0;
  }
  for (let i = 0; i < edges.length; i += 4) {
    if (edges[i + 3] >= 0 && front[edges[i + 2]] === front[edges[i + 3]]) continue;
    for (const end of [3 * edges[i], 3 * edges[i + 1]]) ends.push(vertices[end], vertices[end + 1], vertices[end + 2]);
  }
  return new Float32Array(ends);
}

// Lines as strips of triangles in normalised coordinates, some pixels thick: WebGL draws lines one pixel wide.
// ends: points of pairs; clip: the matrix to clip coordinates, by columns; width, height: the canvas in pixels
export function strips(ends, clip, width, height, thick_px) {
  const out = [], half = thick_px / 2;
  const place = (i) => {
    const [x, y, z] = [ends[i], ends[i + 1], ends[i + 2]], w = clip[3] * x + clip[7] * y + clip[11] * z + clip[15];
    return w > 1e-6 ?
        [
          (clip[0] * x + clip[4] * y + clip[8] * z + clip[12]) / w * width / 2,
          (clip[1] * x + clip[5] * y + clip[9] * z + clip[13]) / w * height / 2
        ] :
        null;
  };
  for (let i = 0; i < ends.length; i += 6) {
    const a = place(i), b = place(i + 3);
    if (!a || !b) continue;
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1,
          along = [(b[0] - a[0]) / length * half, (b[1] - a[1]) / length * half];
    const corner = (point, forward, aside) =>
        [(point[0] + forward * along[0] - aside * along[1]) / width * 2,
         (point[1] + forward * along[1] + aside * along[0]) / height * 2, 0];
    const [p, q, r, s] = [corner(a, -1, 1), corner(a, -1, -1), corner(b, 1, 1), corner(b, 1, -1)];
    out.push(...p, ...q, ...r, ...r, ...q, ...s);
  }
  return new Float32Array(out);
}
