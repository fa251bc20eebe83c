// What stands still, drawn once and shown again: ground and threats as a picture with its depths, so that a route that
// changes is all that has to be drawn anew. For where the processor draws.

import { BufferAttribute, BufferGeometry, DepthTexture, FramebufferTexture, Mesh, ShaderMaterial, Vector2, WebGLRenderTarget } from './vendor/three.js';

const VERTEX = 'void main() { gl_Position = vec4(position, 1.0); }';
// Colours are taken as they were on the canvas, depths as they were behind it: pixel by pixel.
const FRAGMENT = `
uniform highp sampler2D picture;
uniform highp sampler2D depths;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  gl_FragColor = texelFetch(picture, at, 0);
  gl_FragDepth = texelFetch(depths, at, 0).r;
}`;

/** A picture of part of a scene. Its `mesh` belongs into the scene; the picture is seen where that is visible. */
export class Backdrop {
  #uniforms = { picture: { value: null }, depths: { value: null } };
  #depths = null;
  #size = new Vector2();

  constructor() {
    // One triangle that is larger than the canvas.
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.mesh = new Mesh(geometry, new ShaderMaterial({ uniforms: this.#uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT }));
    this.mesh.name = 'backdrop';
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = -1;
    this.mesh.visible = false;
  }

  /** Takes the picture of what `draw` draws. */
  take(renderer, draw) {
    this.#fit(renderer.getDrawingBufferSize(new Vector2()));
    this.mesh.visible = false;
    draw();
    renderer.copyFramebufferToTexture(this.#uniforms.picture.value);
    renderer.setRenderTarget(this.#depths);
    draw();
    renderer.setRenderTarget(null);
  }

  /** The context that it was drawn in is gone. */
  forget() {
    this.#size.set(0, 0);
    this.#uniforms.picture.value?.dispose();
    this.#depths?.depthTexture.dispose();
    this.#depths?.dispose();
    this.#depths = this.#uniforms.picture.value = this.#uniforms.depths.value = null;
    this.mesh.visible = false;
  }

  #fit(size) {
    if (this.#size.equals(size)) return;
    this.forget();
    this.#size.copy(size);
    this.#depths = new WebGLRenderTarget(size.x, size.y, { depthTexture: new DepthTexture(size.x, size.y) });
    this.#uniforms.picture.value = new FramebufferTexture(size.x, size.y);
    this.#uniforms.depths.value = this.#depths.depthTexture;
  }
}
