// The scene in words, for those who do not see it.

import { cost, metres, number } from './words.js';

/** What the scene shows. */
export function describe({ document, ground, threats, plan, way, compared }) {
  const { min, max } = ground.extent;
  const parts = [`Ground ${metres(max.x - min.x, 0)} by ${metres(max.y - min.y, 0)}, ${ground.mesh ? `from ${number(ground.least, 0)} to ${number(ground.greatest, 0)} m` : `flat at ${number(ground.least, 0)} m`}`];
  parts.push(threats.length === 1 ? 'one threat' : `${threats.length} threats`);
  if (document.start && document.target) parts.push('start and target');
  if (way) {
    const kind = plan.result ? (plan.result.feasible ? 'a route that holds' : 'a route that is NOT feasible') : 'the best route so far';
    const price = plan.result?.cost.total ?? plan.latest?.cost;
    parts.push(`${kind}, ${metres(way.length)} over ground at ${number(way.least, 0)} to ${number(way.greatest, 0)} m${price === undefined ? '' : `, cost ${cost(price)}`}`);
  } else parts.push('no route yet');
  if (compared) parts.push(compared === 1 ? 'one more route laid over it' : `${compared} more routes laid over it`);
  return `${parts.join('; ')}.`;
}
