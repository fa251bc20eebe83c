// Fields bound to places of the draft, and the service's faults shown where they are.

import { at } from './draft.js';
import { el } from './dom.js';
import { EITHER, detailOf } from './words.js';

let gestures = 0;
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
/** Where less than nothing makes sense. Keypads for decimals have no minus on some telephones. */
const SIGNED = /\/(lat|lon|alt|x|y|z|elevation|base|top)$/;

/** Fields of one draft below one element. */
export class Form {
  #fields = [];
  #faults = [];
  #defaults = null;

  constructor(root, draft) {
    this.root = root;
    this.draft = draft;
  }

  /** Forgets the fields of a part that is built anew. */
  forget(part) {
    this.#fields = this.#fields.filter(({ input }) => !part.contains(input));
  }

  /**
   * A labelled number, with a point or a comma before its decimals. What cannot be read as one, or in two ways, is sent as it
   * is, for the service to say what is wrong with it.
   */
  number(pointer, label, unit = '', { empty = undefined } = {}) {
    const write = (value) => (value === undefined || value === null ? '' : String(value));
    const read = (text) => {
      const plain = text.trim().replace(/^−/, '-');
      if (plain === '') return empty;
      if (unit !== '°' && EITHER.test(plain)) return text;
      const pointed = plain.replace(',', '.');
      return NUMBER.test(pointed) && Number.isFinite(Number(pointed)) ? Number(pointed) : text;
    };
    const input = el('input', { type: 'text', inputmode: SIGNED.test(pointer) ? undefined : 'decimal', autocomplete: 'off', spellcheck: false });
    return this.#field(pointer, label, unit, input, write, read, { empty });
  }

  text(pointer, label, { empty = undefined } = {}) {
    const input = el('input', { type: 'text', autocomplete: 'off', spellcheck: false });
    return this.#field(pointer, label, '', input, (value) => value ?? '', (text) => (text === '' ? empty : text), { empty });
  }

  /** One of `options`: `[value, text]`; `chosen` may make a value of the choice, `set` change more than that value. */
  choice(pointer, label, options, { fallback, chosen = (value) => value, shown = (value) => value, set } = {}) {
    const input = el('select', {}, options.map(([value, text]) => el('option', { value }, text)));
    return this.#field(pointer, label, '', input, (value) => shown(value) ?? fallback, chosen, { set });
  }

  tick(pointer, label, fallback) {
    const input = el('input', { type: 'checkbox' });
    input.addEventListener('change', () => this.draft.set(pointer, input.checked));
    this.#fields.push({ pointer, input, fault: null, show: (value) => { input.checked = value ?? fallback; } });
    input.dataset.pointer = pointer;
    return el('label', { class: 'tick' }, input, label);
  }

  #field(pointer, label, unit, input, write, read, { empty, set = (value, gesture) => this.draft.set(pointer, value, gesture) } = {}) {
    const fault = el('span', { class: 'fault', id: `fault${pointer.replaceAll('/', '-')}`, hidden: true });
    let gesture = null;
    input.dataset.pointer = pointer;
    input.addEventListener('focus', () => { gesture = `typing ${gestures += 1}`; });
    input.addEventListener(input.tagName === 'SELECT' ? 'change' : 'input', () => set(read(input.value), gesture));
    input.addEventListener('blur', () => {
      this.draft.rest();
      this.sync();
    });
    const show = (value) => {
      // Not what is being typed, such as `1.`, unless it has been undone.
      if (document.activeElement !== input || input.tagName === 'SELECT' || read(input.value) !== (value ?? empty)) input.value = write(value);
    };
    this.#fields.push({ pointer, input, fault, show, write });
    // The fault describes the field; within the label it would be part of its name, too.
    return el('div', { class: 'field' }, el('label', {}, el('span', { class: 'name' }, label, unit && el('i', {}, ` ${unit}`)), input), fault);
  }

  /** Shows the values of the draft, and for what it leaves open those of `defaults`. */
  sync(defaults = this.#defaults) {
    this.#defaults = defaults;
    for (const { pointer, input, show, write } of this.#fields) {
      const value = at(this.draft.document, pointer);
      show(value);
      if (write && input.tagName !== 'SELECT') input.placeholder = write(brief(defaults ? at(defaults, pointer) : undefined)) || '–';
    }
    this.mark(this.#faults);
  }

  /** Marks faults: each at the field that its pointer leads to, or at the first field below or above that. Returns those without one. */
  mark(faults) {
    this.#faults = faults;
    const said = new Map();
    const left = [];
    for (const fault of faults) {
      const field = this.fieldOf(fault.pointer);
      if (field) said.set(field, [...(said.get(field) ?? []), detailOf(fault, this.draft.document)]);
      else left.push(fault);
    }
    for (const field of this.#fields) {
      if (!field.fault) continue;
      const details = said.get(field);
      field.fault.textContent = details?.join('; ') ?? '';
      field.fault.hidden = !details;
      field.input.toggleAttribute('aria-invalid', Boolean(details));
      if (details) {
        field.input.setAttribute('aria-invalid', 'true');
        field.input.setAttribute('aria-describedby', field.fault.id);
      } else {
        field.input.removeAttribute('aria-describedby');
      }
    }
    return left;
  }

  /** The field of a pointer; else the first below it; else the first in what it is in. */
  nearest(pointer) {
    for (let at_ = pointer; at_; at_ = at_.slice(0, at_.lastIndexOf('/'))) {
      const field = this.fieldOf(at_);
      if (field) return field;
    }
    return null;
  }

  /** The field of a pointer; else the name at the head of the threat that it leads to; else the first below it. */
  fieldOf(pointer) {
    const find = (test) => this.#fields.find((field) => field.fault && test(field.pointer));
    return find((own) => own === pointer) ?? find((own) => own === pointer.replace(/^(\/threats\/\d+)(\/kind)?$/, '$1/name')) ?? find((own) => own.startsWith(`${pointer}/`)) ?? null;
  }
}

/** A default to be read, not to be copied. */
function brief(value) {
  return Number.isFinite(value) && !Number.isInteger(value) ? Number(value.toPrecision(6)) : value;
}
