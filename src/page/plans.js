// The plans that the service has: their states as they change, filtered and page by page.

import { ask, send } from './api.js';
import { el } from './dom.js';
import { sure } from './sure.js';
import { cost, moment, number } from './words.js';

const LOOK_MS = 2000;
const PAGE = 20;
const STATES = ['queued', 'running', 'succeeded', 'failed', 'cancelled'];

/** What a plan is called; blanks name nothing. */
const nameOf = (plan) => plan.name?.trim() || 'unnamed';

export class Plans {
  #cursor = null;
  #next = null;
  #past = [];
  #timer = null;
  #rows = [];
  /** By plan, so that a click or a selection in a row is not lost as the list is read again. */
  #drawn = new Map();

  /** `acts` has `open(status)`, `compare(status, yes)` and `removed(id)`; `marks()` says what is shown and compared. */
  constructor(root, acts, marks) {
    this.root = root;
    this.acts = acts;
    this.marks = marks;
    this.filter = el('select', { id: 'plans-filter', onchange: () => this.#turn(null, []) },
      el('option', { value: '' }, 'All'), STATES.map((state) => el('option', { value: state }, state)));
    this.body = el('tbody');
    this.note = el('p', { class: 'faint' });
    this.older = el('button', { type: 'button', id: 'plans-older', onclick: () => this.#turn(this.#next, [...this.#past, this.#cursor]) }, 'Older');
    this.newer = el('button', { type: 'button', id: 'plans-newer', onclick: () => this.#turn(this.#past.at(-1) ?? null, this.#past.slice(0, -1)) }, 'Newer');
    root.replaceChildren(
      el('div', { class: 'field' }, el('label', {}, el('span', { class: 'name' }, 'State'), this.filter)),
      el('table', { class: 'plain plans' }, el('caption', { class: 'unseen' }, 'Plans, newest first'),
        el('thead', {}, el('tr', {}, el('th', {}, 'Plan'), el('th', {}, 'Cost'), el('th', {}, 'Lay over'), el('th', {}, el('span', { class: 'unseen' }, 'Remove')))), this.body),
      this.note, el('p', { class: 'row' }, this.newer, this.older));
    document.addEventListener('visibilitychange', () => this.#again());
  }

  /** Looks now, and from time to time while the list is in sight; `asking` for a key if need be. */
  async look(asking = false) {
    clearTimeout(this.#timer);
    const query = new URLSearchParams({ limit: String(PAGE) });
    if (this.filter.value) query.set('status', this.filter.value);
    if (this.#cursor) query.set('cursor', this.#cursor);
    try {
      const page = await ask(`/plans?${query}`, { quiet: !asking });
      this.#next = page.links.next ? new URL(page.links.next, location.origin).searchParams.get('cursor') : null;
      this.#show(page.plans);
      this.note.textContent = page.plans.length ? '' : 'None here.';
    } catch (refusal) {
      this.note.textContent = `The list could not be read: ${refusal.message} `;
      if (refusal.status === 401) this.note.append(el('button', { type: 'button', onclick: () => this.look(true) }, 'Give a key…'));
    }
    this.#again();
  }

  /** Shows again which are shown and laid over. */
  mark() { this.#show(this.#rows); }

  #again() {
    clearTimeout(this.#timer);
    if (this.root.hidden || document.hidden) return;
    this.#timer = setTimeout(() => this.look(), LOOK_MS);
  }

  #turn(cursor, past) {
    this.#cursor = cursor;
    this.#past = past;
    this.look();
  }

  #show(plans) {
    this.#rows = plans;
    const { shown, compared } = this.marks();
    const focused = this.body.contains(document.activeElement) ? document.activeElement.dataset.key : null;
    const row = focused ? document.activeElement.closest('tr').sectionRowIndex : null;
    this.#drawn = new Map(plans.map((plan) => [plan.id, this.#drawn.get(plan.id) ?? this.#row(plan)]));
    const nodes = plans.map((plan) => this.#drawn.get(plan.id)(plan, shown === plan.id, compared.get(plan.id)));
    if (nodes.length !== this.body.rows.length || nodes.some((node, at) => node !== this.body.rows[at])) this.body.replaceChildren(...nodes);
    if (focused && !this.body.contains(document.activeElement)) (this.body.querySelector(`[data-key="${CSS.escape(focused)}"]`) ?? this.body.rows[Math.min(row, this.body.rows.length - 1)]?.querySelector('button') ?? this.filter).focus();
    this.older.disabled = !this.#next;
    this.newer.disabled = !this.#past.length && !this.#cursor;
  }

  /** A new row: what shows in it how a plan is now, and gives it back. */
  #row(plan) {
    const name = nameOf(plan);
    const open = el('button', { type: 'button', class: 'link', data: { key: `open ${plan.id}` }, onclick: () => this.acts.open(plan) }, name);
    const [light, state, price] = [el('i'), el('span'), el('td')];
    const tick = el('input', { type: 'checkbox', data: { key: `lay ${plan.id}` }, 'aria-label': `Lay ${name} over`, onchange: () => this.acts.compare(plan, tick.checked) });
    const node = el('tr', { data: { plan: plan.id } },
      el('th', { scope: 'row' }, open, el('span', { class: 'faint' }, light, state)),
      price,
      el('td', {}, tick),
      el('td', {}, el('button', { type: 'button', class: 'quiet', data: { key: `remove ${plan.id}` }, 'aria-label': `Remove ${name}`, title: 'Remove', onclick: () => this.#remove(plan) }, '✕')));
    return (now, shown, color) => {
      plan = now;
      node.className = shown ? 'chosen' : '';
      if (shown) open.setAttribute('aria-current', 'true');
      else open.removeAttribute('aria-current');
      light.className = `light ${now.status === 'succeeded' && now.feasible === false ? 'infeasible' : now.status}`;
      write(state, `${stateOf(now)} · ${now.algorithm}, seed ${now.seed} · ${moment(now.created_at)}`);
      write(price, now.best_cost === null ? '–' : cost(now.best_cost));
      Object.assign(tick, { checked: Boolean(color), disabled: shown });
      tick.style.accentColor = color ?? '';
      return node;
    };
  }

  async #remove(plan) {
    const active = ['queued', 'running'].includes(plan.status);
    const why = active ? 'It has not ended. Its search is stopped, and the best route so far is lost, for everybody who has its link.'
      : 'Its scenario and its result are lost, for everybody who has its link. This cannot be undone.';
    if (!(await sure(`Remove “${nameOf(plan)}”?`, why, active ? 'Stop and remove' : 'Remove'))) return;
    try {
      await send(`/plans/${plan.id}`, { method: 'DELETE' });
      this.acts.removed(plan.id);
    } catch (refusal) {
      this.note.textContent = `It could not be removed: ${refusal.message}`;
    }
    this.look();
  }
}

function stateOf({ status, progress, queue_position: place, feasible }) {
  if (status === 'running') return `running, ${number(progress * 100, 0)} %`;
  if (status === 'queued' && place) return `queued, ${place}.`;
  return status === 'succeeded' && feasible === false ? 'infeasible' : status;
}

/** Leaves alone what is said already: it may be selected. */
function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}
