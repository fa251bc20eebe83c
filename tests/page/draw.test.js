// Scenarios are chosen, opened, dropped, drawn and corrected.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { SMALL, ask, color, FIRST, document_, drawn, drop, fill, groundPoint, held, open, pixels, scene, service, settled } from './support.js';
import { chrome, site } from './together.js';

test('a shipped scenario is there at once, and another is one choice away', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  assert.match(await page.title(), /Jacksboro.*Noctule/);
  // Flat until the service has returned its ground.
  await page.waitForFunction(() => globalThis.noctule.scene().ground.kind === 'mesh');
  await page.selectOption('#source', 'paper-4');
  await drawn(page, 5);
  assert.deepEqual((await scene(page)).ground.kind, 'mesh');
  assert.match(await page.getAttribute('#canvas', 'aria-label'), /Ground 1,000 m by 1,000 m, from 0 to \d+ m; 5 threats; start and target; no route yet/);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  assert.equal((await scene(page)).ground.kind, 'plane');
  await page.done();
});

test('files are opened and dropped: a scenario, GeoJSON, KML', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.setInputFiles('#file', { name: 'mine.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(SMALL)) });
  await drawn(page, 1);
  assert.equal((await document_(page)).name, 'small');
  const place = (name, lon, lat, alt) => ({ type: 'Feature', properties: { name, role: name }, geometry: { type: 'Point', coordinates: [lon, lat, alt] } });
  const no_fly = { type: 'Feature', properties: { name: 'town' }, geometry: { type: 'Polygon', coordinates: [[[-84.2, 36.5], [-84.19, 36.5], [-84.19, 36.51], [-84.2, 36.5]]] } };
  const map = { type: 'FeatureCollection', features: [place('start', -84.23, 36.48, 400), place('target', -84.16, 36.53, 400), no_fly] };
  await drop(page, 'map.geojson', JSON.stringify(map), 'application/geo+json');
  await page.waitForFunction(() => globalThis.noctule.document().frame === 'wgs84');
  await drawn(page, 1);
  const kml = readFileSync(new URL('./map.kml', import.meta.url), 'utf8');
  await drop(page, 'map.kml', kml, '');
  await page.waitForFunction(() => globalThis.noctule.document().start?.lat === 36.49);
  await drawn(page, 1);
  await drop(page, 'map.kmz', 'PK\u0003\u0004', '');
  await page.waitForFunction(() => /map\.kmz is a zip archive/.test(document.getElementById('notice').textContent));
  await drop(page, 'broken.json', '{"start": ', 'application/json');
  await page.waitForSelector('#notice:not([hidden])');
  assert.match(await page.textContent('#notice'), /broken\.json is no JSON/);
  await page.done();
});

test('a map of zones is laid over a scenario in degrees', async () => {
  const page = await open(chrome, site.url);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  const zone = (name, center, floor) => `AC R\nAN ${name}\nAL ${floor}\nAH 9500ft MSL\nV X=${center}\nDC 0.2\n`;
  const map = `* Zones\n${zone('range', '36:30:00 N 084:12:00 W', 'GND')}${zone('plant', '36:30:30 N 084:11:00 W', '500ft AGL')}${zone('abroad', '47:00:00 N 008:00:00 E', 'GND')}`;
  await drop(page, 'zones.txt', map, 'text/plain');
  await page.waitForFunction(() => /zones\.txt holds no scenario: no start and no target in the file.*over a scenario in degrees/.test(document.getElementById('notice').textContent));
  const kml = readFileSync(new URL('./map.kml', import.meta.url), 'utf8');
  await drop(page, 'map.kml', kml, '');
  await page.waitForFunction(() => globalThis.noctule.document().start?.lat === 36.49);
  const before = await document_(page);
  await drop(page, 'zones.txt', map, 'text/plain');
  await drawn(page, before.threats.length + 2);
  const after = await document_(page);
  assert.deepEqual({ ...after, area: before.area, threats: before.threats }, { area: undefined, ...before });
  assert.deepEqual(after.threats.slice(before.threats.length).map(({ name, top }) => [name, top]), [['range', 2895.6], ['plant', 2895.6]]);
  assert.ok(after.area.min.lat < after.start.lat);
  const said = await page.textContent('#notice');
  assert.match(said, /2 threats were added\. Taken for granted: area \(\d+ m beyond start and target .* left out: 1\); threats \(1 of them without a base/);
  await page.click('#undo');
  await drawn(page, before.threats.length);
  // Heights above another datum are not mixed.
  await drop(page, 'ellipsoid.json', JSON.stringify({ ...before, altitude_datum: 'ellipsoid' }), 'application/json');
  await page.waitForFunction(() => globalThis.noctule.document().altitude_datum === 'ellipsoid');
  await drop(page, 'zones.txt', map, 'text/plain');
  await page.waitForFunction(() => /above another datum \(msl\) than those of the scenario \(ellipsoid\)/.test(document.getElementById('notice').textContent));
  await page.done();
});

test('a map of zones leaves the area as it was, until the person says otherwise', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const area = { min: { lat: 36.4, lon: -84.4 }, max: { lat: 36.6, lon: -84.1 } };
  const own = { name: 'own', frame: 'wgs84', start: { lat: 36.49, lon: -84.23, alt: 400 }, target: { lat: 36.5, lon: -84.22, alt: 400 }, area, threats: [], altitude: { min: 20, max: 300 } };
  await drop(page, 'own.json', JSON.stringify(own), 'application/json');
  await page.waitForFunction(() => globalThis.noctule.document().name === 'own');
  const zone = (name, center) => `AC R\nAN ${name}\nAL GND\nAH 9500ft MSL\nV X=${center}\nDC 0.2\n`;
  // Far from the flight, and within the area all the same.
  await drop(page, 'zones.txt', zone('edge', '36:35:00 N 084:22:00 W') + zone('abroad', '47:00:00 N 008:00:00 E'), 'text/plain');
  await drawn(page, 1);
  assert.equal((await document_(page)).threats[0].name, 'edge');
  assert.deepEqual((await document_(page)).area, area);
  assert.match(await page.textContent('#notice'), /One threat was added\. The scenario keeps its area\. Zones of the map that lie elsewhere are left out: 1\./);
  await page.click('#notice >> text=Take the area of the map');
  await page.waitForFunction(() => /The area is that of the map/.test(document.getElementById('notice').textContent));
  const wider = (await document_(page)).area;
  assert.ok(wider.min.lat <= area.min.lat && wider.max.lon >= area.max.lon, JSON.stringify(wider));
  await page.click('#undo');
  assert.deepEqual((await document_(page)).area, area);
  await page.done();
});

test('a file that is no scenario is refused in words, and leaves the page as it was', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const before_ = await document_(page);
  const { start, target, altitude } = SMALL;
  for (const wrong of [
    { threats: {} }, { threats: [null] }, { threats: 'abc' }, { start: 5 }, { start, target, terrain: { kind: 'peaks', peaks: 5 } },
    { start, target, altitude, threats: [{ kind: 'polygon', vertices: {} }] }, { start, target, threats: [{ kind: 'cylinder', center: 3 }] },
    { start, target, area: [] }, { start, target, terrain: { kind: 'peaks', peaks: [{ center: 1 }] } },
  ]) {
    await drop(page, 'wrong.json', JSON.stringify(wrong), 'application/json');
    await page.waitForFunction(() => /wrong.json is no scenario: its [a-z ]+ must be/.test(document.getElementById('notice').textContent));
    await page.click('#notice [aria-label=Dismiss]');
  }
  for (const [name, text] of [['track.gpx', '<gpx version="1.1"></gpx>'], ['track.csv', 'lat,lon\n1,2\n'], ['other.json', '{"a":1}']]) {
    await drop(page, name, text, '');
    await page.waitForFunction((start_) => new RegExp(`^${start_}[^]*What can be opened: .*KML`).test(document.getElementById('notice').textContent), name);
  }
  await drop(page, 'result.json', JSON.stringify({ engine_version: '0.1.0', waypoints: [start, target] }), 'application/json');
  await page.waitForFunction(() => /result.json is a result, not a scenario/.test(document.getElementById('notice').textContent));
  assert.deepEqual(await document_(page), before_);
  await page.done();
});

