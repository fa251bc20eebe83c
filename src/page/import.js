// A file as a scenario: read here where it is one already, turned into one by the service where it is a map.

import { Said, ask } from './api.js';

/** The document in a file, and what there is to say about it. */
export async function readFile(file) {
  const text = await file.text();
  const kml = /\.kml$/i.test(file.name) || text.trimStart().startsWith('<');
  if (!kml) {
    let document;
    try {
      document = JSON.parse(text);
    } catch (error) {
      throw new Said(`${file.name} is no JSON: ${error.message}`);
    }
    if (document?.start || document?.target || document?.threats) return { document, note: null };
  }
  const type = kml ? 'application/vnd.google-earth.kml+xml' : 'application/json';
  const { scenario, assumed, unused } = await ask('/scenarios:convert', { method: 'POST', body: text, type });
  const notes = [
    ['Taken for granted', assumed.map(({ reason }) => reason)],
    ['Not used', unused.map(({ where, reason }) => `${where}, ${reason}`)],
  ];
  const said = notes.filter(([, list]) => list.length).map(([title, list]) => `${title}: ${list.join('; ')}.`);
  return { document: scenario, note: said.join(' ') || null };
}
