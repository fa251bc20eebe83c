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
    this.body.replaceChildren(...plans.map((plan) => this.#row(plan, shown === plan.id, compared.get(plan.id))));
    if (focused) (this.body.querySelector(`[data-key="${CSS.escape(focused)}"]`) ?? this.body.rows[Math.min(row, this.body.rows.length - 1)]?.querySelector('button') ?? this.filter).focus();
    this.older.disabled = !this.#next;
    this.newer.disabled = !this.#past.length && !this.#cursor;
  }

  #row(plan, shown, color) {
    const name = nameOf(plan);
    const tick = el('input', { type: 'checkbox', checked: Boolean(color), disabled: shown, data: { key: `lay ${plan.id}` }, 'aria-label': `Lay ${name} over`, onchange: () => this.acts.compare(plan, tick.checked) });
    if (color) tick.style.accentColor = color;
    const state = plan.status === 'running' ? `running, ${number(plan.progress * 100, 0)} %`
      : plan.status === 'queued' && plan.queue_position ? `queued, ${plan.queue_position}.`
        : plan.status === 'succeeded' && plan.feasible === false ? 'infeasible' : plan.status;
    return el('tr', { class: shown ? 'chosen' : '', data: { plan: plan.id } },
      el('th', { scope: 'row' },
        el('button', { type: 'button', class: 'link', data: { key: `open ${plan.id}` }, onclick: () => this.acts.open(plan), 'aria-current': shown ? 'true' : undefined }, name),
        el('span', { class: 'faint' }, el('i', { class: `light ${plan.status === 'succeeded' && plan.feasible === false ? 'infeasible' : plan.status}` }), `${state} · ${plan.algorithm}, seed ${plan.seed} · ${moment(plan.created_at)}`)),
      el('td', {}, plan.best_cost === null ? '–' : cost(plan.best_cost)),
      el('td', {}, tick),
      el('td', {}, el('button', { type: 'button', class: 'quiet', data: { key: `remove ${plan.id}` }, 'aria-label': `Remove ${name}`, title: 'Remove', onclick: () => this.#remove(plan) }, '✕')));
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
