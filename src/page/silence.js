// A line that died without a word: where bytes vanish on the way, the browser takes a stream for open for ever. The
// service does send something while there is nothing to tell, but the browser keeps that to itself.

import { ask } from './api.js';

/** So long, a search may have nothing to tell; then the service is asked, once. */
const LONG_MS = 45000;
const ANSWER_MS = 10000;
/** What is on its way while the service answers has arrived by then. */
const MEANWHILE_MS = 2000;

/**
 * Calls `dead()` when the service does not answer, or knows more of a plan than has come. `heard(kind, data)` is to be told of
 * each event, `begin()` of each opening, `rest()` when nothing is to be heard, `end()` when nothing will be.
 */
export function listen(id, dead) {
  let known = { status: null, iteration: -1 };
  let timer;
  /** Counts what has happened, so that an answer about what was before is left aside. */
  let news = 0;
  let listening = false;

  function begin() {
    news += 1;
    listening = true;
    clearTimeout(timer);
    timer = setTimeout(doubt, LONG_MS);
  }

  function rest() {
    news += 1;
    listening = false;
    clearTimeout(timer);
  }

  function heard(kind, data) {
    if (kind === 'status') known = { status: data.status, iteration: data.iteration ?? -1 };
    else if (kind === 'convergence') known.iteration = data.iteration;
    begin();
  }

  async function doubt() {
    if (!listening) return;
    begin();
    const before = news;
    const { status, iteration } = await ask(`/plans/${id}`, { quiet: true, signal: AbortSignal.timeout(ANSWER_MS) }).catch(() => ({}));
    if (news !== before || (status === known.status && (iteration ?? -1) <= known.iteration)) return;
    setTimeout(() => news === before && dead(), status ? MEANWHILE_MS : 0);
  }

  addEventListener('online', doubt);
  const end = () => {
    rest();
    removeEventListener('online', doubt);
  };
  return { begin, rest, heard, end };
}
