// SPDX-License-Identifier: Apache-2.0
// Draws surfaces on a canvas. They are turned by dragging and made larger with the wheel. Without WebGL or libraries:
// the triangles are sorted by depth and filled.
function marrowSurfaceView(canvas, surfaces) {
  const context = canvas.getContext('2d');
  const view = {turn: 0.6, tilt: -1.2, scale: 1};
  const all = surfaces.flatMap((surface) => surface.vertices);
  const middle = [0, 1, 2].map((axis) => {
    let low = Infinity, high = -Infinity;
    for (let i = axis; i < all.length; i += 3) {
      low = Math.min(low, all[i]);
      high = Math.max(high, all[i]);
    }
    return (low + high) / 2;
  });
  let radius = 0;
  for (let i = 0; i < all.length; i += 3)
    radius = Math.max(radius, Math.hypot(all[i] - middle[0], all[i + 1] - middle[1], all[i + 2] - middle[2]));

  function seen(surface) {
    const [ct, st, cp, sp] = [Math.cos(view.turn), Math.sin(view.turn), Math.cos(view.tilt), Math.sin(view.tilt)];
    const points = new Float64Array(surface.vertices.length);
    for (let i = 0; i < points.length; i += 3) {
      const x = surface.vertices[i] - middle[0], y = surface.vertices[i + 1] - middle[1];
      const z = surface.vertices[i + 2] - middle[2];
      const across = ct * x + st * y, along = ct * y - st * x;
      points.set([across, cp * along - sp * z, sp * along + cp * z], i);
    }
    return points;
  }

  function facets(surface) {
    const points = seen(surface), made = [], corners = surface.triangles;
    for (let i = 0; i < corners.length; i += 3) {
      const [a, b, c] = [3 * corners[i], 3 * corners[i + 1], 3 * corners[i + 2]];
      const u = [0, 1, 2].map((k) => points[b + k] - points[a + k]);
      const v = [0, 1, 2].map((k) => points[c + k] - points[a + k]);
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const light = Math.abs(normal[2]) / (Math.hypot(...normal) || 1);
      made.push({points, a, b, c, depth: points[a + 2] + points[b + 2] + points[c + 2], light, hue: surface.hue});
    }
    return made;
  }

  function draw() {
    const size = 0.48 * Math.min(canvas.width, canvas.height) * view.scale / (radius || 1);
    context.clearRect(0, 0, canvas.width, canvas.height);
    const sorted = surfaces.flatMap(facets).sort((one, other) => one.depth - other.depth);
    for (const facet of sorted) {
      context.beginPath();
      for (const corner of [facet.a, facet.b, facet.c])
        context.lineTo(
            canvas.width / 2 + size * facet.points[corner], canvas.height / 2 + size * facet.points[corner + 1]);
      context.closePath();
      context.fillStyle = context.strokeStyle = `hsl(${facet.hue} 40% ${25 + 55 * facet.light}%)`;
      context.fill();
      context.stroke();
    }
  }

  canvas.onpointermove = (event) => {
    if (!event.buttons) return;
    view.turn += event.movementX / 100;
    view.tilt += event.movementY / 100;
    draw();
  };
  canvas.onwheel = (event) => {
    event.preventDefault();
    view.scale *= Math.exp(-event.deltaY / 500);
    draw();
  };
  draw();
}
