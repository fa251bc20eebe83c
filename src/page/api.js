// What the service is asked, and what its refusals say. The key lives here, in memory, and nowhere else.

let key = null;
let keyAsker = async () => null;
let asking = null;
let declined = false;

/** `ask(why)` is called when the service wants a key, and promises one or null. */
export function onKeyNeeded(ask) {
  keyAsker = ask;
}

/** Whether a key is in use. */
export const hasKey = () => key !== null;

/** Forgets the key. */
export function forgetKey() {
  key = null;
}

/** Something that a person can understand and do something about. */
export class Said extends Error {}

export const UNREACHABLE = 'The service cannot be reached.';

/** No answer at all. */
export class Unreachable extends Said {
  constructor() { super(UNREACHABLE); }
}

/** A refusal: the problem document, or what stood in its place. */
export class Refused extends Said {
  constructor(status, problem) {
    super(problem?.detail || problem?.title || `the service answered ${status}`);
    this.status = status;
    this.problem = problem ?? {};
  }
}

/**
 * The answer to a request; throws `Refused` for one that is none, and asks for a key where one is needed. What is
 * done on the `quiet` does not ask again after a no. `progress(share)` hears how much of a long body has been sent.
 */
export async function send(path, { method = 'GET', body, type = 'application/json', headers = {}, signal, quiet = false, progress } = {}) {
  for (;;) {
    const used = key;
    const answer = await reach(path, {
      method,
      signal,
      body: body === undefined || typeof body === 'string' || body instanceof Blob ? body : JSON.stringify(body),
      headers: {
        ...(body === undefined ? {} : { 'content-type': type }),
        ...(used ? { authorization: `Bearer ${used}` } : {}),
        ...headers,
      },
    }, progress);
    if (answer.ok) return answer;
    const problem = await answer.json().catch(() => null);
    if (answer.status !== 401) throw new Refused(answer.status, problem);
    // Another request may have brought one meanwhile; else one dialogue for all that wait.
    if (key === used) {
      if (quiet && declined) throw keyless(answer.status, problem);
      asking ??= keyAsker(used ? problem?.detail : null).finally(() => { asking = null; });
      const given = await asking;
      declined = !given;
      if (!given) throw keyless(answer.status, problem);
      key = given;
    }
  }
}

/** Each browser has words of its own for a fetch that failed. */
async function reach(path, options, progress) {
  try {
    return await (progress ? watched(path, options, progress) : fetch(path, options));
  } catch (error) {
    throw error instanceof TypeError ? new Unreachable() : error;
  }
}

/** What `fetch` does, which does not tell how much has been sent. */
function watched(path, { method, headers, body, signal }, progress) {
  return new Promise((done, failed) => {
    const request = new XMLHttpRequest();
    request.open(method, path);
    for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
    request.responseType = 'blob';
    request.upload.addEventListener('progress', ({ loaded, total }) => progress(total ? loaded / total : 1));
    request.addEventListener('load', () => done(new Response(request.response, { status: request.status })));
    request.addEventListener('error', () => failed(new TypeError('no answer')));
    request.addEventListener('abort', () => failed(new DOMException('given up', 'AbortError')));
    signal?.addEventListener('abort', () => request.abort());
    request.send(body);
  });
}

/** The service says how a program sends a key; a person is asked for one. */
const keyless = (status, problem) => new Refused(status, { ...problem, detail: 'This needs a key of the service, and none was given.' });

/** The same, as JSON. */
export async function ask(path, options) {
  return (await send(path, options)).json();
}

/** The address of a plan's events: with a ticket where a key is in use, for an EventSource sends no headers. */
export async function eventsAddress(id, after, rateHz) {
  const query = new URLSearchParams({ rate: String(rateHz) });
  if (after) query.set('last_event_id', String(after));
  if (key) query.set('ticket', (await ask(`/plans/${id}/tickets`, { method: 'POST' })).ticket);
  return `/plans/${id}/events?${query}`;
}
