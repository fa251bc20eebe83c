// The state of a plan in the header, and its figures beside the chart.

import { by, el } from './dom.js';
import { cost, number, proven } from './words.js';

/** Shows them. */
export function showFigures(plan) {
  const { status, latest, result: end } = plan;
  const state = by('state');
  const active = ['queued', 'running'].includes(status?.status) && !plan.lostBecause;
  const name = end && !end.feasible ? 'infeasible' : status?.status ?? 'opening';
  state.hidden = false;
  state.className = `state ${name}`;
  state.textContent = plan.connected ? name : plan.lostBecause ? 'lost' : 'reconnecting';
  offer('cancel', active);
  // Not `disabled`, for that would lose the focus before it is given away.
  by('cancel').setAttribute('aria-disabled', String(Boolean(status?.cancel_requested)));
  offer('replan', Boolean(end));
  const last = plan.points.at(-1);
  const best = end?.cost.total ?? last?.best_cost ?? (latest?.feasible ? latest.cost : null) ?? status?.best_cost;
  const iterations = status?.iterations ?? 0;
  const iteration = Math.min(last?.iteration ?? status?.iteration ?? 0, iterations);
  const share = end ? 1 : iterations ? iteration / iterations : 0;
  const bar = el('progress', { max: 1, value: share, 'aria-label': 'Progress of the search' });
  by('figures').replaceChildren(
    el('p', { class: `big ${name}` }, el('b', {}, cost(best ?? null)), el('span', { class: 'faint' }, told(plan, best))),
    ...(active ? [bar, el('p', { class: 'faint' }, `Iteration ${iteration} of ${iterations}`, last ? `, ${number(last.feasible_fraction * 100, 0)} % of the swarm feasible` : '')] : []));
}

/** Where there is no plan. */
export function showNone() {
  by('state').hidden = true;
  offer('cancel', false);
  offer('replan', false);
  by('figures').replaceChildren(el('p', { class: 'faint' }, 'Press Plan, and watch the swarm look for a route.'));
}

/** Shows a button or hides it; the focus of one that goes is given to Plan, for it would be lost. */
function offer(id, yes) {
  const button = by(id);
  if (!yes && document.activeElement === button) by('plan').focus();
  button.hidden = !yes;
}

/** What the figure beside it is. */
function told({ status, result: end }, best) {
  if (end && !end.feasible) return 'cost of a route that must not be flown';
  if (best !== null && best !== undefined) return 'cost of the best route';
  if (status?.status !== 'queued') return status?.finished_at ? 'no feasible route' : 'no feasible route yet';
  return status.queue_position ? `waiting, number ${status.queue_position} in the queue` : 'waiting';
}

/** How a plan has ended, in a sentence. */
export function verdict(plan) {
  if (!plan.result) return plan.status.status === 'cancelled' ? 'The plan was cancelled before a route was found.' : 'The plan has failed.';
  const { feasible, cost: price, bound } = plan.result;
  return feasible ? `A route was found: cost ${cost(price.total)}${bound.gap === null ? '' : `, proven gap ${proven(bound.gap).replace('%', 'per cent')}`}.` : 'No feasible route was found.';
}
