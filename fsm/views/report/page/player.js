// Player: the motion in space with three.js. Positions are levels (fsm/views/report/packing.py) at some records.
"use strict";

const WHITE = [0.5, 0.5, 0.5];

// Whether WebGL runs on the processor, where smooth edges double the time of a picture.
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl");
  const info = gl && gl.getExtension("WEBGL_debug_renderer_info");
  return Boolean(info && /swiftshader|llvmpipe|software/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)));
}

class Player {
  constructor(canvas, palette, maps, drawn) {
    this.canvas = canvas;
    this.palette = palette.map((text) => new THREE.Color(text));
    this.maps = Object.fromEntries(Object.entries(maps).map(([name, list]) => [name, list.map((c) => new THREE.Color(c))]));
    this.slow = drawnBySoftware();
    this.drawn = -Infinity;  // time (ms) of the last picture
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: drawn < 4000 || !this.slow, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.camera = new THREE.PerspectiveCamera(28, 1, 0.001, 1000);
    this.camera.up.set(0, 0, 1);
    this.scene = new THREE.Scene();
    this.light = new THREE.DirectionalLight(0xffffff, 0.45);
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.66), this.light);
    this.plane = new THREE.Plane(new THREE.Vector3(0, 0, -1), 0);
    this.options = { colour: "part", rest: "none", arrows: true, contacts: true, joints: true, mesh: false, arrowLength: 1 };
    this.section = { axis: "", at: 0.5, flip: false };
    this.at = 0;  // shape that is shown, a broken number
    this.mode = null;
    this.selected = null;
    this.raycaster = new THREE.Raycaster();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  // ---------------------------------------------------------------------------------------------- a result

  load(data) {
    this.dispose();
    this.data = data;
    this.group = new THREE.Group();
    this.scene.add(this.group);
    const [frames, vertices] = data.positions.shape;
    Object.assign(this, { frames, vertices, mode: null, selected: null, at: 0 });
    this.points = new Float32Array(3 * vertices);
    this.partOf = data.of_quad;
    this.low = data.positions.low;
    this.step = data.positions.high.map((high, k) => (high - this.low[k]) / 65534);
    this.size = data.size;
    this.centre = new THREE.Vector3(...data.positions.high.map((high, k) => 0.5 * (high + this.low[k])));
    this.reach = 0.5 * Math.hypot(...data.positions.high.map((high, k) => high - this.low[k])) || 1;
    this.bounds = new THREE.Sphere(this.centre, 4 * this.reach);
    this.makeFacets();
    const radius = 0.0035 * this.size;
    this.makeCreases(1.4 * radius);
    this.makeLines();
    const round = data.joints.length > 200 ? [5, 4] : [12, 8];
    this.joints = this.instances(new THREE.SphereGeometry(2.2 * radius, ...round), data.joints.length);
    this.contacts = this.instances(new THREE.SphereGeometry(3 * radius, 12, 8), data.contacts.length);
    this.shafts = this.instances(new THREE.CylinderGeometry(radius, radius, 1, 8), data.arrows.length);
    this.heads = this.instances(new THREE.ConeGeometry(3 * radius, 8 * radius, 12), data.arrows.length);
    this.strongest = {};
    for (const arrow of data.arrows) {
      let most = this.strongest[arrow.kind] || 0;
      for (let i = 0; i + 2 < arrow.vector.length; i += 3) most = Math.max(most, Math.hypot(arrow.vector[i], arrow.vector[i + 1], arrow.vector[i + 2]) || 0);
      this.strongest[arrow.kind] = most;
    }
    this.makeObstacles();
    this.makeRest();
    this.applySection();
    this.findExtent();
    this.view(data.view);
    this.show(0);
  }

  dispose() {
    if (!this.group) return;
    this.group.traverse((item) => { if (item.geometry) item.geometry.dispose(); if (item.material) item.material.dispose(); });
    this.scene.remove(this.group);
  }

  makeFacets() {
    const { quads, lines } = this.data;
    this.solid = [];   // facets that are drawn as faces; others are lines of cables
    this.strings = [];
    for (let q = 0; q < quads.length / 4; q++) (lines[this.partOf[q]] ? this.strings : this.solid).push(q);
    const count = this.solid.length;
    const index = new Uint32Array(6 * count);
    for (let k = 0; k < count; k++) index.set([4 * k, 4 * k + 1, 4 * k + 2, 4 * k, 4 * k + 2, 4 * k + 3], 6 * k);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(12 * count), 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(12 * count), 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    geometry.boundingSphere = this.bounds;
    // facets are plane: `shade` computes their light once for each facet, which is twice as fast as once for each pixel
    const material = new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide });
    this.base = new Float32Array(3 * count);  // colours without light
    Object.assign(material, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    this.facets = new THREE.Mesh(geometry, material);
    this.facets.frustumCulled = false;
    this.group.add(this.facets);
    const radius = 0.003 * this.size;
    this.cables = this.rods(this.strings.flatMap((q) => [quads[4 * q], quads[4 * q + 1]]), radius);
  }

  // Creases are thinner than their radius where they are short.
  makeCreases(radius) {
    const { creases, quads, positions } = this.data, ends = creases.flatMap((crease) => Array.from(crease.corners, (k) => quads[k]));
    this.creaseOf = creases.flatMap((crease, k) => Array(crease.corners.length / 2).fill(k));  // crease of each rod
    let length = 0;
    for (let k = 0; k < ends.length; k += 2) {
      length += Math.hypot(...[0, 1, 2].map((axis) => this.step[axis] * (positions[3 * ends[k] + axis] - positions[3 * ends[k + 1] + axis])));
    }
    this.creases = this.rods(ends, Math.min(radius, (0.05 * length) / creases.length || radius));
  }

  rods(ends, radius) {
    const rods = new Rods(ends, radius);
    this.group.add(rods.mesh);
    return rods;
  }

  // Edges of facets, as two lists of ends: edges of one facet of a part, and edges inside of a part.
  edges(facets) {
    const { quads } = this.data, seen = new Map();
    for (const q of facets) {
      for (let k = 0; k < 4; k++) {
        const a = quads[4 * q + k], b = quads[4 * q + ((k + 1) % 4)];
        if (a === b) continue;
        const key = Math.min(a, b) * this.vertices + Math.max(a, b), before = seen.get(key);
        if (before === undefined) seen.set(key, this.partOf[q]);
        else if (before === this.partOf[q]) seen.set(key, -1);
      }
    }
    const outline = [], inside = [];
    for (const [key, part] of seen) (part === -1 ? inside : outline).push(Math.floor(key / this.vertices), key % this.vertices);
    return { outline, inside };
  }

  // Outlines of parts without creases, which are drawn as rods; lines of the mesh; outline of the part that is selected.
  makeLines() {
    const { outline, inside } = this.edges(this.solid), { ends } = this.creases, rods = new Set();
    const keyOf = (list, k) => Math.min(list[k], list[k + 1]) * this.vertices + Math.max(list[k], list[k + 1]);
    for (let k = 0; k < ends.length; k += 2) rods.add(keyOf(ends, k));
    this.outline = this.segments(0x303030, 1);
    this.edgesAtRest = { userData: { vertices: outline } };
    this.setLines(this.outline, outline.filter((v, k) => !rods.has(keyOf(outline, k - (k % 2)))));
    this.chosen = this.segments(0xffb000, 1);
    this.chosen.material.depthTest = false;
    this.chosen.renderOrder = 2;
    this.setLines(this.chosen, []);
    this.mesh = this.segments(0x606060, 0.5);
    this.setLines(this.mesh, inside);
  }

  segments(colour, opacity) {
    const lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour, transparent: opacity < 1, opacity }));
    lines.frustumCulled = false;
    this.group.add(lines);
    return lines;
  }

  setLines(lines, list) {
    lines.geometry.dispose();
    lines.geometry = new THREE.BufferGeometry();
    lines.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * list.length), 3).setUsage(THREE.DynamicDrawUsage));
    lines.userData.vertices = Uint32Array.from(list);
  }

  instances(geometry, count) {
    const mesh = new THREE.InstancedMesh(geometry, new THREE.MeshPhongMaterial({ color: 0xffffff, shininess: 8, specular: 0x111111 }), Math.max(count, 1));
    mesh.count = count;
    mesh.frustumCulled = false;
    for (let k = 0; k < count; k++) mesh.setColorAt(k, new THREE.Color(0x222222));
    this.group.add(mesh);
    return mesh;
  }

  makeObstacles() {
    this.moving = [];
    for (const obstacle of this.data.obstacles) {
      const index = [];
      let first = 0;
      for (const sides of obstacle.sides) {
        for (let k = 1; k + 1 < sides; k++) index.push(first, first + k, first + k + 1);
        first += sides;
      }
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(obstacle.positions.slice(0, 3 * first), 3));
      geometry.setIndex(index);
      const opacity = obstacle.plane ? 0.25 : 0.6;
      const material = new THREE.MeshPhongMaterial({ color: 0x888888, transparent: true, opacity, side: THREE.DoubleSide, flatShading: true, depthWrite: !obstacle.plane });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.frustumCulled = false;
      this.group.add(mesh);
      if (obstacle.positions.shape[0] > 1) this.moving.push({ mesh, positions: obstacle.positions, length: 3 * first });
    }
  }

  makeRest() {
    this.readPoints(0);
    const faces = new THREE.BufferGeometry();
    const position = new Float32Array(12 * this.solid.length);
    this.fillFacets(position);
    faces.setAttribute("position", new THREE.BufferAttribute(position, 3));
    faces.setIndex(this.facets.geometry.index);
    const material = new THREE.MeshBasicMaterial({ color: 0x8899aa, transparent: true, opacity: 0.22, side: THREE.DoubleSide, depthWrite: false });
    const lines = this.outline.clone();
    lines.geometry = new THREE.BufferGeometry();
    lines.geometry.setAttribute("position", new THREE.BufferAttribute(this.linePoints(this.edgesAtRest), 3));
    lines.material = new THREE.LineBasicMaterial({ color: 0x667788 });
    this.rest = new THREE.Group();
    this.rest.add(new THREE.Mesh(faces, material), lines);
    this.restPoints = this.points.slice();
    this.group.add(this.rest);
  }

  // ---------------------------------------------------------------------------------------------- a shape

  readPoints(at) {
    const levels = this.data.positions, n = 3 * this.vertices;
    const i = Math.min(Math.floor(at), this.frames - 1), j = Math.min(i + 1, this.frames - 1), w = at - i;
    const a = i * n, b = j * n, out = this.points, low = this.low, step = this.step;
    for (let k = 0, axis = 0; k < n; k++) {
      const first = levels[a + k];
      out[k] = low[axis] + step[axis] * (first + w * (levels[b + k] - first));
      axis = axis === 2 ? 0 : axis + 1;
    }
  }

  fillFacets(out) {
    const { quads } = this.data, points = this.points;
    let to = 0;
    for (const q of this.solid) {
      for (let k = 0; k < 4; k++) {
        const from = 3 * quads[4 * q + k];
        out[to++] = points[from]; out[to++] = points[from + 1]; out[to++] = points[from + 2];
      }
    }
  }

  linePoints(lines) {
    const list = lines.userData.vertices, out = new Float32Array(3 * list.length), points = this.points;
    for (let k = 0; k < list.length; k++) {
      const from = 3 * list[k];
      out[3 * k] = points[from]; out[3 * k + 1] = points[from + 1]; out[3 * k + 2] = points[from + 2];
    }
    return out;
  }

  show(at) {
    this.at = Math.max(0, Math.min(this.frames - 1, at));
    this.mode = null;
    this.readPoints(this.at);
    this.update();
  }

  // Natural mode about its record, with a phase in rad.
  showMode(mode, phase) {
    this.mode = mode;
    const records = this.data.records;
    this.at = nearestIndex(records, mode.record);
    this.readPoints(this.at);
    const { shape } = mode, factor = 0.12 * this.size * Math.sin(phase), step = (shape.high - shape.low) / 65534;
    let most = 1e-30;
    for (let k = 0; k < shape.length; k++) most = Math.max(most, Math.abs(shape.low + step * shape[k]));
    for (let k = 0; k < shape.length; k++) this.points[k] += (factor / most) * (shape.low + step * shape[k]);
    this.update();
  }

  update() {
    const { position } = this.facets.geometry.attributes;
    this.fillFacets(position.array);
    position.needsUpdate = true;
    this.shaded = false;
    this.linesMoved = true;
    for (const one of this.moving) {
      const i = Math.min(Math.round(this.at), one.positions.shape[0] - 1);
      one.mesh.geometry.attributes.position.array.set(one.positions.subarray(i * one.length, (i + 1) * one.length));
      one.mesh.geometry.attributes.position.needsUpdate = true;
    }
    this.placePoints(this.joints, this.data.joints, this.options.joints, () => 1);
    const most = Math.max(...this.data.contacts.map((c) => c.force.reduce((a, b) => Math.max(a, b), 0)), 1e-30);
    this.placePoints(this.contacts, this.data.contacts, this.options.contacts, (contact) => {
      const force = between(contact.force, this.at);
      return force > 1e-4 * most ? 0.5 + 1.2 * Math.sqrt(force / most) : 0;
    });
    this.placeArrows();
    this.rest.visible = this.options.rest !== "none";
    this.rest.position.set(0, this.options.rest === "beside" ? 1.15 * (this.data.positions.high[1] - this.low[1]) + 0.1 * this.size : 0, 0);
    this.paint(false);
    this.request();
  }

  chosenPart() {
    return this.selected && this.selected.kind === "part" && this.data.parts.length > 1 ? this.selected.index : -1;
  }

  // Select an object: its outline is drawn in front of all.
  choose(object) {
    this.selected = object;
    const part = this.chosenPart();
    this.setLines(this.chosen, part < 0 ? [] : this.edges(this.solid.filter((q) => this.partOf[q] === part)).outline);
    this.update();
  }

  vertex(k) {
    return new THREE.Vector3(this.points[3 * k], this.points[3 * k + 1], this.points[3 * k + 2]);
  }

  placePoints(mesh, items, visible, scale) {
    mesh.visible = visible && this.mode === null;
    items.forEach((item, k) => {
      const place = this.inSpace(item.place), size = Number.isFinite(place.x) ? scale(item) : 0;
      mesh.setMatrixAt(k, new THREE.Matrix4().compose(size ? place : this.centre, new THREE.Quaternion(), new THREE.Vector3(size, size, size)));
      mesh.instanceMatrix.needsUpdate = true;
    });
  }

  // Vector (frames, 3) at the shape that is shown.
  inSpace(values) {
    const i = Math.min(Math.floor(this.at), this.frames - 1), j = Math.min(i + 1, this.frames - 1), w = this.at - i;
    const one = (k) => values[3 * i + k] + (w ? w * (values[3 * j + k] - values[3 * i + k]) : 0);
    return new THREE.Vector3(one(0), one(1), one(2));
  }

  placeArrows() {
    const shown = this.options.arrows && this.mode === null;
    this.shafts.visible = this.heads.visible = shown;
    const colours = { drive: 0xd55e00, reaction: 0x0072b2, joint: 0x009e73 };
    let k = 0;
    for (const arrow of this.data.arrows) {
      const vector = this.inSpace(arrow.vector), place = this.inSpace(arrow.place);
      const hidden = arrow.kind === "joint" && !this.options.jointForces;
      const length = (0.28 * this.size * this.options.arrowLength * vector.length()) / (this.strongest[arrow.kind] || 1);
      if (hidden || !Number.isFinite(length) || !Number.isFinite(place.x) || length < 1e-3 * this.size) continue;
      const direction = vector.clone().normalize(), one = new THREE.Vector3(1, 1, 1);
      const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction);
      this.shafts.setMatrixAt(k, new THREE.Matrix4().compose(place.clone().addScaledVector(direction, 0.5 * length), turn, new THREE.Vector3(1, length, 1)));
      this.heads.setMatrixAt(k, new THREE.Matrix4().compose(place.clone().addScaledVector(direction, length), turn, one));
      for (const mesh of [this.shafts, this.heads]) mesh.setColorAt(k, new THREE.Color(colours[arrow.kind]));
      k++;
    }
    for (const mesh of [this.shafts, this.heads]) {
      mesh.count = k;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  // ---------------------------------------------------------------------------------------------- colours

  field() {
    return this.data.colours.find((one) => one.name === this.options.colour) || null;
  }

  // Value of facet or crease k of a field at the shape that is shown, in the unit of the page; NaN without value.
  fieldValue(field, k) {
    const [rows, count] = field.values.shape, { low, high } = field.values;
    const i = Math.min(Math.floor(this.at), rows - 1), j = Math.min(i + 1, rows - 1);
    const a = field.values[i * count + k], b = field.values[j * count + k];
    if (a === 65535 || b === 65535) return NaN;
    return field.factor * (low + ((high - low) / 65534) * (a + (this.at - i) * (b - a)) );
  }

  displacement(quad) {
    let sum = 0;
    for (let axis = 0; axis < 3; axis++) {
      let moved = 0;
      for (let k = 0; k < 4; k++) {
        const v = 3 * this.data.quads[4 * quad + k] + axis;
        moved += 0.25 * (this.points[v] - this.restPoints[v]);
      }
      sum += moved * moved;
    }
    return 1e3 * Math.sqrt(sum);
  }

  // Range of the colours: [low, high, name of the map]; null for colours of parts.
  range() {
    const field = this.field();
    if (this.options.colour === "displacement") {
      if (this.most === undefined || this.mostOf !== this.data) {
        const high = this.data.positions.high;
        this.mostOf = this.data;
        this.most = 0;
        for (let f = 0; f < this.frames; f += Math.max(1, Math.floor(this.frames / 12))) this.most = Math.max(this.most, this.farthest(f));
        this.most = Math.max(this.most, this.farthest(this.frames - 1), 1e-9 * Math.max(...high.map(Math.abs)), 1e-12);
      }
      return [0, this.mode ? 120 * this.size : this.most, "viridis"];
    }
    if (!field) return null;
    const low = field.factor * field.robust[0], high = field.factor * field.robust[1];
    const most = Math.max(Math.abs(low), Math.abs(high)) || 1;
    return field.signed ? [-most, most, "RdBu_r"] : [Math.min(low, high), Math.max(low, high) > low ? high : low + 1, "viridis"];
  }

  farthest(frame) {
    const n = 3 * this.vertices, { positions } = this.data;
    let most = 0;
    for (let k = 0; k < n; k += 3) {
      let sum = 0;
      for (let axis = 0; axis < 3; axis++) sum += (this.step[axis] * (positions[frame * n + k + axis] - positions[k + axis])) ** 2;
      most = Math.max(most, sum);
    }
    return 1e3 * Math.sqrt(most);
  }

  colourOf(value, range) {
    if (!Number.isFinite(value)) return WHITE;
    const map = this.maps[range[2]], at = Math.max(0, Math.min(1, (value - range[0]) / (range[1] - range[0] || 1))) * (map.length - 1);
    const i = Math.min(Math.floor(at), map.length - 2), w = at - i, a = map[i], b = map[i + 1];
    return [a.r + w * (b.r - a.r), a.g + w * (b.g - a.g), a.b + w * (b.b - a.b)];
  }

  // Light of plane facets, from a lamp beside the camera; `away` is the direction to the camera.
  shade(away) {
    if (this.shaded && this.shadedFrom.equals(this.camera.position)) return;
    this.shaded = true;
    this.shadedFrom = this.camera.position.clone();
    const { position, color } = this.facets.geometry.attributes, p = position.array, out = color.array, { base } = this;
    const lamp = away.clone().add(new THREE.Vector3(0.3, 0, 0.4)).normalize(), eye = this.camera.position;
    for (let k = 0, at = 0; at < p.length; k += 3, at += 12) {
      const ax = p[at + 6] - p[at], ay = p[at + 7] - p[at + 1], az = p[at + 8] - p[at + 2];  // both diagonals
      const bx = p[at + 9] - p[at + 3], by = p[at + 10] - p[at + 4], bz = p[at + 11] - p[at + 5];
      const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
      const side = x * (eye.x - p[at]) + y * (eye.y - p[at + 1]) + z * (eye.z - p[at + 2]) < 0 ? -1 : 1;
      const along = (side * (x * lamp.x + y * lamp.y + z * lamp.z)) / (Math.sqrt(x * x + y * y + z * z) || 1);
      const light = 0.66 + 0.42 * Math.max(0, along);
      const r = light * base[k], g = light * base[k + 1], b = light * base[k + 2];
      for (let c = at; c < at + 12; c += 3) { out[c] = r; out[c + 1] = g; out[c + 2] = b; }
    }
    color.needsUpdate = true;
  }

  // Colour everything; `again` is false if only the shape has changed.
  paint(again = true) {
    const range = this.range(), field = this.field();
    if (!again && !range && this.painted === this.options.colour) return;
    this.painted = this.options.colour;
    const onQuads = this.options.colour === "displacement" || (field && field.on === "quads");
    const value = (q) => (field ? this.fieldValue(field, q) : this.displacement(q));
    const out = this.base;
    const parts = this.data.parts.length;
    const chosen = this.chosenPart();
    const partColour = (part) => {
      const one = parts > 1 ? this.palette[part % 6] : this.palette[5];
      return field && field.on === "creases" ? [0.72, 0.74, 0.77] : [one.r, one.g, one.b];
    };
    this.solid.forEach((q, k) => {
      let [r, g, b] = onQuads ? this.colourOf(value(q), range) : partColour(this.partOf[q]);
      if (this.partOf[q] === chosen && !onQuads) [r, g, b] = [r * 0.6 + 0.4, g * 0.6 + 0.36, b * 0.6 + 0.1];
      out[3 * k] = r; out[3 * k + 1] = g; out[3 * k + 2] = b;
    });
    this.shaded = false;
    this.strings.forEach((q, k) => {
      const [r, g, b] = onQuads ? this.colourOf(value(q), range) : partColour(this.partOf[q]);
      this.cables.paint(k, [r, g, b]);
    });
    const dark = this.dark ? 0xdddddd : 0x222222;
    const isChosen = (kind, k) => this.selected && this.selected.kind === kind && this.selected.index === k;
    const tint = (mesh, items, kind, usual) => items.forEach((item, k) => mesh.setColorAt(k, new THREE.Color(isChosen(kind, k) ? 0xffc107 : usual)));
    const onCreases = field && field.on === "creases", plain = new THREE.Color(dark).toArray();
    for (let k = 0; k < this.creases.count; k++) {
      const crease = this.creaseOf[k], colour = onCreases ? this.colourOf(this.fieldValue(field, crease), range) : plain;
      this.creases.paint(k, isChosen("crease", crease) ? [1, 0.757, 0.027] : colour);
    }
    tint(this.joints, this.data.joints, "joint", 0x009e73);
    tint(this.contacts, this.data.contacts, "contact", 0xcc3311);
    for (const mesh of [this.joints, this.contacts]) if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
  }
}