test('what a scenario leaves open is not taken from the one before', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const hint = (pointer) => page.getAttribute(`[data-pointer="${pointer}"]`, 'placeholder');
  await page.waitForFunction(() => /^\d+\.?\d{0,5}$/.test(document.querySelector('[data-pointer="/vehicle/min_leg"]').placeholder));
  const { start, target } = SMALL;
  const bare = { start, target, threats: [{ kind: 'cylinder', center: { x: 500, y: 500 } }] };
  await drop(page, 'bare.json', JSON.stringify(bare), 'application/json');
  await page.waitForSelector('[data-pointer="/altitude/min"][aria-invalid=true]');
  for (const pointer of ['/altitude/min', '/threats/0/radius', '/vehicle/min_leg']) assert.equal(await hint(pointer), '–', pointer);
  await page.done();
});

test('a field that is no number yet moves nothing else', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const peak = { center: { x: 300, y: 300 }, height: 20, spread: { x: 90, y: 90 } };
  const polygon = { kind: 'polygon', vertices: [{ x: 700, y: 100 }, { x: 800, y: 100 }, { x: 800, y: 200 }], margin: 20 };
  const { area, ...open_ } = SMALL;
  const document = { ...open_, terrain: { kind: 'peaks', base: 0, peaks: [peak] }, threats: [...SMALL.threats, polygon] };
  await drop(page, 'letters.json', JSON.stringify(document), 'application/json');
  await drawn(page, 2);
  for (const pointer of ['/threats/0/influence', '/threats/1/margin', '/terrain/base', '/terrain/peaks/0/height', '/terrain/peaks/0/spread/x', '/terrain/peaks/0/center/x']) {
    const [before] = await page.$$eval(`[data-pointer="${pointer}"]`, (fields) => fields.map((field) => field.value));
    await page.evaluate((at) => {
      for (let node = document.querySelector(`[data-pointer="${at}"]`); node; node = node.parentElement) if (node.tagName === 'DETAILS') node.open = true;
    }, pointer);
    await fill(page, pointer, '12a');
    await page.waitForSelector(`[data-pointer="${pointer}"][aria-invalid=true]`);
    assert.ok(await page.evaluate(() => Number.isFinite(globalThis.noctule.groundAt(500, 500))), pointer);
    await fill(page, pointer, before);
  }
  await drawn(page, 2);
  await page.done();
});

