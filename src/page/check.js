// The draft, checked by the service as it changes.

import { Said, UNREACHABLE, Unreachable, ask } from './api.js';
import { calmly } from './dom.js';
import { axes } from './frame.js';
import { hold, over, tell, untell } from './notice.js';

const VALIDATE_MS = 300;
/** So long after the service could not be reached, it is asked again. */
const AGAIN_MS = 3000;
const UNCHECKED = 'The service cannot be reached: what has changed in the scenario is not checked.';
const MAY_NOT_PLAN = 'This key may look at plans, but may not plan: the scenario is not checked.';

/** Higher than any ground. */
const ALOFT_M = 9000;

/** Shows faults in `editor`, and has `stage` draw the ground that the service knows. */
export function checkAsItChanges(draft, editor, stage) {
  let checking = null;
  const check = calmly(VALIDATE_MS, async () => {
    checking = new AbortController();
    const { signal } = checking;
    try {
      const { scenario } = await ask('/plans?validate_only=true', { method: 'POST', body: draft.document, signal, quiet: true });
      [UNCHECKED, MAY_NOT_PLAN].forEach(over);
      untell(UNREACHABLE);
      editor.mark([]);
      editor.show(scenario);
      await stage.sample(scenario, signal);
    } catch (refusal) {
      if (refusal.status) over(UNCHECKED);
      const faults = refusal.problem?.errors;
      if (faults) {
        editor.mark(faults);
        if (faults.every(({ code }) => code === 'below-ground')) await sampleAbove(draft.document, stage, signal);
      } else if (refusal instanceof Unreachable) {
        hold(UNCHECKED, 'bad');
        setTimeout(() => signal.aborted || check(), AGAIN_MS);
      } else if (refusal.status === 403) {
        hold(MAY_NOT_PLAN, 'note');
        await sampleUnchecked(draft.document, stage, signal);
      } else if (refusal instanceof Said && refusal.status !== 401) tell(refusal.message);
    }
  });
  draft.addEventListener('change', () => {
    // What is still on its way is about what was.
    checking?.abort();
    check();
  });
}

/** Whoever may only look sees the ground of what is there, too. */
async function sampleUnchecked(document, stage, signal) {
  try {
    await stage.sample(document, signal);
  } catch {
    // What is wrong with a document is not told to whom it is not checked for.
  }
}

/** The ground that ends lie under is drawn too, so that they can be placed on it. */
async function sampleAbove(document, stage, signal) {
  if (document.terrain?.kind !== 'dataset') return;
  const [, , up] = axes(document);
  const above = (end) => ({ ...end, [up]: ALOFT_M });
  const aloft = { ...document, start: above(document.start), target: above(document.target) };
  try {
    const { scenario } = await ask('/plans?validate_only=true', { method: 'POST', body: aloft, signal, quiet: true });
    await stage.sample(scenario, signal);
  } catch {
    // The next check tries again.
  }
}
