// A plan's events, followed to the end: a lost connection is taken up again where it was cut.

import { Refused, ask, eventsAddress } from './api.js';

/** No eye sees more. */
export const RATE_HZ = 20;
const KINDS = ['status', 'convergence', 'incumbent', 'gap', 'end'];

/**
 * Calls `heard(kind, data)` for each event and `connected(yes, why)` when that changes. Returns what ends it.
 * `rateHz` points a second at most, 0 for all.
 *
 * The browser itself takes up a connection that broke, with the last id; what it gives up, an answer that is no
 * stream, such as that to a ticket whose time is over, is asked for again here, for as long as there is the plan.
 */
export function follow(id, heard, connected, rateHz = RATE_HZ) {
  let source = null;
  let last = 0;
  let over = false;
  let refused = false;
  let wait_ms = 500;
  let timer;

  async function open() {
    let address;
    try {
      // An EventSource does not say why it was refused.
      if (refused) await ask(`/plans/${id}`);
      address = await eventsAddress(id, last, rateHz);
    } catch (refusal) {
      const hopeless = refusal instanceof Refused && [401, 403, 404, 410].includes(refusal.status);
      connected(false, hopeless ? refusal.message : null);
      if (!hopeless) again();
      return;
    }
    if (over) return;
    source = new EventSource(address);
    source.onopen = () => {
      wait_ms = 500;
      refused = false;
      connected(true);
    };
    source.onerror = () => {
      if (over) return;
      connected(false);
      if (source.readyState !== EventSource.CLOSED) return;
      refused = true;
      again();
    };
    for (const kind of KINDS) {
      source.addEventListener(kind, (event) => {
        last = Number(event.lastEventId) || last;
        if (kind === 'end') stop();
        heard(kind, JSON.parse(event.data));
      });
    }
  }

  function again() {
    if (over) return;
    source?.close();
    timer = setTimeout(open, wait_ms);
    wait_ms = Math.min(wait_ms * 2, 8000);
  }

  function stop() {
    over = true;
    clearTimeout(timer);
    source?.close();
  }

  open();
  return stop;
}
