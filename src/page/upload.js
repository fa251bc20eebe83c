// A file of elevations that is to be a dataset of the service, and the ground of the scenario that is open.

import { Refused, Said, Unreachable, ask, send } from './api.js';
import { by } from './dom.js';
import { isGeodetic } from './frame.js';
import { EMPTY, emptyOver } from './new.js';
import { tell } from './notice.js';
import { bytes, share } from './words.js';

/** What a dataset's name may be; the service says so too, but only after the whole file has come. */
const NAME = /^[a-z0-9][a-z0-9_-]{0,63}$/;

/** By their names: GeoTIFF, ESRI ASCII grid or SRTM, which may be compressed. */
const ELEVATIONS = /\.(tiff?|asc|hgt)(\.gz)?$/i;

/**
 * Asks whether to upload a file of elevations, does so, and chooses it; returns false for another file. `datasets()` looks for what can be
 * chosen, `begin(document)` begins another scenario.
 */
export async function asGround(file, draft, { datasets, begin }) {
  if (!ELEVATIONS.test(file.name)) return false;
  if (by('upload').open) return true;
  await permitted(file);
  const dataset = await uploaded(file);
  if (dataset) {
    await datasets();
    choose(dataset, draft, begin);
  }
  return true;
}

function choose(dataset, draft, begin) {
  if (isGeodetic(draft.document)) {
    draft.set('/terrain', { kind: 'dataset', name: dataset.name });
    tell(`“${dataset.name}” is a dataset of the service now, and the ground of this scenario.`, 'note');
  } else {
    tell(`“${dataset.name}” is a dataset of the service now. Only a scenario in degrees can have it as its ground.`, 'note', ['Begin one there', () => {
      tell('');
      begin(emptyOver(dataset));
    }]);
  }
}

/** Asked first, for else it would be refused after all of it has been sent. */
async function permitted(file) {
  try {
    await ask('/plans?validate_only=true', { method: 'POST', body: EMPTY });
  } catch (refusal) {
    if (refusal.status === 403) throw new Said(`${file.name} is not uploaded: this key may look at plans and datasets, but may upload none.`);
    if (!(refusal instanceof Refused) || refusal.status === 401) throw refusal;
  }
  const { terrain_bytes: most } = await ask('/limits');
  if (file.size > most) throw new Said(`${file.name} is not uploaded: it has ${bytes(file.size)}, and the service takes datasets of at most ${bytes(most)}.`);
}

/** Promises what the service says of the new dataset; null where the person gives up. */
function uploaded(file) {
  const [dialog, name, crs] = ['upload', 'upload-name', 'upload-crs'].map(by);
  const stop = new AbortController();
  by('upload-what').textContent = `${file.name}, ${bytes(file.size)}. Everybody who may use the service can plan over it.`;
  name.value = nameOf(file.name);
  crs.value = '';
  /** The name of a dataset that is to be replaced. */
  let replaced = null;
  occupied(null);
  fault('');
  return new Promise((done) => {
    name.oninput = () => {
      replaced = null;
      by('upload-yes').textContent = 'Upload';
    };
    name.oninput();
    by('upload-no').onclick = () => dialog.close();
    // Enter is not to do what cannot be undone.
    name.onkeydown = crs.onkeydown = (event) => { if (event.key === 'Enter' && replaced !== null) event.preventDefault(); };
    dialog.onclose = () => {
      stop.abort();
      done(null);
    };
    dialog.querySelector('form').onsubmit = async (event) => {
      event.preventDefault();
      fault('');
      occupied('It is being sent.');
      try {
        const dataset = await put(file, { name: name.value.trim(), crs: crs.value.trim(), replaced, signal: stop.signal });
        done(dataset);
        dialog.close();
      } catch (refusal) {
        if (!dialog.open) return;
        occupied(null);
        if (refusal instanceof Taken) {
          replaced = name.value.trim();
          by('upload-yes').textContent = 'Replace it';
        }
        fault(reason(refusal), /\bcrs\b|reference system/.test(refusal.message) ? crs : name);
      }
    };
    dialog.showModal();
    name.select();
  });
}

/** The name is that of another dataset. */
class Taken extends Said {
  constructor(name) { super(`There is a dataset “${name}” already. Give this one another name, or replace that one.`); }
}

async function put(file, { name, crs, replaced, signal }) {
  if (!NAME.test(name)) throw new Said('A name has 1 to 64 lower-case letters, digits, - and _, the first a letter or a digit.');
  const { terrains } = await ask('/terrains', { signal });
  if (name !== replaced && terrains.some((one) => one.name === name)) throw new Taken(name);
  const query = new URLSearchParams();
  if (crs) query.set('crs', crs);
  // That of a tile says where it belongs.
  if (/\.hgt/i.test(file.name)) query.set('filename', file.name.replace(/\.gz$/i, ''));
  const headers = { ...(name === replaced ? {} : { 'if-none-match': '*' }), ...(/\.gz$/i.test(file.name) ? { 'content-encoding': 'gzip' } : {}) };
  const progress = (part) => occupied(part < 1 ? `${share(part)} has been sent.` : 'All of it has been sent; the service reads it.', part);
  const sent = { method: 'PUT', body: file, type: 'application/octet-stream', headers, signal, progress };
  const answer = await send(`/terrains/${name}${query.size ? `?${query}` : ''}`, sent);
  return answer.json();
}

function reason(refusal) {
  if (refusal instanceof Unreachable) return 'The connection was lost before the service had all of it.';
  if (refusal.status === 403) return 'That dataset is somebody else’s, and this key may not replace it. Give this one another name.';
  return refusal.message;
}

/** Shows how far it has come; null while there is nothing to wait for. */
function occupied(text, part = 0) {
  for (const id of ['upload-name', 'upload-crs', 'upload-yes']) by(id).disabled = text !== null;
  by('upload-state').hidden = text === null;
  by('upload-said').textContent = text ?? '';
  by('upload-progress').value = part;
}

/** Shows what is wrong at a field; '' for nothing. */
function fault(text, field = null) {
  by('upload-fault').textContent = text;
  by('upload-fault').hidden = !text;
  for (const id of ['upload-name', 'upload-crs']) by(id).removeAttribute('aria-invalid');
  if (!field) return;
  field.setAttribute('aria-invalid', 'true');
  field.focus();
}

/** What a file's name leaves of a dataset's. That of a tile ends at its first dot. */
function nameOf(file) {
  const stem = /\.hgt/i.test(file) ? file.split('.')[0] : file.replace(/\.gz$/i, '').replace(/\.[^.]+$/, '');
  return stem.toLowerCase().replace(/[^a-z0-9_-]+/g, '-').replace(/^[-_]+|-+$/g, '').slice(0, 64);
}
