// The result in words and numbers: whether the route holds, what it costs, how near it comes, leg by leg.

import { el } from './dom.js';
import { FORMATS } from './format.js';
import { cost, duration, metres, number, proven, share, threatName } from './words.js';

const FEW = 8;

/** Draws it into `root`. `acts` has `mark(distance)`, `place(violation)`, `save(format)`, `saveScenario()`, `savePicture()` (null without a scene) and `copyLink()`. */
export function showResult(root, { result, scenario, status, refusal, geodetic }, acts) {
  if (status?.status === 'failed' || (refusal && !result)) {
    const why = status?.error?.detail ?? refusal?.message ?? 'no route was found before the end';
    root.replaceChildren(el('section', { class: 'verdict bad', 'aria-label': 'Result' }, el('h2', {}, status?.status === 'failed' ? 'The plan failed' : 'No route'), el('p', {}, why)));
    return;
  }
  if (!result) {
    root.replaceChildren();
    return;
  }
  const parts = [
    verdict(result, scenario, acts),
    takeaway(result, geodetic, acts),
    costs(result, scenario),
    clearances(result, scenario),
    legs(result, acts),
    origin(result, status),
  ];
  root.replaceChildren(...parts.filter((part) => part !== null));
}

function verdict(result, scenario, acts) {
  const { feasible, checks, bound } = result;
  if (feasible) {
    const held = result.path ? checks.path : checks.waypoints;
    const facts = [
      ['Length', metres(result.path?.length ?? result.legs.reduce((sum, leg) => sum + leg.length, 0))],
      ['Duration', duration(result.path?.duration_s)],
      ['Above ground', held.min_agl === null ? 'climbs and descents only' : `${number(held.min_agl)} to ${number(held.max_agl)} m`],
      ['Sharpest turn', `${number(checks.waypoints.max_turn_deg)}°`],
      ['Steepest climb', `${number(held.max_climb_deg)}°`],
      ['Proven gap', proven(bound.gap)],
    ];
    return el('section', { class: 'verdict good', 'aria-labelledby': 'verdict-head' },
      el('h2', { id: 'verdict-head' }, 'The route holds'),
      el('p', {}, stopped(result), ' ', bound.gap === null ? 'No bound could be proven.' : `No route of straight legs can be more than ${proven(1 - 1 / (1 + bound.gap))} cheaper; that is proven.`, ' Near start and target the route may climb or descend outside the band; its height above ground is given for the rest.'),
      el('dl', { class: 'facts' }, facts.map(([name, value]) => el('div', {}, el('dt', {}, name), el('dd', {}, value)))));
  }
  return el('section', { class: 'verdict bad', 'aria-labelledby': 'verdict-head' },
    el('h2', { id: 'verdict-head' }, 'No feasible route found'),
    el('p', {}, stopped(result), ' What is shown breaks the least, and must not be flown:'),
    el('ul', { class: 'violations' }, checks.violations.map((violation) => el('li', {},
      el('button', { type: 'button', class: 'link', onclick: () => acts.place(violation) }, violation.message)))));
}

function stopped({ stop_reason: reason, evaluations }) {
  const how = {
    iterations: 'All iterations done', converged: 'Ended early, near enough to the bound', 'time-limit': 'Ended at its time limit', cancelled: 'Cancelled; the best so far was kept',
  };
  return `${how[reason] ?? 'Ended'}: ${evaluations.toLocaleString('en')} routes tried.`;
}

function takeaway(result, geodetic, acts) {
  const offered = FORMATS.filter((format) => geodetic || !format.flight);
  // The service refuses to have a route flown that breaks something.
  const refused = (format) => Boolean(format.flight) && !format.broken && !result.feasible;
  const button = (format) => el('button', { type: 'button', data: { format: format.name }, class: format.main && format.flight && result.feasible ? 'main' : '',
    disabled: refused(format), 'aria-describedby': refused(format) ? 'refused' : undefined, onclick: () => acts.save(format) }, format.title);
  return el('section', { class: 'takeaway', 'aria-labelledby': 'takeaway-head' },
    el('h3', { id: 'takeaway-head' }, 'Take it away'),
    el('p', { class: 'row wrap' }, offered.map(button),
      el('button', { type: 'button', id: 'save-scenario', onclick: () => acts.saveScenario() }, 'Scenario, JSON'),
      acts.savePicture && el('button', { type: 'button', id: 'save-picture', onclick: () => acts.savePicture() }, 'View, PNG'),
      el('button', { type: 'button', id: 'copy-link', onclick: () => acts.copyLink() }, 'Copy link')),
    !result.feasible && geodetic && el('p', { class: 'faint', id: 'refused' }, 'A route that breaks its constraints is not given out in the formats that fly; the other formats are for looking at it.'));
}

