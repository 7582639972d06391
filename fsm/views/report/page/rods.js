// Rods between vertices, drawn as ribbons towards the camera: two triangles each, where a cylinder has thirty.
"use strict";

class Rods {
  // `ends` has two numbers of vertices for each rod.
  constructor(ends, radius) {
    const count = ends.length / 2, geometry = new THREE.BufferGeometry(), index = new Uint32Array(6 * count);
    for (let k = 0; k < count; k++) index.set([4 * k, 4 * k + 1, 4 * k + 2, 4 * k, 4 * k + 2, 4 * k + 3], 6 * k);
    for (const name of ["position", "color"]) {
      geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(12 * count), 3).setUsage(THREE.DynamicDrawUsage));
    }
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide }));
    this.mesh.frustumCulled = false;
    Object.assign(this, { ends, radius, count });
  }

  // Place the ribbons in front of their lines, seen from the eye.
  aim(points, eye) {
    const { position } = this.mesh.geometry.attributes, out = position.array, { ends, radius } = this;
    for (let k = 0, to = 0; k < this.count; k++) {
      const a = 3 * ends[2 * k], b = 3 * ends[2 * k + 1];
      const dx = points[b] - points[a], dy = points[b + 1] - points[a + 1], dz = points[b + 2] - points[a + 2];
      let vx = eye.x - points[a] - 0.5 * dx, vy = eye.y - points[a + 1] - 0.5 * dy, vz = eye.z - points[a + 2] - 0.5 * dz;
      const far = radius / (Math.sqrt(vx * vx + vy * vy + vz * vz) || 1);
      vx *= far; vy *= far; vz *= far;
      let sx = dy * vz - dz * vy, sy = dz * vx - dx * vz, sz = dx * vy - dy * vx;
      const size = radius / (Math.sqrt(sx * sx + sy * sy + sz * sz) || 1);
      sx *= size; sy *= size; sz *= size;
      for (let corner = 0; corner < 4; corner++) {
        const from = corner === 0 || corner === 3 ? a : b, side = corner < 2 ? 1 : -1;
        out[to++] = points[from] + vx + side * sx;
        out[to++] = points[from + 1] + vy + side * sy;
        out[to++] = points[from + 2] + vz + side * sz;
      }
    }
    position.needsUpdate = true;
  }

  paint(k, [r, g, b]) {
    const { color } = this.mesh.geometry.attributes;
    for (let c = 12 * k; c < 12 * k + 12; c += 3) { color.array[c] = r; color.array[c + 1] = g; color.array[c + 2] = b; }
    color.needsUpdate = true;
  }

  // Rod whose line is within some pixels of a point of the canvas and not behind a distance; null if there is none.
  near(points, camera, x, y, box, front, pixels) {
    const place = (v) => {
      const w = v.project(camera);
      return [((w.x + 1) * box.width) / 2, ((1 - w.y) * box.height) / 2];
    };
    const vertex = (k) => new THREE.Vector3(points[3 * k], points[3 * k + 1], points[3 * k + 2]);
    let best = pixels, found = null;
    for (let k = 0; k < this.count; k++) {
      const a = vertex(this.ends[2 * k]), b = vertex(this.ends[2 * k + 1]);
      if (a.clone().lerp(b, 0.5).distanceTo(camera.position) > front + 0.5 * a.distanceTo(b)) continue;
      const p = place(a), q = place(b), along = [q[0] - p[0], q[1] - p[1]], length = along[0] ** 2 + along[1] ** 2 || 1;
      const t = Math.max(0, Math.min(1, ((x - p[0]) * along[0] + (y - p[1]) * along[1]) / length));
      const away = Math.hypot(x - p[0] - t * along[0], y - p[1] - t * along[1]);
      if (away < best) [best, found] = [away, k];
    }
    return found;
  }
}
