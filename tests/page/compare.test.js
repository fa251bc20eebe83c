// Plans are listed, overlaid, replanned from a known route, and taken away.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { LONG, SMALL, ask, color, FIRST, document_, drawn, fill, held, made, open, pixels, plan, scene, service, settled } from './support.js';
import { chrome, site } from './together.js';

test('two plans are laid over one another in scene and chart', async () => {
  const first = await made(site.url, { ...SMALL, name: 'one', planner: { ...SMALL.planner, seeding: 'random', polish: false } });
  await made(site.url, { ...SMALL, name: 'two', planner: { ...SMALL.planner, seeding: 'random', polish: false, algorithm: 'pso', seed: 5 } });
  const page = await open(chrome, `${site.url}#plan=${first}`);
  await page.waitForSelector('.verdict');
  await page.click('#tab-plans');
  await page.check('[aria-label="Lay two over"]');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 2);
  const other = await color(page, 'other-0');
  assert.equal((await scene(page)).routes.find((route) => route.name !== 'route').color, other);
  const box = await page.locator('#canvas').boundingBox();
  assert.ok(await pixels(page, other, box) > 100, 'its colour is in the scene');
  await page.waitForFunction(() => /two/.test(document.getElementById('legend').textContent));
  // The URL restores both.
  const again = await open(chrome, page.url());
  await again.waitForFunction(() => globalThis.noctule?.scene()?.routes.length === 2);
  await again.done();
  await page.uncheck('[aria-label="Lay two over"]');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 1);
  await page.done();
});

test('in the strip each route goes as far as it is long', async () => {
  const detour = { ...SMALL, name: 'detour', area: { min: { x: -1000, y: -1000 }, max: { x: 2000, y: 2000 } }, threats: [{ ...SMALL.threats[0], radius: 600, influence: 700 }],
    start: { x: -300, y: -300, z: 50 }, target: { x: 1300, y: 1300, z: 50 } };
  const first = await made(site.url, { ...detour, name: 'straight', threats: [] });
  await made(site.url, detour);
  const page = await open(chrome, `${site.url}#plan=${first}`);
  await page.waitForSelector('.verdict');
  const strip = await page.locator('#strip').boundingBox();
  // Beside its edges, with what is left of the figure for the routes.
  const end = { x: strip.x + strip.width - 40, y: strip.y, width: 26, height: strip.height - 20 };
  const [route, other] = [await color(page, 'route'), await color(page, 'other-0')];
  assert.ok(await pixels(page, route, end) > 20);
  assert.doesNotMatch(await page.textContent('#strip-what'), /in front/);
  await page.click('#tab-plans');
  await page.check('[aria-label="Lay detour over"]');
  await page.waitForFunction(() => /laid over, detour, [\d,.]+ m, from/.test(document.getElementById('strip').getAttribute('aria-label')));
  await settled(page);
  assert.equal(await pixels(page, route, end), 0, 'the shorter one has ended before');
  assert.ok(await pixels(page, other, end) > 10);
  assert.match(await page.textContent('#strip-what'), /ground and band of the route in front/);
  // Beyond its end the route in front has no place to be marked.
  await page.mouse.move(end.x + 20, end.y + 50);
  await page.mouse.move(end.x + 21, end.y + 50);
  assert.equal((await scene(page)).mark, 0);
  await page.uncheck('[aria-label="Lay detour over"]');
  await page.waitForFunction(() => !/in front/.test(document.getElementById('strip-what').textContent));
  await page.done();
});

test('what is taken away before it has opened stays away, and what is laid over twice is there once', async () => {
  const named = (name) => made(site.url, { ...SMALL, name });
  const [first, early] = [await named('first'), await named('early')];
  await named('late');
  const page = await open(chrome, `${site.url}#plan=${first}`);
  await page.waitForSelector('.verdict');
  const asked = [];
  page.on('request', (request) => asked.push(new URL(request.url()).pathname));
  await page.click('#tab-plans');
  const tick = page.locator('[aria-label="Lay early over"]');
  const openings = () => asked.filter((path) => path === `/plans/${early}/scenario`).length;
  let release = await held(page, `**/plans/${early}`);
  await tick.check();
  await tick.uncheck();
  await release();
  await page.check('[aria-label="Lay late over"]');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length > 1 && /late/.test(document.getElementById('legend').textContent));
  assert.doesNotMatch(await page.textContent('#legend'), /early/);
  assert.equal((await scene(page)).routes.length, 2);
  assert.equal(openings(), 1);
  release = await held(page, `**/plans/${early}`);
  await tick.check();
  // The list is reloaded meanwhile and still shows the tick.
  await page.waitForResponse(/plans[?]limit/);
  await page.waitForResponse(/plans[?]limit/);
  assert.ok(await tick.isChecked());
  await release();
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 3);
  assert.equal(openings(), 2);
  await page.done();
});

