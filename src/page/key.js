// The dialogue that asks for the key of the service.

import { by } from './dom.js';

by('key-no').addEventListener('click', () => by('key').close(''));

/** Promises the key that is given, or null. `why` is what the service said to the one before. */
export function askForKey(why) {
  return new Promise((given) => {
    const dialog = by('key');
    by('key-why').textContent = why ?? 'Plans belong to the holder of a key.';
    by('key-field').value = '';
    dialog.returnValue = '';
    dialog.addEventListener('close', () => given(dialog.returnValue === 'use' ? by('key-field').value.trim() || null : null), { once: true });
    dialog.showModal();
  });
}
