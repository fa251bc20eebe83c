// The address, which names what is shown, and the way back and forth through what was shown before.

/** Drafts by the step at which they were left; a reload forgets them. */
const left = new Map();
let step = history.state?.step ?? 0;
let last = step;
if (!history.state) history.replaceState({ step, name: '' }, '');

/** The shipped scenario that the present step began with, or ''. */
export const begunWith = () => history.state?.name ?? '';

/** Which plans an address names: `{id, others}`; null for none. */
export function named(hash) {
  const query = new URLSearchParams(hash.slice(1));
  const id = query.get('plan');
  return id ? { id, others: query.get('with')?.split(' ').filter(Boolean) ?? [] } : null;
}

/** Has the address name these plans, within the same step. */
export function nameShown(id, others) {
  const query = new URLSearchParams();
  if (id) query.set('plan', id);
  if (others.length) query.set('with', others.join(' '));
  const hash = query.size ? `#${query}` : '';
  if (hash !== location.hash) history.replaceState(history.state, '', `${location.pathname}${hash}`);
}

/** What comes now is a step of its own: Back leads to `draft`, which is left. */
export function stepFrom(draft, scenario = '') {
  left.set(step, draft);
  last += 1;
  step = last;
  history.pushState({ step, name: scenario }, '', location.href);
}

/**
 * Calls `shown({hash, own, draft})` after a step back or forth, `now()` being the draft that is left. `own` says whether
 * the page made that step: an address may also be typed. `draft` is what was left there, null where that is not known.
 */
export function onStep(now, shown) {
  addEventListener('popstate', ({ state }) => {
    left.set(step, now());
    if (!state) {
      last += 1;
      history.replaceState({ step: last, name: '' }, '');
    }
    step = state?.step ?? last;
    shown({ hash: location.hash, own: Boolean(state), draft: left.get(step) ?? null });
  });
}
