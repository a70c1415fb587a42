// SPDX-License-Identifier: Apache-2.0
// Turning, shifting and zooming a 3D view by mouse, touch and keys. Free: about a target, the world's z (to the head)
// up. Looking through an X-ray: shifting and zooming in the image's plane only.

export class Orbit {
  constructor(canvas, changed) {
    Object.assign(this, {canvas, changed, locked: false, pointers: new Map()});
    this.reset({target: [0, 0, 0], distance: 500, azimuth_deg: -65});
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const name of ['pointerup', 'pointercancel'])
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => this.wheel(event), {passive: false});
    canvas.addEventListener('keydown', (event) => this.key(event));
  }

  reset({target, distance, azimuth_deg}) {
    this.home = {target: [...target], distance, azimuth_deg};
    Object.assign(this, {target: [...target], distance, azimuth_deg, elevation_deg: 14});
    this.resetFlat();
  }

  resetFlat() {
    this.flat = {zoom: 1, x: 0, y: 0};  // shift in units of half the canvas
    this.changed();
  }

  again() {
    if (this.locked)
      this.resetFlat();
    else
      this.reset(this.home);
  }

  down(event) {
    this.canvas.focus({preventScroll: true});
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const others = [...this.pointers.entries()].filter(([id]) => id !== event.pointerId).map((entry) => entry[1]);
    const now = [event.clientX, event.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
    if (others.length) {
      const length = (point) => Math.hypot(point[0] - others[0][0], point[1] - others[0][1]);
      this.zoom(length(now) / Math.max(1, length(before)));
      this.shift(dx / 2, dy / 2);
    } else if (this.locked || event.shiftKey || event.buttons & 6)
      this.shift(dx, dy);
    else
      this.turn(-0.4 * dx, 0.4 * dy);
    this.pointers.set(event.pointerId, now);
  }

  // The wheel scrolls the page until the view has been clicked.
  wheel(event) {
    if (document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
  }

  key(event) {
    const arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    if (arrow && (this.locked || event.shiftKey))
      this.shift(20 * arrow[0], 20 * arrow[1]);
    else if (arrow)
      this.turn(-5 * arrow[0], 5 * arrow[1]);
    else if (event.key === '+' || event.key === '=')
      this.zoom(1.15);
    else if (event.key === '-')
      this.zoom(1 / 1.15);
    else if (event.key === '0')
      this.again();
    else
      return;
    event.preventDefault();
  }

  turn(azimuth_deg, elevation_deg) {
    if (this.locked) return;
    this.azimuth_deg += azimuth_deg;
    this.elevation_deg = Math.max(-89, Math.min(89, this.elevation_deg + elevation_deg));
    this.changed();
  }

  zoom(factor) {
    if (this.locked) {
      const zoom = Math.max(0.5, Math.min(40, this.flat.zoom * factor)), change = zoom / this.flat.zoom;
      this.flat = {zoom, x: this.flat.x * change, y: this.flat.y * change};
    } else
      this.distance = Math.max(0.02 * this.home.distance, Math.min(20 * this.home.distance, this.distance / factor));
    this.changed();
  }

  shift(dx_px, dy_px) {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (this.locked) {
      this.flat = {...this.flat, x: this.flat.x + 2 * dx_px / width, y: this.flat.y - 2 * dy_px / height};
    } else {
      const {right, up} = this.axes(), size = 2 * this.distance * Math.tan(Orbit.HALF_FIELD) / height;
      this.target = this.target.map((value, i) => value + size * (dy_px * up[i] - dx_px * right[i]));
    }
    this.changed();
  }

  // Directions of the free view: from the target to the eye, to the right, and up.
  axes() {
    const azimuth = this.azimuth_deg * Math.PI / 180, elevation = this.elevation_deg * Math.PI / 180;
    const back =
        [Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)];
    const right = [-Math.sin(azimuth), Math.cos(azimuth), 0];
    const up = [
      back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2],
      back[0] * right[1] - back[1] * right[0]
    ];
    return {back, right, up};
  }

  eye() {
    const {back} = this.axes();
    return this.target.map((value, i) => value + this.distance * back[i]);
  }
}
Orbit.HALF_FIELD = 15 * Math.PI / 180;  // half the vertical angle of the free view