test('a plan is planned again by another algorithm, which has other constants', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, { ...SMALL, name: 'bats' })}`);
  await page.waitForSelector('.verdict');
  const constants = async () => Object.keys((await document_(page)).planner.parameters).sort();
  const ofBats = await constants();
  assert.ok(ofBats.includes('pulse_rate'), 'the accepted document has them all');
  await page.click('[data-part="planner"] > summary');
  await page.selectOption('[data-pointer="/planner/algorithm"]', 'pso');
  assert.deepEqual(await constants(), ['gap', 'quadrature', 'threads']);
  const id = await plan(page);
  assert.equal((await ask(site.url, `/plans/${id}`)).algorithm, 'pso');
  await page.click('#undo');
  assert.deepEqual(await constants(), ofBats, 'it is one step');
  await page.done();
});

test('a plan that is left before it has opened is not followed', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const followed = [];
  page.on('request', (request) => { if (request.url().includes('/events?')) followed.push(request.url().match(/plans\/([^/]+)/)[1]); });
  const release = await held(page, /plans\/[^/]+\/scenario/);
  await page.click('#plan');
  await page.waitForFunction(() => location.hash.includes('plan='));
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await release();
  const id = await plan(page);
  assert.deepEqual([...new Set(followed)], [id]);
  await page.done();
});

test('five running plans over a sixth leave the page a connection', async (t) => {
  const other = await service('--workers', '6');
  t.after(other.stop);
  const ids = [];
  for (let n = 0; n < 6; n += 1) {
    const { id } = await ask(other.url, '/plans', { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify({ ...SMALL, name: `plan ${n}`, planner: { ...SMALL.planner, ...LONG } }) });
    ids.push(id);
  }
  const page = await open(chrome, `${other.url}#plan=${ids[0]}&with=${ids.slice(1).join('+')}`);
  // Each of them has had its turn.
  await page.waitForFunction(() => globalThis.noctule?.scene()?.routes.length === 6);
  await page.click('#cancel');
  await page.waitForSelector('.verdict');
  assert.equal((await scene(page)).routes.length, 6);
  // One of them comes to the front, with all events so far.
  await page.click('#tab-plans');
  await page.click(`[data-key="open ${ids[3]}"]`);
  await page.waitForFunction(() => document.getElementById('state').textContent === 'running');
  const before_ = await page.evaluate(() => globalThis.noctule.history().points);
  assert.ok(before_ > 0);
  await page.waitForFunction((count) => globalThis.noctule.history().points > count + 20, before_);
  await page.click('#cancel');
  await page.waitForSelector('.verdict');
  await page.done();
});

