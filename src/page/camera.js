// The buttons of the camera, and how high heights are drawn.

import { by, el } from './dom.js';

const TURN = Math.PI / 12;

/** Puts them under the scene of `world`. Returns how many times as high the heights of a ground are drawn, and says it there. */
export function cameraOf(world) {
  const times = el('select', { id: 'exaggeration', 'aria-label': 'Heights are drawn', title: 'Heights', onchange: () => { world.exaggeration = Number(times.value); } },
    [1, 2, 3, 5].map((value) => el('option', { value }, `heights × ${value}`)));
  by('camera').append(times,
    el('button', { type: 'button', onclick: () => world.look('oblique') }, 'Oblique'),
    el('button', { type: 'button', onclick: () => world.look('above') }, 'Above'),
    el('button', { type: 'button', 'aria-label': 'Nearer', onclick: () => world.zoom(0.8) }, '+'),
    el('button', { type: 'button', 'aria-label': 'Farther', onclick: () => world.zoom(1.25) }, '−'),
    el('button', { type: 'button', 'aria-label': 'Turn left', title: 'Turn left', onclick: () => world.turn(-TURN) }, '⟲'),
    el('button', { type: 'button', 'aria-label': 'Turn right', title: 'Turn right', onclick: () => world.turn(TURN) }, '⟳'));
  // Low hills under a wide sky look flat; they are drawn higher, and the box says so.
  return (ground, ceiling) => {
    const width = Math.max(ground.extent.max.x - ground.extent.min.x, ground.extent.max.y - ground.extent.min.y);
    const wanted = (0.2 * width) / Math.max(ceiling - ground.least, 1);
    const value = wanted < 1.5 ? 1 : wanted < 2.5 ? 2 : wanted < 4 ? 3 : 5;
    times.value = String(value);
    return value;
  };
}
