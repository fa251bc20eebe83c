// A file as a scenario: read here where it is one already, turned into one by the service where it is a map.

import { Said, ask } from './api.js';
import { threatName } from './words.js';

/** So many places are named for a reason, and so many reasons given: the rest is counted. */
const NAMED = 3;
const REASONS = 5;
const CAN_BE_OPENED = 'What can be opened: scenarios in JSON, GeoJSON, KML, and plans of QGroundControl.';

/** The document in a file, and what there is to say about it. */
export async function readFile(file) {
  const text = await file.text();
  const kml = /\.kml$/i.test(file.name) || text.trimStart().startsWith('<');
  if (text.startsWith('PK')) throw new Said(`${file.name} is a zip archive, as KMZ is: unpack it, and open the doc.kml in it.`);
  if (!kml) {
    let document;
    try {
      document = JSON.parse(text);
    } catch (error) {
      throw new Said(`${file.name} is no JSON: ${error.message}. ${CAN_BE_OPENED}`);
    }
    if (document?.engine_version && document?.waypoints) throw new Said(`${file.name} is a result, not a scenario: what can be opened is the Scenario, JSON beside it.`);
    if (document?.start || document?.target || document?.threats) {
      const wrong = misshapen(document);
      if (wrong) throw new Said(`${file.name} is no scenario: ${wrong}.`);
      return { document, note: null };
    }
  }
  const type = kml ? 'application/vnd.google-earth.kml+xml' : 'application/json';
  // As it is: what its bytes mean is for the service to say.
  const { scenario, assumed, unused } = await ask('/scenarios:convert', { method: 'POST', body: file, type }).catch((refusal) => {
    throw [400, 422].includes(refusal.status) ? new Said(`${file.name} holds no scenario: ${refusal.message.replace(/\.$/, '')}. ${CAN_BE_OPENED}`) : refusal;
  });
  const notes = [
    ['Taken for granted', grouped(assumed.map(({ pointer, reason }) => [fieldName(pointer, scenario), reason]))],
    ['Not used', grouped(unused.map(({ where, reason }) => [where, reason]))],
  ];
  const said = notes.filter(([, list]) => list.length).map(([title, list]) => `${title}: ${list.join('; ')}.`);
  return { document: scenario, note: said.join(' ') || null };
}

/** `[what, reason]` said once for each reason, with those that share it. */
function grouped(pairs) {
  const by = new Map();
  for (const [what, reason] of pairs) by.set(reason, [...(by.get(reason) ?? []), what]);
  const all = [...by].map(([reason, whats]) => {
    const names = whats.slice(0, NAMED).join(', ');
    return `${names}${whats.length > NAMED ? ` and ${whats.length - NAMED} more` : ''} (${reason})`;
  });
  return all.length > REASONS ? [...all.slice(0, REASONS), `and for ${all.length - REASONS === 1 ? 'one more reason' : `${all.length - REASONS} more reasons`}`] : all;
}

/** `/threats/3/base` as `base of threat 3`, by its name if it has one. */
function fieldName(pointer, { threats = [] }) {
  const parts = pointer.split('/').slice(1);
  const [, index] = pointer.match(/^\/threats\/(\d+)\//) ?? [];
  return index === undefined ? parts.join(' ') : `${parts.slice(2).join(' ')} of ${threatName(threats[index], index)}`;
}

/** What the page cannot draw, in words; null where all parts have the shapes of a scenario. Their values are the service's to judge. */
function misshapen(document) {
  const record = (value) => typeof value === 'object' && value !== null && !Array.isArray(value);
  const faults = [];
  const need = (value, test, what, kind) => { if (value !== undefined && value !== null && !test(value)) faults.push(`its ${what} must be ${kind}`); };
  const needRecord = (value, what) => need(value, record, what, 'an object');
  const needRecords = (value, what) => need(value, (list) => Array.isArray(list) && list.every(record), what, 'a list of objects');
  if (!record(document)) return 'it must be an object';
  for (const part of ['start', 'target', 'area', 'terrain', 'altitude', 'vehicle', 'weights', 'planner']) needRecord(document[part], part);
  needRecords(document.threats, 'threats');
  if (faults.length) return faults.join(', ');
  for (const end of ['min', 'max']) needRecord(document.area?.[end], `area ${end}`);
  needRecords(document.terrain?.peaks, 'terrain peaks');
  for (const { center, vertices } of document.threats ?? []) {
    needRecord(center, 'centers of threats');
    needRecords(vertices, 'vertices of threats');
  }
  if (faults.length) return [...new Set(faults)].join(', ');
  for (const { center, spread } of document.terrain?.peaks ?? []) {
    needRecord(center, 'centers of peaks');
    needRecord(spread, 'spreads of peaks');
  }
  return faults.length ? [...new Set(faults)].join(', ') : null;
}
