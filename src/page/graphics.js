// What the browser draws with: where no graphics processor does, less is drawn, so that it stays smooth.

let software = null;

/** Whether pixels are computed by the processor. */
export function drawnBySoftware() {
  software ??= found();
  return software;
}

function found() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const about = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
