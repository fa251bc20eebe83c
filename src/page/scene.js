// The scene: ground, threats, ends and routes, seen by one camera; drawn when something has changed, and only then.

import {
  Color, Group, OrbitControls, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from './vendor/three.js';
import { Backdrop } from './backdrop.js';
import { calmly } from './dom.js';
import { drawnBySoftware } from './graphics.js';
import { Labels } from './labels.js';
import { onSchemeChange, palette } from './palette.js';
import { Relief } from './relief.js';
import { Curtain, Dots, RouteLine, Trail } from './routes.js';
import { Volumes } from './volumes.js';

const VIEWS = { oblique: new Vector3(-0.26, -0.8, 0.78), above: new Vector3(0, -0.001, 1) };

/** Of the pixels of the screen, where the processor draws and the whole is in motion. */
const COARSE = 0.6;
/** So many frames one after another in which the whole has changed, each so soon after the one before, are a motion. */
const RUN = 3;
const SOON_MS = 250;

export class World {
  #root = new Group();
  /** What only an edit changes, and what a search does. */
  #standing = new Group();
  #changing = new Group();
  #backdrop = new Backdrop();
  #scene = new Scene();
  #camera = new PerspectiveCamera(38, 1, 1, 1e6);
  #relief = new Relief();
  #volumes = new Volumes();
  #trail = new Trail();
  #curtain = new Curtain();
  #routes = new Map();
  #waypoints = new Dots('waypoints', 8);
  #mark = new Dots('mark', 15);
  #faults = new Dots('faults', 20);
  #handles = new Dots('handles', 13);
  /** Of a polygon that is being drawn: the sides that it has, and those that it would get. */
  #sketch = { sides: new RouteLine('sides', '#ffffff', 3.5), band: new RouteLine('band', '#ffffff', 2) };
  #ends = { start: new Dots('start', 16), target: new Dots('target', 16) };
  #raycaster = new Raycaster();
  #asked = false;
  #frames = { count: 0, ms: 0 };
  #show = null;
  #view = 'oblique';
  #ratio = Math.min(devicePixelRatio, drawnBySoftware() ? 1 : 2);
  /** Frames since the whole has changed last; how many did so one after another; when the last one was. */
  #unstirred = 0;
  #run = 0;
  #stirred = -Infinity;
  #rest = calmly(SOON_MS, () => {
    this.#run = 0;
    if (this.renderer.getPixelRatio() !== this.#ratio) this.#stir();
  });

  /** Throws where the browser has no WebGL. */
  constructor(canvas, labels) {
    this.canvas = canvas;
    this.labels = new Labels(labels);
    this.renderer = new WebGLRenderer({ canvas, antialias: !drawnBySoftware(), powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(this.#ratio);
    this.#camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.#camera, canvas);
    this.controls.maxPolarAngle = Math.PI / 2 - 0.02;
    this.controls.zoomToCursor = true;
    this.controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.controls.addEventListener('change', () => this.#stir());
    this.#standing.add(this.#relief.group, this.#volumes.group);
    this.#changing.add(this.#trail.group, this.#curtain.mesh, this.#waypoints.group, this.#mark.group, this.#faults.group, this.#sketch.sides.group, this.#sketch.band.group, this.#handles.group, this.#ends.start.group, this.#ends.target.group);
    this.#root.add(this.#standing, this.#changing);
    this.#scene.add(this.#root, this.#backdrop.mesh);
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
    onSchemeChange(() => {
      this.colours = palette();
      if (this.#show) this.#drawGround();
      this.repaint?.();
    });
    this.colours = palette();
    // Tablets take the context from a page that is not in sight, and give it a new one.
    canvas.addEventListener('webglcontextlost', () => {
      this.#letGo();
      this.lapsed?.(true);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.lapsed?.(false);
      this.#stir();
    });
    this.#resize();
  }

  /** Lets go of all that was in a context that is lost: to take it out of the next would be wrong, for it never was there. */
  #letGo() {
    this.#backdrop.forget();
    this.#scene.traverse((node) => {
      node.geometry?.dispose();
      node.material?.map?.dispose();
      node.material?.dispose();
      if (node.isInstancedMesh) node.dispose();
    });
  }

  get exaggeration() { return this.#root.scale.z; }
  set exaggeration(times) {
    this.#root.scale.z = times;
    this.#stir();
  }

  get ground() { return this.#show?.ground ?? null; }

  /** Ground and threats, in metres of a frame; `anew` turns the camera to them. */
  show(ground, threats, ceiling, anew) {
    const same = this.#show?.ground === ground;
    this.#show = { ground, threats, ceiling };
    if (!same) this.#drawGround();
    else this.#volumes.draw(threats, ground, this.colours);
    if (anew) this.look(this.#view);
    this.#stir();
  }

  #drawGround() {
    const { ground, threats } = this.#show;
    this.#scene.background = new Color(this.colours.sky);
    this.#relief.draw(ground, this.colours);
    this.#volumes.draw(threats, ground, this.colours);
    this.#stir();
  }

  /** From one of the places that the camera has. */
  look(view) {
    this.#view = view;
    if (!this.#show) return;
    const { ground, ceiling } = this.#show;
    const { min, max } = ground.extent;
    const size = new Vector3(max.x - min.x, max.y - min.y, (ceiling - ground.least) * this.exaggeration);
    const middle = new Vector3((min.x + max.x) / 2, (min.y + max.y) / 2, (ground.least + (ceiling - ground.least) * 0.3) * this.exaggeration);
    // As near as lets all eight corners of the box be seen.
    const away = VIEWS[view].clone().normalize();
    const right = new Vector3().crossVectors(new Vector3(0, 0, 1), away).normalize();
    const up = new Vector3().crossVectors(away, right);
    const tan = Math.tan((this.#camera.fov * Math.PI) / 360);
    let distance = 0;
    for (let corner = 0; corner < 8; corner += 1) {
      const at = new Vector3(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.7 : -0.3).multiply(size);
      const depth = at.dot(away);
      distance = Math.max(distance, Math.abs(at.dot(up)) / tan + depth, Math.abs(at.dot(right)) / (tan * this.#camera.aspect) + depth);
    }
    distance *= 1.03;
    this.#camera.near = distance / 200;
    this.#camera.far = distance * 20;
    this.#camera.position.copy(middle).addScaledVector(away, distance);
    this.#camera.updateProjectionMatrix();
    this.controls.target.copy(middle);
    this.controls.minDistance = distance / 60;
    this.controls.maxDistance = distance * 4;
    this.controls.update();
    this.#stir();
  }

  /** Nearer for less than 1. */
  zoom(factor) {
    this.#camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.wake();
  }

  /** Round the middle by an angle, seen from above; what pointers do by dragging. */
  turn(angle) {
    this.#camera.position.sub(this.controls.target).applyAxisAngle(this.#camera.up, angle).add(this.controls.target);
    this.controls.update();
    this.wake();
  }

  /** The lines of routes by name: `{points, color, width, through}`; those not named are taken away. */
  routes(lines) {
    for (const [name, line] of this.#routes) {
      if (!lines.has(name)) {
        line.dispose();
        this.#routes.delete(name);
      }
    }
    for (const [name, { points, color, width, through }] of lines) {
      let line = this.#routes.get(name);
      if (!line) {
        line = new RouteLine(name, color, width);
        this.#routes.set(name, line);
        this.#changing.add(line.group);
      }
      line.set(points);
      line.paint(color, through);
    }
    this.wake();
  }

  /** Points where the route that is in front bends, and its shadow on the ground. */
  dress(waypoints, points, color) {
    this.#waypoints.set(waypoints, color, '#ffffff');
    this.#curtain.set(points, this.ground, color);
    this.wake();
  }

  past(points, color) {
    if (points) this.#trail.add(points, color);
    else this.#trail.clear();
    this.wake();
  }

  /** One place, or none. */
  mark(place) {
    this.#mark.set(place ? [place] : [], this.colours.ink, this.colours.route);
    this.wake();
  }

  /** Places where something is wrong. */
  faults(places) {
    this.#faults.set(places, this.colours.fault, '#ffffff');
    this.wake();
  }

  /** Start and target, where they are known. */
  ends(places) {
    for (const [end, dots] of Object.entries(this.#ends)) dots.set(places[end] ? [places[end]] : [], '#ffffff', this.colours[end]);
    this.wake();
  }

  /** What can be dragged. */
  handles(places) {
    this.#handles.set(places, '#ffffff', this.colours.core);
    this.wake();
  }

  /** What is being drawn: `sides` and `band` as lines of places. */
  sketch(lines) {
    for (const [name, line] of Object.entries(this.#sketch)) {
      line.set(lines[name]);
      line.paint(this.colours.core, 0.8);
    }
    this.wake();
  }

  /** Where a place is on the screen, in pixels of the canvas; null behind the camera. */
  onScreen({ x, y, z }) {
    const at = new Vector3(x, y, z * this.exaggeration).project(this.#camera);
    if (at.z > 1) return null;
    const { clientWidth, clientHeight } = this.canvas;
    return { x: ((at.x + 1) / 2) * clientWidth, y: ((1 - at.y) / 2) * clientHeight };
  }

  /** The place on the ground below a pixel; null for the sky. */
  onGround(px, py) {
    const ground = this.ground;
    if (!ground) return null;
    const { origin, direction } = this.#ray(px, py);
    const k = this.exaggeration;
    const reach = this.#camera.far;
    const at = (t) => ({ x: origin.x + direction.x * t, y: origin.y + direction.y * t, z: (origin.z + direction.z * t) / k });
    const above = (t) => {
      const p = at(t);
      return p.z - ground.at(p.x, p.y);
    };
    // Only where the ray is between the lowest and the highest ground.
    const level = (z) => (z * k - origin.z) / direction.z;
    let [from, to] = direction.z < 0 ? [Math.max(0, level(ground.greatest + 1)), Math.min(reach, level(ground.least - 1))] : [0, 0];
    if (!(to > from)) return null;
    const steps = 600;
    const stride = (to - from) / steps;
    for (let n = 0; n < steps; n += 1) {
      if (above(from + stride) > 0) {
        from += stride;
        continue;
      }
      to = from + stride;
      for (let round = 0; round < 30; round += 1) {
        const half = (from + to) / 2;
        if (above(half) > 0) from = half;
        else to = half;
      }
      const found = at(to);
      const { min, max } = ground.extent;
      const inside = found.x >= min.x && found.x <= max.x && found.y >= min.y && found.y <= max.y;
      return inside ? { ...found, z: ground.at(found.x, found.y) } : null;
    }
    return null;
  }

  /** The threat below a pixel, as its index in the document; null for none. */
  threatAt(px, py) {
    const cores = this.#volumes.group.children.filter((child) => child.name === 'cores');
    this.#ray(px, py);
    const [hit] = this.#raycaster.intersectObjects(cores, false);
    if (!hit) return null;
    const { threats } = this.#show;
    if (hit.instanceId !== undefined) return threats.filter((threat) => threat.center)[hit.instanceId].index;
    const prisms = cores.filter((child) => !child.isInstancedMesh);
    return threats.filter((threat) => threat.ring)[prisms.indexOf(hit.object)].index;
  }

  #ray(px, py) {
    const { clientWidth, clientHeight } = this.canvas;
    this.#raycaster.setFromCamera(new Vector2((px / clientWidth) * 2 - 1, 1 - (py / clientHeight) * 2), this.#camera);
    return this.#raycaster.ray;
  }

  /** The view as a PNG, with its names, which are no part of the canvas. */
  async picture() {
    const canvas = document.createElement('canvas');
    this.copy(canvas);
    return new Promise((done) => { canvas.toBlob(done, 'image/png'); });
  }

  /** The view as it is, with its names, onto another canvas. */
  copy(canvas) {
    this.#run = 0;
    this.#unstirred = 0;
    this.#render();
    const { width, height, clientWidth } = this.canvas;
    Object.assign(canvas, { width, height });
    const pen = canvas.getContext('2d');
    pen.drawImage(this.canvas, 0, 0);
    pen.scale(width / clientWidth, width / clientWidth);
    this.labels.paint(pen, this.colours);
  }

  /** Draws at the next frame. */
  wake() {
    if (this.#asked) return;
    this.#asked = true;
    requestAnimationFrame(() => {
      this.#asked = false;
      this.#render();
    });
  }

  /** More has changed than a route. */
  #stir() {
    this.#unstirred = 0;
    this.wake();
  }

  #render() {
    if (this.renderer.getContext().isContextLost()) return;
    const start = performance.now();
    this.controls.update();
    if (drawnBySoftware()) this.#renderSparingly(start);
    else this.renderer.render(this.#scene, this.#camera);
    this.labels.place((place) => this.onScreen(place));
    this.#frames.count += 1;
    this.#frames.ms = performance.now() - start;
  }

  /** Coarser as long as all of it is in motion; and what stands still is drawn once only. */
  #renderSparingly(now) {
    if (this.#unstirred === 0) {
      this.#run = now - this.#stirred < SOON_MS ? this.#run + 1 : 1;
      this.#stirred = now;
      this.#rest();
    }
    const ratio = this.#run >= RUN ? COARSE : this.#ratio;
    if (this.renderer.getPixelRatio() !== ratio) {
      this.renderer.setPixelRatio(ratio);
      this.#unstirred = 0;
    }
    this.#relief.coarse = this.#volumes.coarse = ratio !== this.#ratio;
    const draw = () => this.renderer.render(this.#scene, this.#camera);
    if (this.#unstirred === 1) {
      this.#changing.visible = false;
      this.#standing.visible = true;
      this.#backdrop.take(this.renderer, draw);
      this.#changing.visible = true;
    }
    this.#backdrop.mesh.visible = this.#unstirred > 0;
    this.#standing.visible = this.#unstirred === 0;
    draw();
    this.#unstirred += 1;
  }

  #resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (!clientWidth || !clientHeight) return;
    const before = this.#camera.aspect;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.#camera.aspect = clientWidth / clientHeight;
    this.#camera.updateProjectionMatrix();
    if (Math.abs(before / this.#camera.aspect - 1) > 0.25) this.look(this.#view);
    this.#stir();
  }

  /** What is in the scene, for tests and for the curious. */
  inventory() {
    const mesh = this.ground?.mesh;
    return {
      ground: mesh ? { kind: 'mesh', columns: mesh.columns, rows: mesh.rows } : { kind: 'plane' },
      threats: this.#show?.threats.length ?? 0,
      routes: [...this.#routes].map(([name, line]) => ({ name, points: line.points, color: `#${line.near.color.getHexString()}` })),
      trail: this.#trail.group.children.length,
      ends: this.#ends.start.count + this.#ends.target.count,
      waypoints: this.#waypoints.count,
      mark: this.#mark.count,
      faults: this.#faults.count,
      handles: this.#handles.count,
      sketch: { sides: this.#sketch.sides.points, band: this.#sketch.band.points },
      backdrop: this.#backdrop.mesh.visible,
      memory: { ...this.renderer.info.memory },
      frames: { ...this.#frames },
    };
  }
}
