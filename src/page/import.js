// A file as a scenario: read here where it is one already, turned into one by the service where it is a map.

import { Said, ask } from './api.js';
import { frameOf } from './frame.js';
import { threatName } from './words.js';

/** So many places are named for a reason, and so many reasons given: the rest is counted. */
const NAMED = 3;
const REASONS = 5;
/** How far from start and target the service looks for zones at least, and at most. */
const LEAST_M = 1000;
const MOST_M = 100000;
const CAN_BE_OPENED = 'What can be opened: scenarios in JSON, GeoJSON, KML, plans of QGroundControl, maps of airspace (OpenAir, ED-269, ED-318), and elevations (.tif, .asc, .hgt).';

/**
 * The document in a file, and what there is to say about it. A map without start and target is laid over `open`, the document that is
 * shown; `area` is then that of the map, where the document keeps one of its own.
 */
export async function readFile(file, open) {
  const text = await file.text();
  const kml = /\.kml$/i.test(file.name) || text.trimStart().startsWith('<');
  // A comment or a record of OpenAir.
  const lines = !kml && /^\s*(\*|[A-Z]{2}\s)/.test(text);
  if (text.startsWith('PK')) throw new Said(`${file.name} is a zip archive, as KMZ is: unpack it, and open the doc.kml in it.`);
  if (!kml && !lines) {
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
  const type = kml ? 'application/vnd.google-earth.kml+xml' : lines ? 'text/plain' : 'application/json';
  // As it is: what its bytes mean is for the service to say.
  const converted = (query) => ask(`/scenarios:convert${query}`, { method: 'POST', body: file, type });
  const ends = endsOf(open);
  try {
    return whole(await converted(''));
  } catch (refusal) {
    if (!ends || refusal.problem?.type !== '/problems/no-scenario') throw inWords(refusal, file, ends);
  }
  try {
    return laidOver(open, await converted(`?${new URLSearchParams({ ...ends, ...within(open) })}`));
  } catch (refusal) {
    throw inWords(refusal, file, ends);
  }
}

function inWords(refusal, file, ends) {
  if (![400, 422].includes(refusal.status)) return refusal;
  const why = refusal.message.replace(/\.$/, '');
  const how = ends || !/^no (start|target)/.test(why) ? '' : ' A map of zones is laid over a scenario in degrees that has both: open or begin one first.';
  return new Said(`${file.name} holds no scenario: ${why}.${how} ${CAN_BE_OPENED}`);
}

/** The start and the target of a document in degrees, as the service takes them; null where it has none. */
function endsOf({ frame, start, target }) {
  const places = [start, target].map((end) => [end?.lat, end?.lon, end?.alt ?? 0]);
  if (frame !== 'wgs84' || !places.flat().every(Number.isFinite)) return null;
  return { start: places[0].join(','), target: places[1].join(',') };
}

/**
 * How far from start and target zones are wanted, where the document has an area that leads farther than the service looks by itself:
 * none in it is to be left out.
 */
function within({ area, ...document }) {
  const { to } = frameOf(document);
  const [start, target, min, max] = [document.start, document.target, area?.min, area?.max].map((place) => to(place ?? {}));
  const far = ['x', 'y'].flatMap((axis) => [Math.min(start[axis], target[axis]) - min[axis], max[axis] - Math.max(start[axis], target[axis])]);
  const wanted = Math.ceil(Math.max(...far) * 1.02);
  const usual = Math.max(LEAST_M, Math.hypot(target.x - start.x, target.y - start.y) / 2);
  return wanted > usual ? { within: String(Math.min(wanted, MOST_M)) } : {};
}

/** What was converted, as a document of its own. */
function whole({ scenario, assumed, unused }) {
  return { document: scenario, note: note(scenario, assumed, unused) };
}

/** The zones of a map as further threats of the document that is open, in the area that this has; in one around the zones where it has none. */
function laidOver(open, { scenario, assumed, unused }) {
  const datum = open.altitude_datum ?? 'msl';
  const limited = scenario.threats.some(({ base, top }) => base !== null || top !== null);
  if (limited && datum !== scenario.altitude_datum) {
    throw new Said(`The heights in the file are above another datum (${scenario.altitude_datum}) than those of the scenario (${datum}).`);
  }
  const { threats } = scenario;
  const kept = Object.keys(open.area ?? {}).length > 0;
  const document = { ...open, area: kept ? open.area : scenario.area, threats: [...(open.threats ?? []), ...threats] };
  const added = threats.length === 1 ? 'One threat was added.' : `${threats.length} threats were added.`;
  const ofZones = assumed.filter(({ pointer }) => /^\/(area|threats)/.test(pointer));
  if (!kept) return { document, note: [added, note(scenario, ofZones, unused)].filter(Boolean).join(' ') };
  const said = note(scenario, ofZones.filter(({ pointer }) => pointer !== '/area'), unused);
  return { document, area: scenario.area, note: [added, ofArea(ofZones), said].filter(Boolean).join(' ') };
}

/** What there is to say of an area that stays: how many zones are too far off, of which the service tells beside the one that it took. */
function ofArea(assumed) {
  const [, count] = assumed.find(({ pointer }) => pointer === '/area')?.reason.match(/left out: (\d+)/) ?? [];
  return `The scenario keeps its area.${Number(count) ? ` Zones of the map that lie elsewhere are left out: ${count}.` : ''}`;
}

/** What there is to say of a conversion; null where there is nothing. */
function note(scenario, assumed, unused) {
  const notes = [
    ['Taken for granted', grouped(assumed.map(({ pointer, reason }) => [fieldName(pointer, scenario), reason]))],
    ['Not used', grouped(unused.map(({ where, reason }) => [where, reason]))],
  ];
  const said = notes.filter(([, list]) => list.length).map(([title, list]) => `${title}: ${list.join('; ')}.`);
  return said.join(' ') || null;
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
