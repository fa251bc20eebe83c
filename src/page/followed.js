// One plan: what the service says about it, kept as it comes.

import { ask } from './api.js';
import { heightsAbove } from './beneath.js';
import { RATE_HZ, follow } from './stream.js';

const MOST_INCUMBENTS = 240;
/** What the service takes, other than 0 for all. */
const MOST_HZ = 1000;

export class Followed extends EventTarget {
  status = null;
  scenario = null;
  result = null;
  /** How high above ground the points of its route are, as measured; null until that is known. */
  above = null;
  points = [];
  incumbents = [];
  connected = true;
  lostBecause = null;
  #opened = null;
  #closed = false;
  #aside;
  #stream = null;

  /** `status` where it is known already; `aside` what is laid over another: all of those share a connection. */
  constructor(id, { status = null, aside = false } = {}) {
    super();
    this.id = id;
    this.status = status;
    this.#aside = aside;
  }

  get ended() { return ['succeeded', 'failed', 'cancelled'].includes(this.status?.status); }
  get latest() { return this.incumbents.at(-1) ?? null; }

  /** Fetches what there is, and follows what is to come. */
  open() {
    this.#opened ??= this.#begin();
    return this.#opened;
  }

  close() {
    this.#closed = true;
    this.#stream?.stop();
  }

  /** It is aside no longer. */
  forward() {
    this.#aside = false;
    this.#stream?.forward();
  }

  async cancel() {
    this.status = await ask(`/plans/${this.id}/cancel`, { method: 'POST' });
    this.#tell('status');
  }

  async #begin() {
    const [status, scenario] = await Promise.all([
      this.status ?? ask(`/plans/${this.id}`),
      ask(`/plans/${this.id}/scenario`),
    ]);
    if (this.#closed) return this;
    Object.assign(this, { status, scenario });
    this.#tell('status');
    if (this.ended) await this.#finish();
    else {
      this.#stream = follow(this.id, (kind, data) => this.#heard(kind, data), (connected, why) => {
        // What has ended lacks nothing but its history.
        if (this.ended && this.result) return;
        if (connected === this.connected && (why ?? null) === this.lostBecause) return;
        Object.assign(this, { connected, lostBecause: why ?? null });
        this.#tell('connection');
      }, { aside: this.#aside });
    }
    return this;
  }

  #heard(kind, data) {
    if (kind === 'status') {
      // A run that starts over tells its points anew.
      if (data.status === 'queued' && !this.result) Object.assign(this, { points: [], incumbents: [] });
      this.status = data;
      this.#tell('status');
    } else if (kind === 'convergence') {
      if (this.result) return;
      this.points.push(data);
      this.#tell('search');
    } else if (kind === 'incumbent') {
      this.incumbents = kept(this.incumbents, data);
      this.#tell('incumbent');
    } else if (kind === 'end') {
      this.connected = true;
      // Of a plan that was removed nothing more can be asked.
      this.status = { ...this.status, status: data.status };
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
    if (this.#closed) return;
    this.#tell('end');
    if (this.result) this.#measure();
    if (this.result) this.#recall(this.result.timing.run_ms / 1000);
  }

  /** Without an answer, the ground is known as it is drawn. */
  async #measure() {
    const above = await heightsAbove(this).catch(() => null);
    if (this.#closed || !above) return;
    this.above = above;
    this.#tell('ground');
  }

  /** Fetches the routes that were best on the way, where a short search was told of in few of them or in none. */
  #recall(seconds) {
    // More than are kept, for many of the windows that a rate makes of a search have none.
    const rate = (4 * MOST_INCUMBENTS) / Math.max(seconds, 1e-3);
    if (this.incumbents.length && rate <= RATE_HZ) return;
    let all = [];
    this.#stream = follow(this.id, (kind, data) => {
      if (kind === 'status' && data.status === 'queued') all = [];
      else if (kind === 'incumbent') all = kept(all, data);
      else if (kind === 'end') {
        this.incumbents = all;
        this.#tell('history');
      }
    }, () => {}, { rateHz: rate > MOST_HZ ? 0 : rate, aside: this.#aside });
  }

  #tell(what) {
    this.dispatchEvent(new CustomEvent('news', { detail: what }));
  }
}

/** The history with one more route. Every other one of its older half goes when it is full, so that all of it stays in sight. */
function kept(incumbents, one) {
  const more = [...incumbents, one];
  return more.length > MOST_INCUMBENTS ? more.filter((_, at) => at > MOST_INCUMBENTS / 2 || at % 2 === 0) : more;
}