test('a threat moves, and the plan is made anew from the route there was', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`);
  await page.waitForSelector('.verdict');
  await fill(page, '/threats/0/center/x', '450');
  const id = await plan(page, '#replan');
  const scenario = await ask(site.url, `/plans/${id}/scenario`);
  assert.equal(scenario.threats[0].center.x, 450);
  assert.ok(scenario.planner.warm_start.waypoints.length > 2, 'it began with the route before');
  // Before and after, once they are drawn: the verdict may come first.
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 2);
  await page.waitForFunction(() => /before: small/.test(document.getElementById('legend').textContent));
  // No more are laid over than an address can name: the oldest goes.
  for (let n = 0; n < 5; n += 1) await plan(page, '#replan');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 6);
  assert.equal(await page.evaluate(() => location.hash.match(/[0-9a-f-]{36}/g).length), 6);
  await page.done();
});

test('the list has states, a filter and pages, and lets go', async (t) => {
  const other = await service();
  t.after(other.stop);
  for (let n = 0; n < 23; n += 1) await made(other.url, { ...SMALL, name: `plan ${n}`, planner: { ...SMALL.planner, iterations: 1, population: 10 } });
  const page = await open(chrome, other.url);
  await drawn(page, FIRST);
  await page.click('#tab-plans');
  await page.waitForSelector('.plans tbody tr');
  assert.equal(await page.locator('.plans tbody tr').count(), 20);
  assert.match(await page.textContent('.plans tbody tr'), /plan 22.*succeeded/s);
  // Read again, the list keeps its rows, and what is selected in them.
  await page.evaluate(() => getSelection().selectAllChildren(document.querySelector('.plans tbody tr th')));
  await page.waitForResponse((response) => /\/plans\?/.test(response.url()));
  await page.waitForResponse((response) => /\/plans\?/.test(response.url()));
  assert.match(await page.evaluate(() => getSelection().toString()), /plan 22/);
  await page.click('#plans-older');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 3);
  await page.click('#plans-newer');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 20);
  await page.selectOption('#plans-filter', 'running');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 0);
  // A plan that starts appears without reloading.
  await ask(other.url, '/plans', { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify({ ...SMALL, name: 'long', planner: LONG }) });
  await page.waitForFunction(() => /long.*running/s.test(document.querySelector('.plans tbody')?.textContent ?? ''));
  await page.click('.plans [aria-label="Remove long"]');
  await page.click('#sure-yes');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 0);
  await page.selectOption('#plans-filter', '');
  await page.click('text="plan 7"').catch(() => page.click('text="plan 21"'));
  await page.waitForSelector('.verdict.good');
  await page.done();
});

/** A page whose plan runs for a long time, with its first route drawn. */
async function running() {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  for (const [name, value] of Object.entries(LONG)) await fill(page, `/planner/${name}`, value);
  await page.click('#plan');
  await page.waitForSelector('#cancel:not([hidden])');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 1);
  return page;
}

test('a running plan that is removed is not shown any longer', async () => {
  const page = await running();
  await fill(page, '/planner/iterations', '50');
  await page.waitForSelector('#stale:not([hidden])');
  await page.click('#tab-plans');
  await page.click('.plans tr.chosen button[title=Remove]');
  await page.click('#sure-yes');
  await page.waitForSelector('#cancel', { state: 'hidden' });
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 0);
  assert.ok(await page.isHidden('#state'));
  assert.ok(await page.isHidden('#stale'));
  assert.match(await page.textContent('#figures'), /Press Plan/);
  assert.equal(await page.evaluate(() => location.hash), '');
  await page.done();
});

test('a plan is removed only after a yes, and Enter says no', async () => {
  const page = await running();
  await page.click('#tab-plans');
  const id = await page.evaluate(() => new URLSearchParams(location.hash.slice(1)).get('plan'));
  const there = async () => (await fetch(`${site.url}/plans/${id}`)).status;
  for (const no of ['Enter', 'Escape']) {
    await page.focus(`[data-key="remove ${id}"]`);
    await page.keyboard.press('Enter');
    await page.waitForSelector('#sure[open]');
    assert.match(await page.textContent('#sure-why'), /has not ended/);
    await page.keyboard.press(no);
    await page.waitForSelector('#sure', { state: 'hidden' });
    assert.equal(await there(), 200);
  }
  await page.keyboard.press('Enter');
  await page.keyboard.press('Tab');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#cancel', { state: 'hidden' });
  assert.equal(await there(), 410);
  await page.done();
});

test('a running plan that is removed elsewhere is told to have ended', async () => {
  const page = await running();
  const id = await page.evaluate(() => new URLSearchParams(location.hash.slice(1)).get('plan'));
  await fetch(`${site.url}/plans/${id}`, { method: 'DELETE' });
  await page.waitForSelector('.verdict.bad');
  assert.match(await page.textContent('.verdict'), /was deleted/);
  assert.equal(await page.textContent('#state'), 'cancelled');
  assert.ok(await page.isHidden('#cancel'));
  await page.done();
});

test('a plan is taken away: formats, scenario, picture, link', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`);
  await page.waitForSelector('.verdict');
  const id = new URL(page.url()).hash.slice(6);
  const save = async (selector) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click(selector)]);
    return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
  };
  const served = async (path) => Buffer.from(await (await fetch(new URL(path, site.url))).arrayBuffer());
  for (const format of ['json', 'svg', 'csv']) {
    const saved = await save(`[data-format=${format}]`);
    assert.match(saved.name, new RegExp(`^small.*\\.${format}$`));
    assert.deepEqual(saved.bytes, await served(`/plans/${id}/result?format=${format}`), format);
  }
  const scenario = await save('#save-scenario');
  assert.deepEqual(scenario.bytes, await served(`/plans/${id}/scenario`));
  const picture = await save('#save-picture');
  // Each says of which plan it is, and what of it.
  assert.equal(scenario.name, `small-${id.slice(-8)}-scenario.json`);
  assert.equal((await save('[data-format=json]')).name, `small-${id.slice(-8)}-result.json`);
  assert.equal(picture.name, `small-${id.slice(-8)}-view.png`);
  assert.equal(picture.bytes.subarray(1, 4).toString(), 'PNG');
  assert.ok(picture.bytes.length > 5000, 'and it is not empty');
  await page.click('#copy-link');
  await page.waitForFunction(() => /clipboard/.test(document.getElementById('notice').textContent));
  const link = await page.evaluate(() => navigator.clipboard.readText());
  const again = await open(chrome, link);
  await again.waitForSelector('.verdict.good');
  assert.equal((await document_(again)).name, 'small');
  await again.done();
  // Without a clipboard, as over plain HTTP, the link is shown.
  await page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined }));
  await page.click('#copy-link');
  await page.waitForFunction(() => document.getElementById('notice').textContent.includes(location.href));
  await page.done();
});

