// How high the ground is beneath a route: as the service measured it where it has, since the ground that is drawn has fewer nodes.

import { send } from './api.js';

/** Elevations of a dataset are about this far apart at the nearest: between points that are nearer there is nothing more to know. */
const NEAR_M = 30;

/**
 * How high above ground the points of a plan's route are, in their order: `path.points` of its result, or `waypoints` without a path.
 * Null over ground that the scenario itself describes, which the page knows as well as the service.
 */
export async function heightsAbove({ id, scenario }) {
  if (scenario.terrain?.kind !== 'dataset') return null;
  const table = await (await send(`/plans/${id}/result?format=csv`, { quiet: true })).text();
  const [head, ...rows] = table.trim().split('\n').map((line) => line.split(','));
  const column = head.indexOf('agl');
  return rows.map((row) => Number(row[column]));
}

/** Whether the ground of a document is that of a scenario which the service has planned. */
export function sameGround(document, scenario) {
  const [now, then] = [document.terrain, scenario.terrain];
  const datum = (one) => one.altitude_datum ?? 'msl';
  return now?.kind === 'dataset' && now.name === then?.name && (now.sha256 ?? then.sha256) === then.sha256 && datum(document) === datum(scenario);
}

/**
 * The ground below a `Way`, over a drawn `ground`: `(distance) => {z, sure, guessed}`, `guessed` where nothing is known of it. `above` are
 * the measured heights of its points; between two of them it goes as it is drawn, moved to fit both.
 */
export function beneath(way, ground, above = null) {
  const drawn = (s) => {
    const { x, y } = way.at(s);
    return ground.at(x, y);
  };
  if (above?.length !== way.points.length) return (s) => ({ z: drawn(s), sure: !ground.sampled, guessed: ground.guessed });
  const off = (k) => {
    const { x, y, z } = way.points[k];
    return z - above[k] - ground.at(x, y);
  };
  return (s) => {
    const { low, high, t } = way.locate(s);
    const gap = way.flown[high] - way.flown[low];
    return { z: drawn(s) + off(low) * (1 - t) + off(high) * t, sure: gap <= NEAR_M || Math.min(t, 1 - t) * gap < 1 };
  };
}
