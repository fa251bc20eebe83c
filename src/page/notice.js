// What is said to the person in front: in the notice under the header, and aloud.

import { Said } from './api.js';
import { by, el } from './dom.js';

const notice = by('notice');

/** Says it to those who listen. */
export function say(text) { by('said').textContent = text; }

/** Shows it, and says it; '' takes away what is shown. `kind` is `bad` or `note`. */
export function tell(text, kind = 'bad') {
  notice.hidden = !text;
  notice.className = `notice ${kind}`;
  notice.replaceChildren(text, el('button', { type: 'button', class: 'quiet', 'aria-label': 'Dismiss', onclick: () => tell('') }, '✕'));
  if (text) say(text);
}

/** Does it, and tells why where it cannot be done. */
export async function attempt(act) {
  try {
    tell('');
    await act();
  } catch (error) {
    if (error.name === 'AbortError') return;
    tell(error instanceof TypeError && /fetch/i.test(error.message) ? 'The service cannot be reached.' : error.message);
    if (!(error instanceof Said)) console.warn(error);
  }
}
