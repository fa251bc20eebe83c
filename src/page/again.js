// A search that is over, watched once more: an iteration is chosen, or all of them pass by.

import { calmly, el } from './dom.js';
import { cost } from './words.js';

const LASTS_MS = 4000;
const STEP_MS = 50;

export class Again {
  #plan = null;
  #timer = null;
  #calm = calmly(6000, () => document.activeElement !== this.slider && this.stop());

  /** `show(iteration, trail)` shows the route that was best then, null for now; `trail` are those that were before it. */
  constructor(root, show) {
    this.root = root;
    this.show = show;
    this.button = el('button', { type: 'button', id: 'again', onclick: () => (this.#timer ? this.stop() : this.#run()) }, 'Watch again');
    this.slider = el('input', { type: 'range', id: 'iteration', min: 0, step: 1, 'aria-label': 'Best route at iteration', oninput: () => {
      this.#pause();
      this.#tell(Number(this.slider.value));
    } });
    // Left alone, the scene shows the result.
    this.slider.addEventListener('blur', () => this.stop());
    this.told = el('output', { htmlFor: 'iteration' });
    root.replaceChildren(this.button, this.slider, this.told);
  }

  /** The plan to be watched; it is offered as soon as it has ended and more than its end is known. */
  offer(plan) {
    const known = plan?.result && plan.incumbents.length > 1 ? plan : null;
    if (known === this.#plan && !this.root.hidden === Boolean(known)) return;
    this.stop();
    this.#plan = known;
    this.root.hidden = !known;
    if (!known) return;
    this.slider.max = String(this.#last);
    this.slider.value = this.slider.max;
    this.#say(null);
  }

  get #last() { return this.#plan.incumbents.at(-1).iteration; }

  #run() {
    const start = performance.now();
    this.button.textContent = 'Stop';
    this.#timer = setInterval(() => {
      const share = (performance.now() - start) / LASTS_MS;
      if (share >= 1) this.stop();
      else {
        const [first, last] = [this.#plan.incumbents[0].iteration, this.#last];
        this.slider.value = String(Math.round(first + (last - first) * share));
        this.#tell(Number(this.slider.value));
      }
    }, STEP_MS);
  }

  #tell(iteration) {
    const before = this.#plan.incumbents.filter((one) => one.iteration <= iteration);
    this.show(iteration, this.#timer ? before.slice(0, -1) : []);
    this.#say(before.at(-1) ?? null, iteration);
    this.#calm();
  }

  #say(one, iteration) {
    this.told.textContent = iteration === undefined ? '' : `iteration ${iteration}: ${one?.feasible ? cost(one.cost) : 'none that holds'}`;
    this.slider.setAttribute('aria-valuetext', this.told.textContent || 'the end');
  }

  #pause() {
    clearInterval(this.#timer);
    this.#timer = null;
    this.button.textContent = 'Watch again';
  }

  /** Back to the result. */
  stop() {
    this.#pause();
    if (!this.#plan) return;
    this.slider.value = this.slider.max;
    this.#say(null);
    this.show(null, []);
  }
}
