// The page on paper: the picture of the scene in place of the scene, for a canvas of WebGL prints as nothing.

import { by, el } from './dom.js';

/** Puts the picture there for as long as it is printed. */
export function onPrint(world) {
  if (!world) return;
  let picture = null;
  const clear = () => {
    picture?.remove();
    picture = null;
  };
  addEventListener('beforeprint', () => {
    clear();
    picture = el('canvas', { class: 'printed', role: 'img', 'aria-label': by('canvas').getAttribute('aria-label') });
    world.copy(picture);
    by('canvas').after(picture);
  });
  addEventListener('afterprint', clear);
}
