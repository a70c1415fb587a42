// SPDX-License-Identifier: Apache-2.0
// The 3D view: models in the pose of the result, the true pose and the start, among the X-rays or as one of them sees
// it.
import * as THREE from 'three';

import {button, checkbox, el, select, slider} from './dom.js';
import * as Meshes from './meshes.js';
import {Orbit} from './orbit.js';

const POSES = {
  result: {colour: 0x2f86c9, line: 0x4db8ff, text: 'result'},
  truth: {colour: 0x009e73, line: 0x25e0a4, text: 'truth', translucent: true},
  start: {colour: 0xd55e00, line: 0xff9248, text: 'start', translucent: true}
};
const OUTLINE_PX = 1.8;

export class SceneView {
  // entries: [{label, scene: id}], one shown at a time
  constructor(data, entries) {
    Object.assign(
        this, {data, entries, through: null, imageOpacity: 1, imageInFront: false, modelOpacity: 1, planes: true});
    this.style = {free: 'surface', through: 'outline'};
    this.shownPoses = {result: true, truth: true, start: false};
    this.hiddenMeshes = new Set();
    this.canvas = el('canvas', {
      class: 'scene',
      tabindex: 0,
      'aria-label': '3D view. Arrow keys turn, shift and arrow keys move, plus and minus zoom, 0 resets'
    });
    this.controls = el('div', {class: 'toolbar'});
    this.hint = el('p', {class: 'note'});
    this.element = el('div', {class: 'scene-view'}, this.controls, this.canvas, this.hint);
    this.failure = this.open();
    if (this.failure) this.element.replaceChildren(el('p', {class: 'note'}, this.failure));
  }

  open() {
    if (!THREE.WebGLRenderer)
      return 'The 3D view was left out: three.js was missing when this report was written ' +
          '(Debian package libjs-three).';
    try {
      this.renderer =
          new THREE.WebGLRenderer({canvas: this.canvas, antialias: true, alpha: true, preserveDrawingBuffer: true});
    } catch (error) {
      return 'This browser gives no WebGL, which the 3D view needs.';
    }
    this.renderer.autoClear = false;
    this.camera = new THREE.PerspectiveCamera();
    this.camera.matrixAutoUpdate = false;
    SceneView.plain = SceneView.plain || new THREE.Camera();  // for what is in normalised coordinates
    this.orbit = new Orbit(this.canvas, () => this.draw());
    this.load(this.entries[0].scene);
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    return null;
  }

