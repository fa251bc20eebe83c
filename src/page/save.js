// Files, and a link, handed to the person in front.

import { send } from './api.js';

/** A file of this name, with these bytes. */
export function saveBlob(blob, name) {
  const address = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

/**
 * What the service answers, as a file of the name that it gives, or else of this one, or of this one `anyway`: by a request of ours, for a
 * link could not bring a key.
 */
export async function saveFrom(path, name, anyway = false) {
  const answer = await send(path);
  const [, given] = answer.headers.get('content-disposition')?.match(/filename="([^"]+)"/) ?? [];
  saveBlob(await answer.blob(), anyway ? name : given ?? name);
}

/** Puts the address of what is shown into the clipboard, which a page has none of over plain HTTP. Returns what to say of it. */
export async function copyLink() {
  try {
    await navigator.clipboard.writeText(location.href);
    return 'The link is in the clipboard. It opens this plan.';
  } catch {
    return `The browser lets this page copy nothing. The link to this plan is ${location.href}`;
  }
}

/** A file's name that says of which plan it is, and `what` of it: the service tells plans apart by the ends of their ids, too. */
export function fileName({ id, scenario }, what, extension) {
  const plain = (scenario.name ?? '').toLowerCase().normalize('NFKD').replace(/[^a-z0-9]+/g, '-').replace(/^-+|-+$/g, '').slice(0, 60);
  return `${plain || 'plan'}-${id.slice(-8)}-${what}.${extension}`;
}
