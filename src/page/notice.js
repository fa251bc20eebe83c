// What is said to the person in front: in the notice under the header, and aloud.

import { Said } from './api.js';
import { by, el } from './dom.js';

const notice = by('notice');
let shown = '';

/** Says it to those who listen. */
export function say(text) { by('said').textContent = text; }

/** Shows it, and says it; '' takes away what is shown. `kind` is `bad` or `note`; `act` is a button beside it: `[title, act]`. */
export function tell(text, kind = 'bad', act = null) {
  shown = text;
  notice.hidden = !text;
  notice.className = `notice ${kind}`;
  notice.replaceChildren(el('span', {}, text),
    ...(act ? [el('button', { type: 'button', onclick: act[1] }, act[0])] : []),
    el('button', { type: 'button', class: 'quiet', 'aria-label': 'Dismiss', onclick: () => tell('') }, '✕'));
  if (text) say(text);
}

/** Takes that away, unless something else has been told since. */
export function untell(text) { if (shown === text) tell(''); }

/** Does it, and tells why where it cannot be done. */
export async function attempt(act) {
  try {
    tell('');
    await act();
  } catch (error) {
    if (error.name === 'AbortError') return;
    tell(error.message);
    if (!(error instanceof Said)) console.warn(error);
  }
}
