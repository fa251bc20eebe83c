// A file that is dropped onto the page.

import { by } from './dom.js';

/** Calls `open(file)` for each. */
export function onDrop(open) {
  let dragged = 0;
  addEventListener('dragenter', (event) => {
    if (!event.dataTransfer?.types.includes('Files')) return;
    dragged += 1;
    by('drop').hidden = false;
  });
  addEventListener('dragleave', () => {
    dragged = Math.max(0, dragged - 1);
    by('drop').hidden = dragged === 0;
  });
  addEventListener('dragover', (event) => event.preventDefault());
  addEventListener('drop', (event) => {
    event.preventDefault();
    dragged = 0;
    by('drop').hidden = true;
    const [file] = event.dataTransfer.files;
    if (file) open(file);
  });
}
