// Routes in the scene: lines of one width on the screen, seen through hills faintly; dots; a curtain down to the ground.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, DoubleSide, Group, Line, Line2, LineBasicMaterial, LineGeometry, LineMaterial, Mesh,
  MeshBasicMaterial, Points, PointsMaterial,
} from './vendor/three.js';

/** A route's line. Its buffers are used again as long as the number of points stays. */
export class RouteLine {
  group = new Group();
  #geometry = new LineGeometry();
  #count = 0;

  constructor(name, color, width) {
    // After all that is seen through, whether it lies behind or before: what hides it has left its depth.
    this.near = new LineMaterial({ color, linewidth: width, transparent: true });
    this.through = new LineMaterial({ color, linewidth: Math.max(1, width - 1.5), transparent: true, opacity: 0.5, depthTest: false, depthWrite: false });
    for (const [material, order] of [[this.through, 6], [this.near, 7]]) {
      const line = new Line2(this.#geometry, material);
      line.frustumCulled = false;
      line.renderOrder = order;
      this.group.add(line);
    }
    this.group.name = name;
    this.group.visible = false;
  }

  get points() { return this.group.visible ? this.#count : 0; }

  set(points) {
    this.group.visible = Boolean(points && points.length > 1);
    if (!this.group.visible) return;
    if (points.length === this.#count) {
      const { array } = this.#geometry.attributes.instanceStart.data;
      for (let k = 0; k + 1 < points.length; k += 1) {
        const [a, b] = [points[k], points[k + 1]];
        array.set([a.x, a.y, a.z, b.x, b.y, b.z], k * 6);
      }
      this.#geometry.attributes.instanceStart.data.needsUpdate = true;
      return;
    }
    this.#geometry.dispose();
    this.#geometry = new LineGeometry();
    this.#geometry.setPositions(points.flatMap(({ x, y, z }) => [x, y, z]));
    for (const line of this.group.children) line.geometry = this.#geometry;
    this.#count = points.length;
  }

  /** `through` is how much of it is seen behind what hides it, from 0 to 1. */
  paint(color, through = 0.5) {
    this.near.color.set(color);
    this.through.color.set(color);
    this.through.opacity = through;
  }

  dispose() {
    this.#geometry.dispose();
    this.near.dispose();
    this.through.dispose();
    this.group.removeFromParent();
  }
}

/** The routes that were best before, fainter the older: how the swarm came here. */
export class Trail {
  group = new Group();
  #most = 24;
  #lines = [];

  constructor() {
    this.group.name = 'trail';
  }

  clear() {
    for (const line of this.#lines) {
      line.geometry.dispose();
      line.material.dispose();
    }
    this.#lines = [];
    this.group.clear();
  }

  add(points, color) {
    let line;
    if (this.#lines.length === this.#most) {
      line = this.#lines.shift();
      line.geometry.dispose();
      line.geometry = new BufferGeometry();
    } else {
      line = new Line(new BufferGeometry(), new LineBasicMaterial({ transparent: true, depthWrite: false, depthTest: false }));
      line.frustumCulled = false;
      line.renderOrder = 5;
      this.group.add(line);
    }
    const positions = new Float32Array(points.flatMap(({ x, y, z }) => [x, y, z]));
    line.geometry.setAttribute('position', new BufferAttribute(positions, 3));
    this.#lines.push(line);
    this.#lines.forEach((one, at) => {
      one.material.color.set(color);
      one.material.opacity = 0.08 + 0.32 * ((at + 1) / this.#lines.length) ** 2;
    });
  }
}

/** From a route straight down to the ground. */
export class Curtain {
  constructor() {
    const material = new MeshBasicMaterial({ transparent: true, opacity: 0.16, side: DoubleSide, depthWrite: false });
    this.mesh = new Mesh(new BufferGeometry(), material);
    this.mesh.name = 'curtain';
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 5;
    this.mesh.visible = false;
  }

  set(points, ground, color) {
    this.mesh.visible = Boolean(points && points.length > 1);
    if (!this.mesh.visible) return;
    const positions = new Float32Array(points.length * 6);
    const faces = [];
    points.forEach(({ x, y, z }, at) => {
      positions.set([x, y, z, x, y, Math.min(z, ground.at(x, y))], at * 6);
      if (at) faces.push(2 * at - 2, 2 * at - 1, 2 * at, 2 * at - 1, 2 * at + 1, 2 * at);
    });
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.geometry.setAttribute('position', new BufferAttribute(positions, 3));
    this.mesh.geometry.setIndex(faces);
    this.mesh.material.color.set(color);
  }
}

let disc = null;
function discTexture() {
  if (disc) return disc;
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#fff';
  pen.beginPath();
  pen.arc(32, 32, 30, 0, 7);
  pen.fill();
  disc = new CanvasTexture(canvas);
  return disc;
}

/** Round dots of one size on the screen, rimmed. */
export class Dots {
  group = new Group();
  #count = 0;
  #geometry = new BufferGeometry();

  constructor(name, size, over = true) {
    this.group.name = name;
    const dot = (points) => new PointsMaterial({ map: discTexture(), size: points, sizeAttenuation: false, transparent: true, alphaTest: 0.3, depthTest: !over, depthWrite: false });
    this.rim = new Points(this.#geometry, dot(size));
    this.fill = new Points(this.#geometry, dot(size * 0.55));
    [this.rim, this.fill].forEach((points, at) => {
      points.frustumCulled = false;
      points.renderOrder = 8 + at;
      this.group.add(points);
    });
  }

  get count() { return this.#count; }

  set(places, rim, fill) {
    this.#count = places.length;
    this.group.visible = places.length > 0;
    this.#geometry.dispose();
    this.#geometry = new BufferGeometry();
    this.#geometry.setAttribute('position', new BufferAttribute(new Float32Array(places.flatMap(({ x, y, z }) => [x, y, z])), 3));
    this.rim.geometry = this.fill.geometry = this.#geometry;
    this.rim.material.color.set(rim);
    this.fill.material.color.set(fill);
  }
}
