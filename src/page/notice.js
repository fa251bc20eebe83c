// What is said to the person in front: in the notice under the header, and aloud.

import { Said } from './api.js';
import { by, el } from './dom.js';

const notice = by('notice');
/** What was told last: `[text, kind, act]`. */
let told = null;
/** What is so until further notice, and whether it is shown: somebody may have put it away. */
const lasting = new Map();

/** Says it to those who listen. */
export function say(text) { by('said').textContent = text; }

/** Shows it, and says it; '' takes away what was told. `kind` is `bad` or `note`; `act` is a button beside it: `[title, act]`. */
export function tell(text, kind = 'bad', act = null) {
  told = text ? [text, kind, act] : null;
  draw();
  if (text) say(text);
}

/** Takes away what was told, if it was this. */
export function untell(text) { if (told?.[0] === text) tell(''); }

/** Shows and says what is so until it is `over`, beside what is told meanwhile. */
export function hold(text, kind) {
  if (lasting.has(text)) return;
  lasting.set(text, { kind, shown: true });
  draw();
  say(text);
}

/** It is so no more. */
export function over(text) { if (lasting.delete(text)) draw(); }

function draw() {
  const rows = [...lasting].filter(([, { shown }]) => shown).map(([text, one]) => row(text, one.kind, null, () => {
    one.shown = false;
    draw();
  }));
  if (told) rows.push(row(...told, () => tell('')));
  notice.hidden = !rows.length;
  notice.replaceChildren(...rows);
}

function row(text, kind, act, away) {
  return el('div', { class: `notice ${kind}` }, el('span', {}, text),
    ...(act ? [el('button', { type: 'button', onclick: act[1] }, act[0])] : []),
    el('button', { type: 'button', class: 'quiet', 'aria-label': 'Dismiss', onclick: away }, '✕'));
}

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
