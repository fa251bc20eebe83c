// What the page draws with; nothing else of three.js is bundled.
export {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, DepthTexture, DoubleSide, FramebufferTexture, Group,
  InstancedMesh, Line, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial,
  PerspectiveCamera, Points, PointsMaterial, Raycaster, Scene, ShaderMaterial, ShapeUtils, Vector2, Vector3,
  WebGLRenderer, WebGLRenderTarget,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { Line2 } from 'three/addons/lines/Line2.js';
export { LineGeometry } from 'three/addons/lines/LineGeometry.js';
export { LineMaterial } from 'three/addons/lines/LineMaterial.js';