test('the picture of the scene has its names', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`);
  await page.waitForSelector('.verdict');
  await settled(page);
  const canvas = await page.locator('#canvas').boundingBox();
  const name = await page.locator('#labels .threat').boundingBox();
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#save-picture')]);
  const picture = `data:image/png;base64,${readFileSync(await download.path()).toString('base64')}`;
  const box = { left: name.x - canvas.x, top: name.y - canvas.y, width: name.width, height: name.height, of: canvas.width };
  const eye = await page.context().newPage();
  const inked = await eye.evaluate(async ([data, { left, top, width, height, of }, wanted]) => {
    const image = new Image();
    image.src = data;
    await image.decode();
    const pen = new OffscreenCanvas(image.width, image.height).getContext('2d');
    pen.drawImage(image, 0, 0);
    const k = image.width / of;
    const seen = pen.getImageData(left * k, top * k, width * k, height * k).data;
    const want = [1, 3, 5].map((at) => parseInt(wanted.slice(at, at + 2), 16));
    let count = 0;
    for (let at = 0; at < seen.length; at += 4) if (want.every((value, part) => Math.abs(seen[at + part] - value) <= 24)) count += 1;
    return count;
  }, [picture, box, await color(page, 'ink')]);
  await eye.close();
  assert.ok(inked > 20, `${inked} pixels of letters where the page has the name`);
  await page.done();
});

test('a map becomes a flight plan, in every format that flies', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.setInputFiles('#file', fileURLToPath(new URL('./map.kml', import.meta.url)));
  await page.waitForFunction(() => globalThis.noctule.document().frame === 'wgs84');
  await page.waitForFunction(() => /Taken for granted/.test(document.getElementById('notice').textContent));
  await drawn(page, 1);
  await fill(page, '/planner/iterations', '20');
  const id = await plan(page);
  const result = await ask(site.url, `/plans/${id}/result`);
  // Positions drawn in metres match the degrees.
  const [start, end] = await page.evaluate((p) => [globalThis.noctule.routeAt(0), globalThis.noctule.toMetres(p)], result.waypoints[0]);
  assert.ok(Math.hypot(start.x - end.x, start.y - end.y) < 0.01);
  const across = await page.evaluate((p) => p.map(globalThis.noctule.toMetres), [result.waypoints[0], result.waypoints.at(-1)]);
  const flown = result.legs.reduce((sum, leg) => sum + leg.length * Math.cos((leg.climb_deg * Math.PI) / 180), 0);
  assert.ok(Math.hypot(across[0].x - across[1].x, across[0].y - across[1].y) <= flown * 1.0002);
  for (const format of ['qgc', 'wpl', 'kml', 'geojson', 'gpx', 'czml', 'csv', 'json', 'svg']) {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click(`[data-format=${format}]`)]);
    const bytes = readFileSync(await download.path());
    assert.ok(bytes.length > 200, format);
    if (format === 'qgc') assert.equal(JSON.parse(bytes).fileType, 'Plan');
  }
  await page.done();
});

test('from opening the page to a flight plan over Jacksboro takes five actions or fewer', async () => {
  let actions = 1;
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const { scenarios } = await ask(site.url, '/scenarios');
  const flown = scenarios.find(({ name, frame }) => frame === 'wgs84' && name.startsWith('jacksboro'));
  if (scenarios[0] !== flown) {
    actions += 1;
    await page.selectOption('#source', flown.name);
    await drawn(page, flown.threats);
  }
  actions += 1;
  await plan(page);
  assert.equal(await page.locator('.verdict.good').count(), 1);
  actions += 1;
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('[data-format=qgc]')]);
  const flight = JSON.parse(readFileSync(await download.path()));
  assert.equal(flight.fileType, 'Plan');
  assert.ok(flight.mission.items.length > 3);
  assert.ok(actions <= 5, `${actions}`);
  await page.done();
});
