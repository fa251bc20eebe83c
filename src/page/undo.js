// The keys that undo and redo.

const TEXT = 'input[type=text], input[type=password]';

/** Has them call `undo()` and `redo()`, except where the browser's own take back letters. */
export function onUndoKeys({ undo, redo }) {
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
