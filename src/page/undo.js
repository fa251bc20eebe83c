// The buttons and the keys that undo and redo.

import { by } from './dom.js';

const TEXT = 'input[type=text], input[type=password]';

/** Has them take back and do again changes of `draft`, and first take back what `tools()` are drawing. Returns what shows whether the buttons can. */
export function offerUndo(draft, tools) {
  const undo = () => tools()?.takeBack() || draft.undo();
  const redo = () => draft.redo();
  by('undo').addEventListener('click', undo);
  by('redo').addEventListener('click', redo);
  onKeys({ undo, redo });
  const show = () => {
    by('undo').disabled = !draft.canUndo && !tools()?.drawing;
    by('redo').disabled = !draft.canRedo;
  };
  draft.addEventListener('change', show);
  return show;
}

/** Has the keys call `undo()` and `redo()`, except where the browser's own take back letters. */
function onKeys({ undo, redo }) {
  let before = null;
  addEventListener('focusin', ({ target }) => { before = target.value; });
  addEventListener('keydown', (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    const key = event.key.toLowerCase();
    if (key !== 'z' && key !== 'y') return;
    // In a field those typed since it has the focus.
    if (event.target.matches?.(TEXT) && event.target.value !== before) return;
    event.preventDefault();
    if (key === 'y' || event.shiftKey) redo();
    else undo();
    before = event.target.value;
  });
}
