// Camera of the player: orbit, zoom and shift by mouse, touch and keys; section plane; selection; drawing on request.
"use strict";

const MOST_LINES = 8000;  // ends of lines that are drawn in a moving picture without a graphics card
const MOST_FINE = 4000;   // facets that a moving picture without a graphics card draws with all pixels
const COARSE = 0.7;       // pixels across of a moving picture with more facets, relative to all
const REST = 150;         // time (ms) after which a picture rests

const VIEWS = { iso: [1, -1.5, 0.8], front: [0, -1, 0], side: [1, 0, 0], top: [0, -0.001, 1] };

Object.assign(Player.prototype, {
  view(name) {
    const direction = new THREE.Vector3(...VIEWS[name]).normalize();
    this.target = this.centre.clone();
    this.distance = this.fit(direction);
    this.fitted = name;  // until the user moves the camera
    this.azimuth = Math.atan2(direction.y, direction.x);
    this.elevation = Math.asin(direction.z);
    this.request();
  },

  // Distance (m) from the centre at which the whole motion is visible from a direction.
  fit(direction) {
    const right = new THREE.Vector3().crossVectors(this.camera.up, direction).normalize(), up = new THREE.Vector3().crossVectors(direction, right);
    const high = 0.9 * Math.tan((this.camera.fov * Math.PI) / 360), wide = high * (this.camera.aspect || 1);
    const place = new THREE.Vector3();
    let distance = 0.1 * this.reach;
    for (let k = 0; k < this.extent.length; k += 3) {
      place.fromArray(this.extent, k).sub(this.centre);
      distance = Math.max(distance, place.dot(direction) + Math.max(Math.abs(place.dot(right)) / wide, Math.abs(place.dot(up)) / high));
    }
    return distance;
  },

  // Points (m) that a view must contain: corners of the box of the motion, and tips of arrows in some of the shapes.
  findExtent() {
    const { low, data: { arrows, positions: { high } } } = this;
    this.extent = [];
    for (let k = 0; k < 8; k++) this.extent.push(k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]);
    for (const { kind, place, vector } of arrows) {
      const scale = (0.28 * this.size) / (this.strongest[kind] || 1);
      for (let f = 0; f < this.frames && kind !== "joint"; f += Math.max(1, this.frames >> 4)) {
        const tip = [0, 1, 2].map((axis) => place[3 * f + axis] + scale * vector[3 * f + axis]);
        if (tip.every(Number.isFinite)) this.extent.push(...tip);
      }
    }
  },

  orbit(across, up) {
    this.fitted = "";
    this.azimuth -= across;
    this.elevation = Math.max(-1.57, Math.min(1.57, this.elevation + up));
    this.request();
  },

  zoom(factor) {
    this.fitted = "";
    this.distance = Math.max(0.02 * this.reach, Math.min(60 * this.reach, this.distance * factor));
    this.request();
  },

  shift(x, y) {
    this.fitted = "";
    const scale = (2 * this.distance * Math.tan((this.camera.fov * Math.PI) / 360)) / this.canvas.clientHeight;
    const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 1);
    this.target.addScaledVector(right, -x * scale).addScaledVector(up, y * scale);
    this.request();
  },

  // Mouse, touch and keys. `picked` is called with the object and the place of a click or a hover.
  connect(picked) {
    const { canvas } = this, pointers = new Map();
    let moved = 0, pinch = 0, pending = false;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      if (pointers.size === 1) moved = 0;
      pinch = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) {
        if (!pending && this.solid && this.solid.length < 30000) {
          pending = true;
          requestAnimationFrame(() => { pending = false; picked(this.pick(event.clientX, event.clientY), event, true); });
        }
        return;
      }
      const [x, y] = [event.clientX - last[0], event.clientY - last[1]];
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      moved += Math.abs(x) + Math.abs(y);
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()], apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (pinch) this.zoom(pinch / apart);
        pinch = apart;
        this.shift(x / 2, y / 2);
      } else if (event.shiftKey || event.buttons & 6) this.shift(x, y);
      else this.orbit(0.008 * x, 0.008 * y);
    });
    const release = (event) => {
      if (pointers.delete(event.pointerId) && event.type === "pointerup" && moved < 5 && event.button === 0) {
        picked(this.pick(event.clientX, event.clientY), event, false);
      }
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointerleave", (event) => picked(null, event, true));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const turn = 0.1;
      const keys = {
        ArrowLeft: () => this.orbit(-turn, 0), ArrowRight: () => this.orbit(turn, 0), ArrowUp: () => this.orbit(0, turn),
        ArrowDown: () => this.orbit(0, -turn), "+": () => this.zoom(0.9), "=": () => this.zoom(0.9), "-": () => this.zoom(1.1),
        "1": () => this.view("iso"), "2": () => this.view("front"), "3": () => this.view("side"), "4": () => this.view("top"),
      };
      if (keys[event.key] && !event.ctrlKey && !event.metaKey && !event.altKey) {
        keys[event.key]();
        event.preventDefault();
      }
    });
  },

  // Object under a point of the window: {kind, index, quad}, or null. Small objects near the point come first.
  pick(clientX, clientY) {
    if (!this.data) return null;
    const box = this.canvas.getBoundingClientRect();
    const place = new THREE.Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
    this.camera.updateMatrixWorld();
    this.raycaster.setFromCamera(place, this.camera);
    const hits = (mesh) => (mesh.visible && (mesh.count === undefined || mesh.count) ? this.raycaster.intersectObject(mesh) : []);
    const cut = (hit) => !this.section.axis || this.plane.distanceToPoint(hit.point) >= 0;
    const face = hits(this.facets).find(cut);
    const front = face ? face.distance + 0.02 * this.size : Infinity;
    for (const [mesh, kind] of [[this.contacts, "contact"], [this.joints, "joint"]]) {
      const hit = hits(mesh).find(cut);
      if (hit && hit.distance < front) return { kind, index: hit.instanceId };
    }
    const near = (rods) => rods.near(this.points, this.camera, clientX - box.left, clientY - box.top, box, front, 5);
    const crease = near(this.creases);
    if (crease !== null) return { kind: "crease", index: this.creaseOf[crease] };
    const string = near(this.cables);
    if (string !== null) return { kind: "part", index: this.partOf[this.strings[string]], quad: this.strings[string] };
    if (!face) return null;
    const quad = this.solid[Math.floor(face.faceIndex / 2)];
    return { kind: "part", index: this.partOf[quad], quad };
  },

  applySection() {
    const { axis, at, flip } = this.section;
    const planes = axis ? [this.plane] : [];
    if (axis) {
      const k = "xyz".indexOf(axis), sign = flip ? 1 : -1;
      const place = this.low[k] + at * (this.data.positions.high[k] - this.low[k]);
      this.plane.normal.set(0, 0, 0).setComponent(k, sign);
      this.plane.constant = -sign * place;
    }
    for (const mesh of [this.facets, this.outline, this.mesh, this.creases.mesh, this.cables.mesh]) {
      mesh.material.clippingPlanes = planes;
      mesh.material.needsUpdate = true;
    }
    this.request();
  },

  theme(dark) {
    this.dark = dark;
    this.scene.background = new THREE.Color(dark ? 0x15181d : 0xffffff);
    if (!this.data) return;
    this.outline.material.color.set(dark ? 0xcfd3d8 : 0x303030);
    this.mesh.material.color.set(dark ? 0x888888 : 0x606060);
    this.paint();
    this.request();
  },

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    if (this.data && this.fitted) this.view(this.fitted);
    this.request();
  },

  request() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.render(); });
  },

  // On the processor, many lines take longer than all facets, and pixels as long as facets. Lines and all pixels are drawn as
  // soon as the picture rests.
  refine() {
    const follows = this.slow && performance.now() - this.drawn < REST;
    const ratio = this.ratio * (follows && this.solid.length > MOST_FINE ? COARSE : 1);
    if (this.ratio && this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    const moves = follows && this.outline.userData.vertices.length > MOST_LINES;
    clearTimeout(this.resting);
    if (moves || ratio < this.ratio) this.resting = setTimeout(() => this.request(), 1.5 * REST);
    this.drawLines(moves);
  },

  drawLines(moves) {
    this.outline.visible = !moves;
    this.mesh.visible = !moves && this.options.mesh;
    this.chosen.visible = this.chosenPart() >= 0;
    if (!this.linesMoved || moves) return;
    this.linesMoved = false;
    for (const lines of [this.outline, this.mesh, this.chosen]) {
      if (!lines.visible) continue;
      const { position } = lines.geometry.attributes;
      position.array.set(this.linePoints(lines));
      position.needsUpdate = true;
    }
  },

  render() {
    if (!this.data) return;
    const c = Math.cos(this.elevation);
    const away = new THREE.Vector3(c * Math.cos(this.azimuth), c * Math.sin(this.azimuth), Math.sin(this.elevation));
    this.camera.position.copy(this.target).addScaledVector(away, this.distance);
    this.camera.near = Math.max(1e-4 * this.reach, 0.02 * this.distance - 0.01 * this.reach);
    this.camera.far = this.distance + 20 * this.reach;
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(this.target);
    this.light.position.copy(this.camera.position).add(new THREE.Vector3(0.3 * this.distance, 0, 0.4 * this.distance));
    this.shade(away);
    for (const rods of [this.creases, this.cables]) rods.aim(this.points, this.camera.position);
    this.refine();
    this.renderer.render(this.scene, this.camera);
    this.drawn = performance.now();
  },
});
