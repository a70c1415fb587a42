// SPDX-License-Identifier: Apache-2.0
// Surfaces in 3D. Mouse and keys turn them.
import * as THREE from 'three';

import {el} from '../../report/page/dom.js';
import {Orbit} from '../../report/page/orbit.js';

export class SurfaceView {
  constructor(label) {
    this.canvas = el('canvas', {class: 'surface', tabindex: 0, role: 'img', 'aria-label': label});
    this.element = el('div', {class: 'slice-box'}, this.canvas);
    this.orbit = new Orbit(this.canvas, () => this.draw());
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.canvas);
  }

  dispose() {
    this.observer.disconnect();
    if (!this.renderer) return;
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.world = null;
  }

  // Null if this browser or this build has no WebGL; then the page says so.
  start() {
    if (this.renderer || this.isMissing) return this.renderer;
    try {
      this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, antialias: true, preserveDrawingBuffer: true});
    } catch (error) {
      this.isMissing = true;
      this.element.replaceChildren(
          el('p', {class: 'note'},
             'The surface cannot be shown: this browser has no WebGL, or marrow was built without three.js.'));
      return null;
    }
    this.renderer.setClearColor(0x0b0e11, 1);
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.75);
    this.camera = new THREE.PerspectiveCamera();
    this.camera.matrixAutoUpdate = false;
    return this.renderer;
  }

  // meshes: [{vertices, triangles, colour}], vertices and triangles as typed arrays
  set(meshes) {
    if (!this.start()) return;
    const box = new THREE.Box3();
    this.world = new THREE.Scene();
    this.world.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.55), this.lamp, this.lamp.target);
    for (const {vertices, triangles, colour} of meshes) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(vertices, 3));
      geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
      geometry.computeVertexNormals();
      geometry.computeBoundingBox();
      box.union(geometry.boundingBox);
      this.world.add(new THREE.Mesh(
          geometry,
          new THREE.MeshPhongMaterial({color: colour, specular: 0x222222, shininess: 25, side: THREE.DoubleSide})));
    }
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    const distance = 1.05 * sphere.radius / Math.sin(Orbit.HALF_FIELD);
    if (!this.isPlaced) this.orbit.reset({target: sphere.center.toArray(), distance, azimuth_deg: -90});
    this.isPlaced = true;
    this.radius = sphere.radius;
    this.canvas.dataset.triangles = meshes.reduce((sum, mesh) => sum + mesh.triangles.length / 3, 0);
    this.draw();
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (!this.world || !width || !height) return;
    const {right, up, back} = this.orbit.axes(), eye = new THREE.Vector3(...this.orbit.eye());
    this.renderer.setPixelRatio(devicePixelRatio || 1);
    this.renderer.setSize(width, height, false);
    this.camera.matrix.makeBasis(new THREE.Vector3(...right), new THREE.Vector3(...up), new THREE.Vector3(...back))
        .setPosition(eye);
    const near = Math.max(1, this.orbit.distance - 2 * this.radius), far = this.orbit.distance + 4 * this.radius;
    this.camera.projectionMatrix.makePerspective(
        ...[-1, 1].map((side) => side * near * Math.tan(Orbit.HALF_FIELD) * width / height),
        ...[1, -1].map((side) => side * near * Math.tan(Orbit.HALF_FIELD)), near, far);
    this.camera.projectionMatrixInverse.getInverse(this.camera.projectionMatrix);
    this.camera.updateMatrixWorld(true);
    this.lamp.position.copy(eye).addScaledVector(new THREE.Vector3(...up), 0.5 * this.orbit.distance);
    this.lamp.target.position.set(...this.orbit.target);
    this.renderer.render(this.world, this.camera);
  }
}
