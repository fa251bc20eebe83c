// One plan: what the service says about it, kept as it comes.

import { ask } from './api.js';
import { follow } from './stream.js';

const MOST_INCUMBENTS = 240;

export class Followed extends EventTarget {
  status = null;
  scenario = null;
  result = null;
  points = [];
  incumbents = [];
  connected = true;
  lostBecause = null;
  #stop = null;

  /** `status` and `scenario` where they are known already. */
  constructor(id, status = null, scenario = null) {
    super();
    this.id = id;
    this.status = status;
    this.scenario = scenario;
  }

  get ended() { return ['succeeded', 'failed', 'cancelled'].includes(this.status?.status); }
  get latest() { return this.incumbents.at(-1) ?? null; }

  /** Fetches what there is, and follows what is to come. */
  async open() {
    const [status, scenario] = await Promise.all([
      this.status ?? ask(`/plans/${this.id}`),
      this.scenario ?? ask(`/plans/${this.id}/scenario`),
    ]);
    Object.assign(this, { status, scenario });
    this.#tell('status');
    if (this.ended) await this.#finish();
    this.#stop = follow(this.id, (kind, data) => this.#heard(kind, data), (connected, why) => {
      // What has ended lacks nothing but its history.
      if (this.ended && this.result) return;
      Object.assign(this, { connected, lostBecause: why ?? null });
      this.#tell('connection');
    });
    return this;
  }

  close() { this.#stop?.(); }

  async cancel() {
    this.status = await ask(`/plans/${this.id}/cancel`, { method: 'POST' });
    this.#tell('status');
  }

  #heard(kind, data) {
    if (kind === 'status') {
      this.status = data;
      this.#tell('status');
    } else if (kind === 'convergence') {
      if (this.result) return;
      this.points.push(data);
      this.#tell('search');
    } else if (kind === 'incumbent') {
      this.incumbents.push(data);
      // Every other one of the older half goes, so that the whole history stays in sight.
      if (this.incumbents.length > MOST_INCUMBENTS) {
        this.incumbents = this.incumbents.filter((_, at) => at > MOST_INCUMBENTS / 2 || at % 2 === 0);
      }
      this.#tell('incumbent');
    } else if (kind === 'end') {
      this.connected = true;
      if (!this.result) this.#finish();
    }
  }

  async #finish() {
    try {
      this.status = await ask(`/plans/${this.id}`);
      if (this.status.status !== 'failed') {
        this.result = await ask(`/plans/${this.id}/result`);
        this.points = this.result.convergence;
      }
    } catch (refusal) {
      // Cancelled before the first route.
      this.refusal = refusal;
    }
    this.#tell('end');
  }

  #tell(what) {
    this.dispatchEvent(new CustomEvent('news', { detail: what }));
  }
}