test('what a map has too much of is told briefly', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const point = (name, lon) => ({ type: 'Feature', properties: { name }, geometry: { type: 'Point', coordinates: [lon, 36.5, 400] } });
  const line = (k) => ({ type: 'Feature', properties: { name: `line ${k}` }, geometry: { type: 'LineString', coordinates: [[-84.2, 36.5], [-84.2, 36.51 + k / 1e5]] } });
  const map = { type: 'FeatureCollection', features: [point('start', -84.23), point('target', -84.16), ...Array.from({ length: 150 }, (_, k) => line(k))] };
  await drop(page, 'lines.geojson', JSON.stringify(map), 'application/geo+json');
  await page.waitForFunction(() => /Not used: .* and 147 more \(a line/.test(document.getElementById('notice').textContent));
  const { height } = await page.locator('#notice').boundingBox();
  assert.ok(height <= 270, `${height} pixels`);
  assert.ok((await page.textContent('#notice')).length < 800, await page.textContent('#notice'));
  await page.done();
});

test('a scenario is drawn by hand, taken back and done again', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.click('text=Empty');
  await drawn(page, 0);
  const click = async (x, y) => {
    const at = await groundPoint(page, x, y);
    await page.mouse.click(at.x, at.y);
  };
  const toDocument = (p) => p + 500;
  // The frame's origin is the middle of the area: 500, 500.
  await page.click('[data-tool=start]');
  await click(-300, -250);
  let now = await document_(page);
  assert.ok(Math.abs(now.start.x - toDocument(-300)) < 5 && Math.abs(now.start.y - toDocument(-250)) < 5, JSON.stringify(now.start));
  assert.equal(now.start.z, 50, 'as high above ground as before');
  await page.click('[data-tool=cylinder]');
  await click(0, 0);
  await drawn(page, 1);
  now = await document_(page);
  const { radius } = now.threats[0];
  assert.equal((await scene(page)).handles, 3);
  // The handle of the core's radius is to the east.
  const dot = await groundPoint(page, radius, 0);
  const to = await groundPoint(page, radius + 60, 0);
  await page.mouse.move(dot.x, dot.y);
  await page.mouse.down();
  for (const t of [0.3, 0.6, 1]) await page.mouse.move(dot.x + (to.x - dot.x) * t, dot.y + (to.y - dot.y) * t);
  await page.mouse.up();
  const wider = (await document_(page)).threats[0];
  assert.ok(Math.abs(wider.radius - radius - 60) < 6, `${wider.radius}`);
  // Dragging the middle moves the whole threat.
  const [middle, away] = [await groundPoint(page, 0, 0), await groundPoint(page, 120, 90)];
  await page.mouse.move(middle.x, middle.y);
  await page.mouse.down();
  await page.mouse.move((middle.x + away.x) / 2, (middle.y + away.y) / 2);
  await page.mouse.move(away.x, away.y);
  await page.mouse.up();
  const moved = (await document_(page)).threats[0];
  assert.ok(Math.abs(moved.center.x - toDocument(120)) < 6 && Math.abs(moved.center.y - toDocument(90)) < 6, JSON.stringify(moved.center));
  assert.equal(await page.inputValue('[data-pointer="/threats/0/center/x"]'), String(moved.center.x), 'the form says the same');
  await page.click('[data-tool=polygon]');
  for (const [x, y] of [[-400, 200], [-250, 200], [-250, 350]]) await click(x, y);
  await page.keyboard.press('Enter');
  await drawn(page, 2);
  assert.equal((await document_(page)).threats[1].vertices.length, 3);
  // Polygon, drag, drag: one undo step each.
  await page.click('#undo');
  await drawn(page, 1);
  await page.click('#undo');
  assert.deepEqual((await document_(page)).threats[0].center, now.threats[0].center);
  await page.click('#undo');
  assert.equal((await document_(page)).threats[0].radius, radius);
  await page.click('#redo');
  await page.click('#redo');
  await page.keyboard.press('Control+Shift+z');
  await drawn(page, 2);
  assert.deepEqual((await document_(page)).threats[0], moved);
  await page.done();
});