function costs({ cost: terms, bound }, scenario) {
  const rows = [['Fuel', 'fuel'], ['Threats', 'threat'], ['Altitude', 'altitude']];
  const bar = el('div', { class: 'bar', 'aria-hidden': 'true' }, rows.map(([, name], k) => {
    const part = el('i', { class: `term-${k}` });
    part.style.flexGrow = String(terms.total > 0 ? terms[name] / terms.total : 0);
    return part;
  }));
  return el('section', { 'aria-labelledby': 'cost-head' },
    el('h3', { id: 'cost-head' }, 'Cost ', el('b', {}, cost(terms.total)), el('span', { class: 'faint' }, ' of the legs between waypoints')), bar,
    el('table', { class: 'plain' }, el('thead', { class: 'unseen' }, el('tr', {}, el('th', {}, 'Term'), el('th', {}, 'Cost'), el('th', {}, 'Share'))), el('tbody', {},
      rows.map(([title, name], k) => el('tr', {}, el('th', { scope: 'row' }, el('i', { class: `swatch term-${k}` }), title, scenario?.weights && el('span', { class: 'faint' }, ` × ${scenario.weights[name] ?? 1}`)),
        el('td', {}, cost(terms[name])), el('td', {}, terms.total > 0 ? share(terms[name] / terms.total) : '–'))),
      el('tr', {}, el('th', { scope: 'row' }, 'Proven bound'), el('td', {}, cost(bound.lower)), el('td', {}, bound.gap === null ? '–' : `gap ${proven(bound.gap)}`)))));
}

/** None without threats. */
function clearances({ checks, path }, scenario) {
  const { waypoints } = checks;
  if (!waypoints.clearance.length) return null;
  const far = (one) => one?.distance ?? Infinity;
  const rows = waypoints.clearance.map((one, at) => ({ ...one, flown: path ? checks.path.clearance[at] : null }))
    .sort((a, b) => Math.min(far(a), far(a.flown)) - Math.min(far(b), far(b.flown)));
  const row = ({ threat, name, distance, flown }) => {
    const of = scenario?.threats?.[threat];
    const soft = of ? (of.kind === 'polygon' ? of.margin ?? 0 : (of.influence ?? of.radius) - of.radius) : 0;
    const least = Math.min(distance ?? Infinity, flown?.distance ?? Infinity);
    const state = least < 0 ? 'entered' : least < soft - 1e-3 ? 'soft zone' : least === Infinity ? 'over or under' : 'clear';
    const figure = (value) => (value === null || value === undefined ? '–' : metres(value));
    return el('tr', { class: least < 0 ? 'bad' : '' }, el('th', { scope: 'row' }, threatName({ name }, threat)),
      el('td', {}, figure(distance)), path && el('td', {}, figure(flown?.distance)), el('td', { class: 'faint' }, state));
  };
  const table = (some) => el('table', { class: 'plain' }, el('thead', {}, el('tr', {}, el('th', {}, 'Threat'), el('th', {}, 'Legs'), path && el('th', {}, 'Path'), el('th', {}, el('span', { class: 'unseen' }, 'State')))), el('tbody', {}, some.map(row)));
  return el('section', { 'aria-labelledby': 'clearance-head' }, el('h3', { id: 'clearance-head' }, 'Least clearance'), table(rows.slice(0, FEW)),
    rows.length > FEW && el('details', {}, el('summary', {}, `${rows.length - FEW} more, farther off`), table(rows.slice(FEW, 500))));
}

function legs({ legs: all, checks }, acts) {
  const broken = new Set(checks.violations.map(({ where }) => where));
  const rows = all.map((leg, k) => el('tr', { data: { leg: k }, tabindex: 0, class: broken.has(`leg ${k}`) ? 'bad' : '',
    onpointerenter: () => acts.markLeg(k), onpointerleave: () => acts.markLeg(null), onfocus: () => acts.markLeg(k), onblur: () => acts.markLeg(null) },
  el('th', { scope: 'row' }, String(k)), el('td', {}, metres(leg.length)), el('td', {}, `${number(leg.turn_deg)}°`), el('td', {}, `${number(leg.climb_deg)}°`)));
  return el('section', { 'aria-labelledby': 'legs-head' }, el('h3', { id: 'legs-head' }, 'Legs'),
    el('table', { class: 'plain legs' }, el('thead', {}, el('tr', {}, el('th', {}, 'Leg'), el('th', {}, 'Length'), el('th', {}, 'Turn, left +'), el('th', {}, 'Climb'))), el('tbody', {}, rows)));
}

function origin(result, status) {
  const facts = [result.algorithm, `seed ${result.seed}`, `engine ${result.engine_version}`, `${number(result.timing.run_ms / 1000, 2)} s`];
  return el('p', { class: 'faint origin' }, facts.join(' · '), el('br'), `Plan ${status?.id ?? result.plan_id}`);
}
