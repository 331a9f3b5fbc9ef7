// The camera: it circles about a target, z up. Mouse, pen, fingers and keys move it.
'use strict';

const kHighest = Math.PI / 2 - 1e-3;

class OrbitCamera {
  /// @param element that receives the input. @param changed called after each change.
  /// @param clicked called with the position in the element [pixels], for a click or tap without a drag.
  constructor(element, changed, clicked) {
    this.camera = new THREE.PerspectiveCamera(50, 1, 1, 1000);
    this.camera.up.set(0, 0, 1);
    this.target = new THREE.Vector3();
    this.distance = 100;
    this.azimuth = 0;    // of the camera, seen from the target [rad]
    this.elevation = 0.6;
    this.reach = 1000;   // radius of all there is to see
    this.insets = {left: 0, bottom: 0};  // of the element, that something else covers [pixels]
    this.element = element;
    this.changed = changed;
    this.clicked = clicked;
    this.pointers = new Map();
    this.listen();
  }

  listen() {
    const on = (name, handle) => this.element.addEventListener(name, handle, {passive: false});
    on('pointerdown', (event) => {
      this.element.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, this.at(event));
      if (this.pointers.size === 1) this.press = {...this.at(event), moved: false};
      else this.press = undefined;
    });
    on('pointermove', (event) => this.drag(event));
    on('pointerup', (event) => {
      const press = this.press;
      this.pointers.delete(event.pointerId);
      this.press = undefined;
      if (press && !press.moved && event.button === 0) this.clicked(press.x, press.y);
    });
    on('pointercancel', (event) => {
      this.pointers.delete(event.pointerId);
      this.press = undefined;
    });
    on('contextmenu', (event) => event.preventDefault());
    on('wheel', (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : 1;
      const {x, y} = this.at(event);
      this.zoom(Math.exp(Math.max(-0.5, Math.min(0.5, 0.0015 * lines * event.deltaY))), x, y);
    });
  }

  at(event) {
    const box = this.element.getBoundingClientRect();
    return {x: event.clientX - box.left, y: event.clientY - box.top};
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = this.at(event), dx = now.x - before.x, dy = now.y - before.y;
    if (this.press && Math.hypot(now.x - this.press.x, now.y - this.press.y) > 6) this.press.moved = true;
    if (this.press && !this.press.moved) return;
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.pointers.set(event.pointerId, now);
    if (others.length === 0) {
      if (event.shiftKey || event.buttons & 6) this.pan(dx, dy);
      else this.turn(dx, dy);
    } else {  // two fingers: distance, angle and middle
      const other = others[0], from = {x: before.x - other.x, y: before.y - other.y}, to = {x: now.x - other.x, y: now.y - other.y};
      const ratio = Math.hypot(from.x, from.y) / Math.max(1, Math.hypot(to.x, to.y));
      this.azimuth += wrapped(Math.atan2(to.y, to.x) - Math.atan2(from.y, from.x));
      this.zoom(ratio, (now.x + other.x) / 2, (now.y + other.y) / 2);
      this.pan(dx / 2, dy / 2);
    }
  }

  /// @param dx, dy of the pointer [pixels].
  turn(dx, dy) {
    const per_pixel = 2.5 / Math.max(300, this.element.clientHeight);
    this.azimuth -= per_pixel * dx;
    this.elevation = Math.max(-kHighest, Math.min(kHighest, this.elevation + per_pixel * dy));
    this.update();
  }

  /// The length of a pixel at the target.
  unitsPerPixel() {
    return 2 * this.distance * Math.tan(THREE.Math.degToRad(this.camera.fov / 2)) / this.element.clientHeight;
  }

  /// Moves the target with the pointer, over the ground. @param dx, dy [pixels].
  pan(dx, dy) {
    const per_pixel = this.unitsPerPixel();
    const c = Math.cos(this.azimuth), s = Math.sin(this.azimuth), sine = Math.sin(this.elevation);
    const forward = per_pixel * dy * (Math.abs(sine) > 0.35 ? 1 / sine : 0), right = -per_pixel * dx;
    this.target.x += -s * right - c * forward;
    this.target.y += c * right - s * forward;
    if (forward === 0) this.target.z += per_pixel * dy;  // seen from the side
    this.clampTarget();
    this.update();
  }

  /// @param factor for the distance. @param x, y what stays where it is in the element [pixels]; default: the middle.
  zoom(factor, x, y) {
    const least = 2, most = 4 * this.reach, distance = Math.max(least, Math.min(most, this.distance * factor));
    factor = distance / this.distance;
    if (x !== undefined) {
      const {origin, direction} = this.ray(x, y);
      const t = (this.target.z - origin.z) / direction.z;
      if (t > 0 && t < 4 * this.distance) this.target.lerp(origin.addScaledVector(direction, t), 1 - factor);
      this.clampTarget();
    }
    this.distance = distance;
    this.update();
  }

  clampTarget() {
    this.target.clampLength(0, 1.5 * this.reach);
  }

  /// The ray through a pixel of the element.
  ray(x, y) {
    const {clientWidth, clientHeight} = this.element;
    const direction = new THREE.Vector3(2 * x / clientWidth - 1, 1 - 2 * y / clientHeight, 0.5);
    direction.unproject(this.camera).sub(this.camera.position).normalize();
    return {origin: this.camera.position.clone(), direction};
  }

  /// Takes over the size of the element, and which parts of it are covered.
  resize(insets) {
    const {clientWidth: width, clientHeight: height} = this.element;
    this.insets = insets;
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, -insets.left / 2, insets.bottom / 2, width, height);
    this.update();
  }

  update() {
    const flat = Math.cos(this.elevation);
    this.camera.position.set(flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth), Math.sin(this.elevation))
        .multiplyScalar(this.distance).add(this.target);
    this.camera.lookAt(this.target);
    const far = this.camera.position.length() + this.reach;
    this.camera.near = Math.max(0.2, Math.min(this.distance / 20, far / 1000));
    this.camera.far = Math.max(far, 10 * this.camera.near);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.changed();
  }

  /// Looks at a box from a direction, so that all of it is seen.
  frame(box, azimuth, elevation) {
    this.azimuth = azimuth;
    this.elevation = elevation;
    box.getCenter(this.target);
    this.distance = 1;
    this.update();
    // The distance at which each corner is within the view.
    const inverse = new THREE.Matrix4().getInverse(this.camera.matrixWorld).setPosition(0, 0, 0);
    const {clientWidth: width, clientHeight: height} = this.element, half = Math.tan(THREE.Math.degToRad(this.camera.fov / 2));
    const up = half * (height - this.insets.bottom) / height, right = half * (width - this.insets.left) / height;
    let distance = 2;
    for (let corner = 0; corner < 8; ++corner) {
      const at = new THREE.Vector3(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                                   corner & 4 ? box.max.z : box.min.z).sub(this.target).applyMatrix4(inverse);
      distance = Math.max(distance, at.z + Math.abs(at.x) / right, at.z + Math.abs(at.y) / up);
    }
    this.distance = 1.05 * distance;
    this.update();
  }
}

function wrapped(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}