test('undo across documents shows each as it is, and where it came from no longer', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  // Where the start is seen tells where the camera is.
  const seen = () => page.evaluate(() => {
    const { document, onScreen, toMetres } = globalThis.noctule;
    const { x, y } = onScreen(toMetres(document().start));
    return [Math.round(x), Math.round(y)];
  });
  await page.waitForFunction(() => globalThis.noctule.scene().ground.kind === 'mesh');
  await settled(page);
  const before = await seen();
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await settled(page);
  assert.notDeepEqual(await seen(), before);
  await page.click('#undo');
  await drawn(page, FIRST);
  await settled(page);
  assert.deepEqual(await seen(), before);
  assert.equal(await page.inputValue('#source'), '');
  // A step within a document leaves the camera where it is.
  await fill(page, '/threats/0/radius', '61');
  await page.locator('#undo').click();
  assert.deepEqual(await seen(), before);
  await page.done();
});

test('a scenario in degrees is drawn from nothing, and its route is taken to a ground station', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  const grounds = () => page.locator('[data-pointer="/terrain"] option').allTextContents();
  assert.ok(!(await grounds()).includes('Dataset of the service'), 'metres are nowhere on earth');
  await page.click('#empty-in-degrees');
  await drawn(page, 0);
  const { frame, start, target, area } = await document_(page);
  assert.deepEqual([frame, start.lat < target.lat, start.lon < target.lon], ['wgs84', true, true]);
  const [low, high] = await page.evaluate((corners) => corners.map(globalThis.noctule.toMetres), [area.min, area.max]);
  assert.ok(high.x - low.x > 5000 && high.y - low.y > 5000, 'there is room to draw a mission of some kilometres');
  assert.ok((await grounds()).includes('Dataset of the service'));
  await page.waitForSelector('.faults', { state: 'hidden' });
  await page.click('#plan');
  await page.getByRole('button', { name: 'QGroundControl plan' }).waitFor();
  // Where a map is open, it begins there.
  await fill(page, '/start/lat', '47.5');
  await fill(page, '/target/lat', '47.51');
  await page.click('#empty-in-degrees');
  await drawn(page, 0);
  assert.ok(Math.abs((await document_(page)).start.lat - 47.5) < 0.02);
  await page.done();
});

