// The scenario under the pencil: one document, every change undone and redone.

const MOST_STEPS = 200;

/** What `pointer` (RFC 6901) leads to; undefined where nothing is. */
export function at(document, pointer) {
  return parts(pointer).reduce((node, part) => node?.[part], document);
}

/** The document with `value` there; undefined takes away. What is not on the way is shared, not copied. */
export function withValue(document, pointer, value) {
  return put(document, parts(pointer), value);
}

function parts(pointer) {
  return pointer.split('/').slice(1).map((part) => part.replaceAll('~1', '/').replaceAll('~0', '~'));
}

function put(node, [part, ...rest], value) {
  if (part === undefined) return value;
  if (Array.isArray(node)) {
    const items = [...node];
    if (value === undefined && !rest.length) items.splice(Number(part), 1);
    else items[part] = put(items[part], rest, value);
    return items;
  }
  const { [part]: old, ...others } = node ?? {};
  const put_ = put(old, rest, value);
  // Where the last of its parts is taken away, an object goes too: it says nothing.
  if (put_ === undefined || (value === undefined && isEmpty(put_))) return others;
  return old === undefined ? { ...others, [part]: put_ } : { ...node, [part]: put_ };
}

const isEmpty = (node) => typeof node === 'object' && node !== null && !Array.isArray(node) && !Object.keys(node).length;

export class Draft extends EventTarget {
  #past = [];
  #future = [];
  #now = null;
  #last = null;
  /** Which document it is, counted from the first; those undone and redone go with the number that they had. */
  #number = 0;
  #numbers = new WeakMap();

  /** The document as it stands; never changed, only replaced. */
  get document() { return this.#now; }
  get canUndo() { return this.#past.length > 0; }
  get canRedo() { return this.#future.length > 0; }

  /** Another document altogether. It can be undone, too. */
  replace(document, why = 'replaced') {
    this.#number += 1;
    this.#become(document, null);
    this.#tell(why);
  }

  /** One value. Changes with the same `gesture` in a row are one step. */
  set(pointer, value, gesture = null) {
    if (at(this.#now, pointer) === value) return;
    this.#become(withValue(this.#now, pointer, value), gesture);
    this.#tell('edited', pointer);
  }

  /** Several at once, as one step. */
  edit(change, gesture = null) {
    this.#become(change(this.#now), gesture);
    this.#tell('edited');
  }

  /** Ends a gesture: what follows is a step of its own. */
  rest() { this.#last = null; }

  undo() { this.#step(this.#past, this.#future); }
  redo() { this.#step(this.#future, this.#past); }

  #step(from, to) {
    if (!from.length) return;
    const number = this.#numbers.get(this.#now);
    to.push(this.#now);
    this.#now = from.pop();
    this.#last = null;
    this.#number = this.#numbers.get(this.#now);
    this.#tell(this.#number === number ? 'stepped' : 'replaced');
  }

  #become(document, gesture) {
    if (this.#now && !(gesture && gesture === this.#last)) {
      this.#past.push(this.#now);
      if (this.#past.length > MOST_STEPS) this.#past.shift();
    }
    this.#future = [];
    this.#last = gesture;
    this.#now = document;
    this.#numbers.set(document, this.#number);
  }

  #tell(why, pointer) {
    this.dispatchEvent(new CustomEvent('change', { detail: { why, pointer } }));
  }
}
