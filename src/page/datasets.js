// Which datasets of the service there are to choose from: others upload and delete them meanwhile.

import { ask } from './api.js';

const CHOICES = '[data-pointer="/terrain"], [data-pointer="/terrain/name"]';

/** Tells `editor` of them whenever the page is seen again, and when one is about to be chosen. Returns what looks at once. */
export function offerDatasets(editor) {
  let looking = null;
  const look = () => {
    looking ??= ask('/terrains', { quiet: true }).then(({ terrains }) => editor.datasets(terrains.map(({ name }) => name)))
      // Only where the service has datasets, and the caller may see them.
      .catch(() => {}).finally(() => { looking = null; });
    return looking;
  };
  document.addEventListener('visibilitychange', () => document.hidden || look());
  for (const event of ['focusin', 'pointerdown']) editor.root.addEventListener(event, ({ target }) => { if (target.matches(CHOICES)) look(); });
  return look;
}