test('an area is left open again when its fields are emptied', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await page.evaluate(() => { for (const part of document.querySelectorAll('details')) part.open = true; });
  for (const field of ['min/x', 'min/y', 'max/x', 'max/y']) await fill(page, `/area/${field}`, '');
  assert.equal('area' in (await document_(page)), false);
  await page.waitForSelector('.faults', { state: 'hidden' });
  await fill(page, '/area/min/x', '-100');
  assert.deepEqual((await document_(page)).area, { min: { x: -100 } });
  await page.waitForSelector('.faults:not([hidden])');
  await page.done();
});

test('a polygon without corners gets some again', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const bare = { ...SMALL, threats: [{ kind: 'polygon', name: 'bare', vertices: [] }] };
  await page.setInputFiles('#file', { name: 'bare.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(bare)) });
  await page.waitForFunction(() => globalThis.noctule.document().name === 'small');
  await page.evaluate(() => { for (const part of document.querySelectorAll('details')) part.open = true; });
  for (const corners of [1, 2]) {
    await page.getByRole('button', { name: 'Add a corner' }).click();
    assert.equal((await document_(page)).threats[0].vertices.length, corners);
  }
  await page.done();
});

test('a double click closes a polygon, and two corners are none', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.click('text=Empty');
  await drawn(page, 0);
  await page.click('[data-tool=polygon]');
  const places = [];
  for (const [x, y] of [[-400, 200], [-250, 200], [-250, 350]]) places.push(await groundPoint(page, x, y));
  for (const { x, y } of places.slice(0, 2)) await page.mouse.click(x, y);
  await page.keyboard.press('Enter');
  assert.match(await page.textContent('#hint'), /three corners/);
  // Undo takes back a corner, not what was drawn before.
  await page.keyboard.press('Control+z');
  assert.equal((await document_(page)).name, 'untitled');
  assert.equal((await scene(page)).handles, 1);
  await page.mouse.click(places[1].x, places[1].y);
  await page.mouse.dblclick(places[2].x, places[2].y);
  await drawn(page, 1);
  assert.equal((await document_(page)).threats[0].vertices.length, 3);
  await page.done();
});

test('a polygon that is being drawn shows its sides, and those that it would get', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.click('text=Empty');
  await drawn(page, 0);
  const points = async () => (await scene(page)).sketch;
  await page.click('[data-tool=polygon]');
  const places = [];
  for (const [x, y] of [[-400, 200], [-250, 200], [-250, 350], [-400, 350]]) places.push(await groundPoint(page, x, y));
  await page.mouse.click(places[0].x, places[0].y);
  assert.deepEqual(await points(), { sides: 0, band: 0 });
  await page.mouse.move(places[1].x, places[1].y);
  assert.deepEqual(await points(), { sides: 0, band: 17 }, 'to the pointer');
  await settled(page);
  const core = await color(page, 'core');
  const [a, b] = places;
  assert.ok(await pixels(page, core, { x: (a.x + b.x) / 2 - 4, y: (a.y + b.y) / 2 - 6, width: 8, height: 12 }) > 4, 'and is seen');
  await page.mouse.click(places[1].x, places[1].y);
  await page.mouse.move(places[2].x, places[2].y);
  assert.deepEqual(await points(), { sides: 17, band: 33 }, 'to the pointer and back to the first corner');
  await page.mouse.click(places[2].x, places[2].y);
  assert.deepEqual(await points(), { sides: 33, band: 17 }, 'what would close it');
  await page.keyboard.press('Control+z');
  assert.deepEqual(await points(), { sides: 17, band: 0 });
  await page.mouse.click(places[2].x, places[2].y);
  await page.keyboard.press('Enter');
  await drawn(page, 1);
  assert.deepEqual(await points(), { sides: 0, band: 0 });
  await page.done();
});

