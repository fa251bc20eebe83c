// A plan's events, followed to the end: a lost connection is taken up again where it was cut.

import { Refused, ask, eventsAddress } from './api.js';
import { listen } from './silence.js';
import { begun, leave, queue } from './turns.js';

/** No eye sees more. */
export const RATE_HZ = 20;
const KINDS = ['status', 'convergence', 'incumbent', 'gap', 'end'];

/**
 * Calls `heard(kind, data)` for each event and `connected(yes, why)` when that changes. `rateHz` points a second at most, 0
 * for all. One that is `aside` takes turns with all that are. Returns `stop()`, which ends it, and `forward()`, after
 * which it is aside no longer.
 *
 * The browser itself takes up a connection that broke, with the last id; what it gives up, an answer that is no
 * stream, such as that to a ticket whose time is over, is asked for again here, for as long as there is the plan.
 *
 * A page that is not in sight keeps no stream: six of them would leave nothing for the one that is.
 */
export function follow(id, heard, connected, { rateHz = RATE_HZ, aside = false } = {}) {
  let source = null;
  let last = 0;
  let over = false;
  let refused = false;
  let wait_ms = 500;
  let timer;
  /** Counts openings: one that was paused before it had its address is none. */
  let openings = 0;
  const turn = { begin, pause };
  let asleep = false;
  const silence = listen(id, () => {
    // The service says first whether there is the plan.
    refused = true;
    again();
    connected(false);
  });

  async function begin() {
    openings += 1;
    const opening = openings;
    silence.begin();
    let address;
    try {
      // An EventSource does not say why it was refused.
      if (refused) await ask(`/plans/${id}`);
      address = await eventsAddress(id, last, rateHz);
    } catch (refusal) {
      if (opening !== openings) return;
      const hopeless = refusal instanceof Refused && [401, 403, 404, 410].includes(refusal.status);
      if (hopeless) stop();
      else again();
      connected(false, hopeless ? refusal.message : null);
      return;
    }
    if (opening !== openings) return;
    source = new EventSource(address);
    source.onopen = () => {
      wait_ms = 500;
      refused = false;
      begun(turn);
      connected(true);
    };
    source.onerror = () => {
      if (source.readyState === EventSource.CLOSED) {
        refused = true;
        again();
      }
      connected(false);
    };
    for (const kind of KINDS) {
      source.addEventListener(kind, (event) => {
        last = Number(event.lastEventId) || last;
        const data = JSON.parse(event.data);
        silence.heard(kind, data);
        if (kind === 'end') stop();
        heard(kind, data);
      });
    }
  }

  function start() {
    if (document.hidden) asleep = true;
    else if (aside) queue(turn);
    else begin();
  }

  function pause() {
    openings += 1;
    silence.rest();
    clearTimeout(timer);
    source?.close();
  }

  function again() {
    pause();
    leave(turn);
    timer = setTimeout(start, wait_ms);
    wait_ms = Math.min(wait_ms * 2, 8000);
  }

  function stop() {
    over = true;
    pause();
    leave(turn);
    silence.end();
    document.removeEventListener('visibilitychange', look);
  }

  function look() {
    if (document.hidden) {
      asleep = true;
      pause();
      leave(turn);
    } else if (asleep) {
      asleep = false;
      start();
    }
  }

  function forward() {
    if (over || !aside) return;
    aside = false;
    pause();
    leave(turn);
    start();
  }

  document.addEventListener('visibilitychange', look);
  start();
  return { stop, forward };
}
