// Which drafts are nowhere but in this page: the browser asks before it leaves one.

const kept = new WeakSet();

/** It can be had again as it is: it was loaded, or the service plans it. */
export const keep = (document) => { kept.add(document); };

export const isKept = (document) => !document || kept.has(document);

/** Has the browser ask before `draft` is lost. */
export function guard(draft) {
  addEventListener('beforeunload', (event) => { if (!isKept(draft.document)) event.preventDefault(); });
}