test('a scenario across the antimeridian is drawn and placed where it is', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  for (const [from, to] of [[179.99, -179.98], [-179.99, 179.98]]) {
    const crossing = {
      name: `from ${from}`, frame: 'wgs84', start: { lat: -16.5, lon: from, alt: 60 }, target: { lat: -16.5, lon: to, alt: 60 },
      threats: [{ kind: 'cylinder', center: { lat: -16.5, lon: 180 }, radius: 200 }], altitude: { min: 20, max: 120 },
    };
    await page.setInputFiles('#file', { name: 'crossing.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(crossing)) });
    await page.waitForFunction((name) => globalThis.noctule.document().name === name, crossing.name);
    await drawn(page, 1);
    await settled(page);
    const [start, target] = await page.evaluate((ends) => ends.map(globalThis.noctule.toMetres), [crossing.start, crossing.target]);
    const east = Math.sign(to - from) * -1;
    // A degree is 106.7 km there.
    assert.ok(Math.abs((target.x - start.x) * east - 3203) < 20, JSON.stringify([start, target]));
    assert.ok(Math.abs(start.x + target.x) < 1 && Math.abs(start.y) < 1, 'the middle is between them');
    for (const x of [-1500, 1500]) {
      await page.click('[data-tool=target]');
      const { x: left, y: top } = await groundPoint(page, x, 300);
      await page.mouse.click(left, top);
      const { lon } = (await document_(page)).target;
      const wanted = x > 0 ? -179.981 : 179.981;
      assert.ok(Math.abs(lon - wanted) < 0.012, `${lon} for ${x} m east`);
      await page.click('#undo');
      await settled(page);
    }
  }
  await page.done();
});

test('faults stand where they are, in the words of the service', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await fill(page, '/threats/0/radius', '-3');
  const field = page.locator('[data-pointer="/threats/0/radius"]');
  await page.waitForSelector('[data-pointer="/threats/0/radius"][aria-invalid=true]');
  const said = await page.textContent(`#${await field.getAttribute('aria-describedby')}`);
  assert.match(said, /^radius is -3, must be > 0/);
  assert.match(await page.textContent('.faults'), /One thing to mend.*radius is -3/s);
  await fill(page, '/altitude/max', 'high');
  await page.waitForSelector('[data-pointer="/altitude/max"][aria-invalid=true]');
  assert.match(await page.textContent('.faults h2'), /2 things to mend/);
  // Planning anyway moves the focus to the first fault.
  await page.click('#plan');
  await page.waitForFunction(() => document.activeElement?.dataset.pointer?.startsWith('/'));
  await fill(page, '/threats/0/radius', '60');
  await fill(page, '/altitude/max', '200');
  await page.waitForSelector('.faults', { state: 'hidden' });
  assert.equal(await page.locator('[aria-invalid]').count(), 0);
  await page.done();
});