  load(id) {
    this.id = id;
    this.source = this.data.scenes[id];
    this.release();
    this.world = new THREE.Scene();
    this.rims = new THREE.Scene();  // outlines, already in the canvas's normalised coordinates
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.75);
    this.world.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.55), this.lamp, this.lamp.target);
    this.bounds = new THREE.Box3();
    this.models = this.source.poses.map((pose) => this.model(pose));
    const sphere = this.bounds.getBoundingSphere(new THREE.Sphere());
    this.sphere = {centre: sphere.center, radius: sphere.radius || 1};
    this.views = this.source.views.map((view) => this.view(view));
    if (this.through && !this.views.some((view) => view.name === this.through)) this.through = null;
    if (!this.kept)
      this.orbit.reset({
        target: sphere.center.toArray(),
        distance: 1.5 * this.sphere.radius / Math.tan(Orbit.HALF_FIELD),
        azimuth_deg: this.facing()
      });
    this.kept = true;  // another variant is shown from where the last one was
    this.buildControls();
    this.draw();
  }

  // The direction from which all X-rays are seen from the front: the mean direction of their sources.
  facing() {
    const [x, y] = [8, 9].map((i) => -this.source.views.reduce((sum, view) => sum + view.camera_from_world[i], 0));
    return Math.hypot(x, y) > 0.01 ? Math.atan2(y, x) * 180 / Math.PI + 12 : -65;
  }

  model(pose) {
    const kind = POSES[pose.name] || POSES.start, mesh = Meshes.buffers(this.data, this.id, pose.mesh);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(mesh.vertices, 3));
    geometry.setIndex(new THREE.BufferAttribute(mesh.triangles, 1));
    geometry.computeVertexNormals();
    const surface = new THREE.Mesh(
        geometry,
        new THREE.MeshPhongMaterial({color: kind.colour, specular: 0x222222, shininess: 25, side: THREE.DoubleSide}));
    const rim = new THREE.Mesh(
        new THREE.BufferGeometry(),
        new THREE.MeshBasicMaterial(
            {color: kind.line, depthTest: false, depthWrite: false, transparent: true, side: THREE.DoubleSide}));
    rim.frustumCulled = false;
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    group.matrix.set(...pose.world_from_model);
    group.add(surface);
    this.rims.add(rim);
    group.updateMatrixWorld(true);
    geometry.computeBoundingBox();
    this.bounds.union(geometry.boundingBox.clone().applyMatrix4(group.matrix));
    this.world.add(group);
    return {pose, kind, mesh, group, surface, rim, name: this.source.meshes[pose.mesh].name};
  }

  // Moves the results of these models. poses: {model name: world_from_model}
  moveTo(poses) {
    if (this.failure) return;
    for (const {pose, group, name} of this.models) {
      if (pose.name !== 'result' || !poses[name]) continue;
      group.matrix.set(...poses[name]);
      group.updateMatrixWorld(true);
    }
    this.draw();
  }

  // An X-ray: its picture as a plane behind the models, lines from the source to its corners, and a flat quad.
  view(view) {
    const K = view.intrinsics,
          world_from_camera = new THREE.Matrix4().getInverse(new THREE.Matrix4().set(...view.camera_from_world));
    const centre = this.sphere.centre.clone().applyMatrix4(new THREE.Matrix4().set(...view.camera_from_world));
    const depth = centre.z + 1.6 * this.sphere.radius;
    const corner = (u, v) => {
      const y = (v - K[5]) / K[4], x = (u - K[2] - K[1] * y) / K[0];
      return new THREE.Vector3(x * depth, y * depth, depth).applyMatrix4(world_from_camera);
    };
    const [right, low] = [view.width_px - 0.5, view.height_px - 0.5];  // pixel (0, 0) is centred on 0
    const corners = [corner(-0.5, -0.5), corner(right, -0.5), corner(-0.5, low), corner(right, low)];
    const source = new THREE.Vector3().applyMatrix4(world_from_camera);
    const texture = this.texture(view);
    const plane = new THREE.BufferGeometry();
    plane.setAttribute('position', new THREE.Float32BufferAttribute(corners.flatMap((point) => point.toArray()), 3));
    plane.setAttribute('uv', new THREE.Float32BufferAttribute([0, 1, 1, 1, 0, 0, 1, 0], 2));
    plane.setIndex([0, 2, 1, 1, 2, 3]);
    const rays = new THREE.BufferGeometry().setFromPoints(corners.flatMap((point) => [source, point]));
    const group = new THREE.Group();
    group.add(
        new THREE.Mesh(plane, new THREE.MeshBasicMaterial({map: texture, side: THREE.DoubleSide})),
        new THREE.LineSegments(rays, new THREE.LineBasicMaterial({color: 0x8a949e, transparent: true, opacity: 0.6})));
    this.world.add(group);
    const quad = new THREE.Mesh(
        new THREE.PlaneBufferGeometry(2, 2),
        new THREE.MeshBasicMaterial({map: texture, transparent: true, depthTest: false, depthWrite: false}));
    quad.frustumCulled = false;
    const flat = new THREE.Scene();
    flat.add(quad);
    return {name: view.name, view, group, quad, flat, world_from_camera};
  }

  texture(view) {
    const texture = new THREE.Texture();
    texture.minFilter = texture.magFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    const image = new Image();
    image.onload = () => {
      texture.image = image;
      texture.needsUpdate = true;
      this.draw();
    };
    if (this.data.pictures[view.image]) image.src = this.data.pictures[view.image];
    return texture;
  }

  buildControls() {
    const draw = () => this.draw(), names = [...new Set(this.source.meshes.map((mesh) => mesh.name))];
    const poses =
        Object.keys(POSES).filter((name) => this.models.some((model) => model.pose.name === name)).map((name) => {
          const box = checkbox(POSES[name].text, this.shownPoses[name], (on) => {
            this.shownPoses[name] = on;
            draw();
          });
          box.style.setProperty('--mark', '#' + POSES[name].colour.toString(16).padStart(6, '0'));
          box.classList.add('marked');
          return box;
        });
    const meshes = names.length > 1 ? names.map((name) => checkbox(name, !this.hiddenMeshes.has(name), (on) => {
                                                  this.hiddenMeshes[on ? 'delete' : 'add'](name);
                                                  draw();
                                                })) : [];
    const mode = this.through ? 'through' : 'free';
    const set = (change) => (value) => {
      change(value);
      draw();
    };
    const entry = this.entries.findIndex((entry) => entry.scene === this.id);
    const variants = () => select(
        'Variant', this.entries.map((entry, i) => [i, entry.label]), entry, (i) => this.load(this.entries[i].scene));
    const views = [['', 'free'], ...this.views.map((view) => [view.name, 'through ' + view.name])];
    const styles = [['surface', 'surface'], ['outline', 'outline'], ['both', 'surface and outline']];
    const image = () => this.through ?
        [
          slider('X-ray’s opacity', this.imageOpacity, set((value) => this.imageOpacity = value)),
          checkbox('X-ray in front', this.imageInFront, set((on) => this.imageInFront = on)),
        ] :
        [checkbox('X-rays', this.planes, set((on) => this.planes = on))];
    this.controls.replaceChildren(
        ...(this.entries.length > 1 ? [variants()] : []),
        select('View', views, this.through || '', (name) => this.lookThrough(name || null)),
        select('Drawn as', styles, this.style[mode], set((style) => this.style[mode] = style)), ...poses, ...meshes,
        slider('Model’s opacity', this.modelOpacity, set((value) => this.modelOpacity = value)), ...image(),
        button('Reset view', () => this.orbit.again()));
    this.hint.textContent = this.through ?
        'The camera of this X-ray. Drag to shift, wheel (after a click) or + and − to zoom, 0 to reset.' :
        'Drag to turn, shift and drag to move, wheel (after a click) or + and − to zoom, 0 to reset.';
  }

  lookThrough(name) {
    this.through = name;
    this.orbit.locked = Boolean(name);
    this.orbit.resetFlat();
    this.buildControls();
    this.draw();
  }

  // How the image fills the canvas: factors of its normalised coordinates, and a shift.
  flat(view) {
    const width = this.canvas.clientWidth || 1, height = this.canvas.clientHeight || 1, {zoom, x, y} = this.orbit.flat;
    const scale = Math.min(width / view.width_px, height / view.height_px);
    return {sx: zoom * scale * view.width_px / width, sy: zoom * scale * view.height_px / height, x, y};
  }

  // OpenCV's camera as an OpenGL one: u = -0.5 .. width - 0.5 fills -1 .. 1, v likewise downwards, then the flat
  // motion.
  aimThrough({view, world_from_camera}) {
    const K = view.intrinsics, W = view.width_px, H = view.height_px, flat = this.flat(view);
    const depth = this.sphere.centre.clone().applyMatrix4(new THREE.Matrix4().set(...view.camera_from_world)).z;
    const near = Math.max(0.01 * depth, depth - 2 * this.sphere.radius), far = depth + 2 * this.sphere.radius;
    const pixels = new THREE.Matrix4().set(
        2 * K[0] / W, 2 * K[1] / W, 2 * (K[2] + 0.5) / W - 1, 0, 0, -2 * K[4] / H, 1 - 2 * (K[5] + 0.5) / H, 0, 0, 0,
        (far + near) / (far - near), -2 * far * near / (far - near), 0, 0, 1, 0);
    const motion = new THREE.Matrix4().set(flat.sx, 0, 0, flat.x, 0, flat.sy, 0, flat.y, 0, 0, 1, 0, 0, 0, 0, 1);
    const turned = new THREE.Matrix4().makeScale(1, -1, -1);  // OpenGL looks along -z, y up
    this.camera.projectionMatrix.copy(motion).multiply(pixels).multiply(turned);
    this.camera.matrix.copy(world_from_camera).multiply(turned);
  }

  aimFree() {
    const aspect = (this.canvas.clientWidth || 1) / (this.canvas.clientHeight || 1),
          eye = new THREE.Vector3(...this.orbit.eye());
    const {right, up, back} = this.orbit.axes();
    this.camera.projectionMatrix.copy(
        new THREE
            .PerspectiveCamera(
                2 * Orbit.HALF_FIELD * 180 / Math.PI, aspect, this.orbit.distance / 50, this.orbit.distance * 50)
            .projectionMatrix);
    this.camera.matrix.makeBasis(new THREE.Vector3(...right), new THREE.Vector3(...up), new THREE.Vector3(...back))
        .setPosition(eye);
  }

  draw() {
    if (this.pending || !this.renderer) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = null;
      this.drawNow();
    });
  }

  drawNow() {
    const {clientWidth: width, clientHeight: height} = this.canvas,
                                             through =
                                                 this.views && this.views.find((view) => view.name === this.through);
    if (!width || !height || !this.views) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    if (through)
      this.aimThrough(through);
    else
      this.aimFree();
    this.camera.projectionMatrixInverse.getInverse(this.camera.projectionMatrix);
    this.camera.updateMatrixWorld(true);
    const eye = new THREE.Vector3().setFromMatrixPosition(this.camera.matrix);
    this.lamp.position.copy(eye);
    this.lamp.target.position.copy(this.sphere.centre);
    for (const model of this.models) this.dress(model, eye, this.style[through ? 'through' : 'free']);
    for (const view of this.views)
      view.group.visible = !through && this.planes && Boolean(view.quad.material.map.image);
    this.renderer.clear();
    if (through && !this.imageInFront) this.drawImage(through);
    this.renderer.render(this.world, this.camera);
    if (through && this.imageInFront) this.drawImage(through);
    this.renderer.render(this.rims, SceneView.plain);
  }

  dress(model, eye, style) {
    const {surface, rim, kind, group} = model;
    group.visible =
        Boolean(this.shownPoses[model.pose.name]) && !this.hiddenMeshes.has(model.name) && this.modelOpacity > 0;
    surface.visible = style !== 'outline';
    rim.visible = style !== 'surface' && group.visible;
    const opacity = this.modelOpacity * (kind.translucent ? 0.4 : 1);
    Object.assign(surface.material, {opacity, transparent: opacity < 1, depthWrite: opacity === 1});
    surface.renderOrder = opacity < 1 ? 1 : 0;
    rim.material.opacity = this.modelOpacity;
    if (!rim.visible) return;
    const local = eye.clone().applyMatrix4(new THREE.Matrix4().getInverse(group.matrix));
    rim.geometry.dispose();
    rim.geometry = new THREE.BufferGeometry();
    const clip = this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse).multiply(group.matrix);
    const strips = Meshes.strips(
        Meshes.outline(model.mesh, local.toArray()), clip.elements, this.canvas.clientWidth, this.canvas.clientHeight,
        OUTLINE_PX);
    rim.geometry.setAttribute('position', new THREE.BufferAttribute(strips, 3));
  }

  drawImage({view, quad, flat}) {
    const {sx, sy, x, y} = this.flat(view);
    if (!quad.material.map.image) return;
    quad.scale.set(sx, sy, 1);
    quad.position.set(x, y, 0);
    quad.material.opacity = this.imageOpacity;
    this.renderer.render(flat, SceneView.plain);
  }

  // The pixel at which the camera of the present view shows a point of the world. For tests.
  pixelOf(point_mm) {
    const {view} = this.views.find((item) => item.name === this.through), {sx, sy, x, y} = this.flat(view);
    this.drawNow();
    const at = new THREE.Vector3(...point_mm).project(this.camera);
    return [((at.x - x) / sx + 1) / 2 * view.width_px - 0.5, (1 - (at.y - y) / sy) / 2 * view.height_px - 0.5];
  }

  // Frees the memory of the graphics card.
  release() {
    for (const scene of this.world ? [this.world, this.rims, ...this.views.map((view) => view.flat)] : []) {
      scene.traverse((item) => {
        if (item.geometry) item.geometry.dispose();
        if (item.material && item.material.map) item.material.map.dispose();
        if (item.material) item.material.dispose();
      });
    }
  }

  dispose() {
    if (!this.renderer) return;
    this.release();
    cancelAnimationFrame(this.pending);
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.renderer = null;
  }
}
