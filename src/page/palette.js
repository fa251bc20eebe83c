// The colours of the drawing, as the style sheet has them for light and dark.

import { Color } from './vendor/three.js';

const NAMES = ['route', 'best', 'mean', 'bound', 'core', 'zone', 'start', 'target', 'fault', 'sky', 'contour', 'edge', 'ink', 'faint', 'line',
  'ground', 'skirt', 'band', 'raised', 'ramp-0', 'ramp-1', 'ramp-2', 'ramp-3', 'ramp-4', 'other-0', 'other-1', 'other-2', 'other-3', 'other-4'];

/** The colours in force, as CSS has them, by name. */
export function palette() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** How many plans beside the first have a colour of their own. */
export const OTHERS = 5;

/** Calls `change` when light turns to dark or back. */
export function onSchemeChange(change) {
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', change);
}

/** The colour of a share from low to high ground. */
export function ramp(colours) {
  const stops = [0, 1, 2, 3, 4].map((at) => new Color(colours[`ramp-${at}`]));
  return (share, into) => {
    const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
    const low = Math.min(Math.floor(place), stops.length - 2);
    return into.copy(stops[low]).lerp(stops[low + 1], place - low);
  };
}