test('the ground of a dataset is drawn as the service has it', async (t) => {
  const directory = fileURLToPath(new URL('../../scenarios', import.meta.url));
  const mapped = await service('--terrain-dir', join(directory, 'terrain'));
  t.after(mapped.stop);
  const page = await open(chrome, mapped.url);
  await drawn(page, FIRST);
  await page.waitForFunction(() => globalThis.noctule.scene().ground.columns === 201);
  // Also under ends that lie below it; elsewhere nothing of it.
  await page.click('#empty-in-degrees');
  await drawn(page, 0);
  await page.evaluate(() => { for (const part of document.querySelectorAll('details')) part.open = true; });
  const sampled = page.waitForResponse((response) => response.url().includes('/scenarios:ground'));
  await page.selectOption('[data-pointer="/terrain"]', 'dataset');
  assert.equal((await sampled).status(), 200);
  assert.match(await page.textContent('.faults'), /below the ground/);
  await page.waitForFunction(() => globalThis.noctule.scene().ground.columns === 201);
  const { area, start: low, target: high } = await document_(page);
  const moved = (place) => ({ ...place, lat: place.lat + 10 });
  const elsewhere = { ...(await document_(page)), start: moved(low), target: moved(high), area: { min: moved(area.min), max: moved(area.max) } };
  await page.setInputFiles('#file', { name: 'elsewhere.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(elsewhere)) });
  await page.waitForFunction(() => globalThis.noctule.document().start.lat > 46 && globalThis.noctule.scene().ground.kind === 'plane');
  await page.setInputFiles('#file', join(directory, 'jacksboro-wgs84.json'));
  await page.waitForFunction(() => globalThis.noctule.document().start.lat < 37);
  await page.waitForFunction(() => globalThis.noctule.scene().ground.columns === 201);
  await settled(page);
  const text = readFileSync(join(directory, 'jacksboro-wgs84.json'), 'utf8');
  const { start } = JSON.parse(text);
  const ground = await page.evaluate((p) => {
    const { x, y } = globalThis.noctule.toMetres(p);
    return globalThis.noctule.groundAt(x, y);
  }, start);
  assert.ok(ground > 300 && ground < start.alt + 1, `the ground at the start, ${ground} m, is below it`);
  await page.evaluate(() => { for (const part of document.querySelectorAll('details')) part.open = true; });
  assert.equal(await page.inputValue('[data-pointer="/terrain/name"]'), 'jacksboro', 'and can be chosen');
  await page.done();
});

test('datasets that come and go meanwhile are offered when one is chosen, and when the page is seen again', async (t) => {
  const own = await service();
  t.after(own.stop);
  const file = readFileSync(new URL('../../scenarios/terrain/jacksboro.tif', import.meta.url));
  const put = async (name) => assert.equal((await fetch(`${own.url}/terrains/${name}`, { method: 'PUT', body: file })).status, 201);
  const page = await open(chrome, own.url);
  await drawn(page, FIRST);
  await page.click('#empty-in-degrees');
  await drawn(page, 0);
  await page.click('summary:text-is("Ground")');
  await page.selectOption('[data-pointer="/terrain"]', 'dataset');
  const offered = () => page.locator('[data-pointer="/terrain/name"] option').allTextContents();
  const offers = (names) => page.waitForFunction((wanted) => [...document.querySelectorAll('[data-pointer="/terrain/name"] option')].map(({ textContent }) => textContent).join() === wanted, names.join());
  await offers(['jacksboro']);
  await put('second');
  await page.focus('[data-pointer="/terrain/name"]');
  await offers(['jacksboro', 'second']);
  assert.equal(await page.evaluate(() => document.activeElement.dataset.pointer), '/terrain/name', 'it keeps the focus');
  await page.selectOption('[data-pointer="/terrain/name"]', 'second');
  await put('third');
  await page.evaluate(() => document.dispatchEvent(new Event('visibilitychange')));
  await offers(['jacksboro', 'second', 'third']);
  assert.equal(await page.inputValue('[data-pointer="/terrain/name"]'), 'second', 'what was chosen stays chosen');
  assert.equal((await fetch(`${own.url}/terrains/second`, { method: 'DELETE' })).status, 204);
  await page.click('[data-pointer="/terrain/name"]');
  await offers(['jacksboro', 'third', 'second, which is not there']);
  assert.equal(await page.inputValue('[data-pointer="/terrain/name"]'), 'second', `${await offered()}`);
  await page.done();
});

test('a file of elevations becomes a dataset, and the ground of what is open', async (t) => {
  const own = await service();
  t.after(own.stop);
  const page = await open(chrome, own.url);
  await drawn(page, FIRST);
  await page.click('#empty-in-degrees');
  await drawn(page, 0);
  // By a drop: with a name that is taken, then without a reference system.
  const grid = 'ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 4000000\ncellsize 30\n1 2 3\n4 5 6\n7 8 9\n';
  await drop(page, 'Jacksboro.asc', grid, '');
  await page.waitForSelector('#upload[open]');
  assert.equal(await page.inputValue('#upload-name'), 'jacksboro');
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => /There is a dataset “jacksboro” already/.test(document.getElementById('upload-fault').textContent));
  assert.equal(await page.textContent('#upload-yes'), 'Replace it');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'upload-name');
  await page.keyboard.press('Enter');
  assert.match(await page.textContent('#upload-fault'), /already/, 'Enter replaces nothing');
  await page.fill('#upload-name', 'Small hills');
  assert.equal(await page.textContent('#upload-yes'), 'Upload');
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => /lower-case/.test(document.getElementById('upload-fault').textContent));
  await page.fill('#upload-name', 'hills');
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => /names no coordinate reference system/.test(document.getElementById('upload-fault').textContent));
  assert.equal(await page.evaluate(() => document.activeElement.id), 'upload-crs');
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute('aria-invalid')), 'true');
  await page.keyboard.type('EPSG:32616');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#upload:not([open])', { state: 'attached' });
  await page.waitForFunction(() => /“hills” is a dataset of the service now, and the ground of this scenario/.test(document.getElementById('notice').textContent));
  assert.deepEqual((await document_(page)).terrain, { kind: 'dataset', name: 'hills' });
  assert.equal((await ask(own.url, '/terrains/hills')).crs, 'EPSG:32616');
  await page.click('summary:text-is("Ground")');
  assert.equal(await page.inputValue('[data-pointer="/terrain/name"]'), 'hills', 'and it is in the choice');
  // By its field, over a scenario in metres, which begins another one.
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  const file = fileURLToPath(new URL('../../scenarios/terrain/jacksboro.tif', import.meta.url));
  await page.setInputFiles('#file', file);
  await page.fill('#upload-name', 'ridge');
  await page.click('#upload-yes');
  await page.click('#notice >> text=Begin one there');
  await page.waitForFunction(() => globalThis.noctule.document().terrain.name === 'ridge' && globalThis.noctule.scene().ground.columns === 201);
  assert.ok(await page.isHidden('.faults'), 'it can be planned as it is drawn');
  // Given up while it is being sent, nothing has happened.
  await held(page, '**/terrains/never');
  await page.setInputFiles('#file', file);
  await page.fill('#upload-name', 'never');
  await page.click('#upload-yes');
  await page.waitForFunction(() => /sent/.test(document.getElementById('upload-said').textContent));
  assert.ok(await page.isVisible('#upload-progress') && await page.isDisabled('#upload-yes'));
  await page.click('#upload-no');
  await page.waitForSelector('#upload:not([open])', { state: 'attached' });
  assert.deepEqual((await ask(own.url, '/terrains')).terrains.map(({ name }) => name), ['hills', 'jacksboro', 'ridge']);
  await page.done();
});

