// The question before something is lost.

import { by } from './dom.js';

by('sure-no').addEventListener('click', () => by('sure').close(''));

/** Promises whether the person says yes to `act`, a verb; `why` is what would be lost. */
export function sure(question, why, act) {
  return new Promise((answered) => {
    const dialog = by('sure');
    by('sure-head').textContent = question;
    by('sure-why').textContent = why;
    by('sure-yes').textContent = act;
    dialog.returnValue = '';
    dialog.addEventListener('close', () => answered(dialog.returnValue === 'yes'), { once: true });
    dialog.showModal();
    // Enter is not to do what cannot be undone.
    by('sure-no').focus();
  });
}