test('the ground of a dataset follows what is moved where no area is given, and the camera stays', async (t) => {
  const directory = fileURLToPath(new URL('../../scenarios', import.meta.url));
  const mapped = await service('--terrain-dir', join(directory, 'terrain'));
  t.after(mapped.stop);
  const page = await open(chrome, mapped.url);
  await drawn(page, FIRST);
  const near = JSON.parse(readFileSync(join(directory, 'jacksboro-wgs84.json'), 'utf8'));
  Object.assign(near, { area: undefined, threats: [], target: { lat: 36.585, lon: -84.31, alt: 800 } });
  await page.setInputFiles('#file', { name: 'near.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(near)) });
  await page.waitForFunction(() => globalThis.noctule.document().terrain.kind === 'dataset' && globalThis.noctule.scene().ground.columns === 201);
  await settled(page);
  const seen = () => page.evaluate((p) => globalThis.noctule.onScreen(globalThis.noctule.toMetres(p)), near.start);
  const [whole, before_] = [await seen(), await page.evaluate(() => globalThis.noctule.groundAt(9000, 3000))];
  await fill(page, '/target/lon', '-84.1845');
  await page.waitForFunction((before) => globalThis.noctule.groundAt(9000, 3000) !== before, before_);
  await settled(page);
  const far = await document_(page);
  const { area, elevations } = await ask(mapped.url, '/scenarios:ground?columns=101&rows=101', { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(far) });
  assert.ok(area.max.lon > far.target.lon);
  const node = { lat: area.min.lat + (area.max.lat - area.min.lat) / 2, lon: area.min.lon + ((area.max.lon - area.min.lon) * 9) / 10 };
  const ground = await page.evaluate((p) => {
    const { x, y } = globalThis.noctule.toMetres(p);
    return globalThis.noctule.groundAt(x, y);
  }, node);
  assert.ok(Math.abs(ground - elevations[50 * 101 + 90]) < 1, `${ground} m, the service has ${elevations[50 * 101 + 90]} m`);
  const now = await seen();
  assert.ok(Math.hypot(now.x - whole.x, now.y - whole.y) < 1, 'the camera has not turned');
  await page.done();
});
