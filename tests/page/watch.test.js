// A search is watched and its end read; pointing at a place in one view marks it in the others.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { LONG, SMALL, WALLED, around, ask, choose, FIRST, color, drawn, made, open, pixels, plan, scene, settled, wire } from './support.js';
import { chrome, site } from './together.js';

/** Settings that make a shipped scenario last. */
const LASTING = { '/planner/iterations': LONG.iterations, '/planner/population': LONG.population, '/planner/waypoints': 8 };

test('the swarm is seen converging, and cancelling keeps the best', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-4', LASTING);
  await page.click('#plan');
  await page.waitForFunction(() => globalThis.noctule.scene().trail >= 2);
  const live = await scene(page);
  assert.equal(live.routes.find((route) => route.name === 'route').points, 10);
  assert.match(await page.textContent('#state'), /running/);
  assert.match(await page.textContent('#figures'), /Iteration \d+ of 100000/);
  assert.match(await page.textContent('#legend'), /best.*mean/s);
  await page.click('#cancel');
  await page.waitForSelector('.verdict.good');
  assert.match(await page.textContent('.verdict'), /Cancelled; the best so far was kept/);
  assert.match(await page.textContent('#said'), /A route was found: cost/);
  await page.done();
});

test('the route is drawn where it is, and a place in it is one place everywhere', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-1');
  const id = await plan(page);
  const result = await ask(site.url, `/plans/${id}/result`);
  const there = await scene(page);
  assert.equal(there.routes[0].points, result.path.points.length);
  assert.equal(there.waypoints, result.waypoints.length - 2);
  assert.equal(there.trail, 0);
  const route = await color(page, 'route');
  // From above, so that no threat hides it.
  await page.click('text=Above');
  await settled(page);
  for (const share of [0.21, 0.47, 0.83]) {
    const place = await page.evaluate((t) => globalThis.noctule.routeAt(t), share);
    assert.ok(await pixels(page, route, await around(page, place)) >= 8, `the route's colour at ${share} of it`);
  }
  const nowhere = await page.evaluate(() => ({ x: -350, y: 350, z: 0 }));
  assert.equal(await pixels(page, route, await around(page, nowhere)), 0);
  // Pointing at the strip marks scene and table.
  const strip = await page.locator('#strip').boundingBox();
  await page.mouse.move(strip.x + strip.width * 0.5, strip.y + strip.height * 0.5);
  await page.waitForFunction(() => globalThis.noctule.scene().mark === 1);
  assert.equal(await page.locator('.legs tr.marked').count(), 1);
  assert.match(await page.textContent('#strip-at'), /m above ground/);
  // Pointing at a leg in the table marks strip and scene.
  await page.locator('.legs tr[data-leg="2"]').hover();
  await page.waitForSelector('.legs tr[data-leg="2"].marked');
  assert.equal((await scene(page)).mark, 1);
  // Pointing at the route in the scene marks the table.
  const spot = await around(page, await page.evaluate(() => globalThis.noctule.routeAt(0.1)));
  await page.mouse.move(spot.x + 7, spot.y + 7);
  await page.waitForSelector('.legs tr[data-leg="0"].marked');
  // Pointing at the chart shows the best route of that time.
  const chart = page.locator('#chart .u-over');
  await chart.hover({ position: { x: (await chart.boundingBox()).width - 1, y: 40 } });
  await page.waitForFunction(() => globalThis.noctule.scene().routes.some((one) => one.name === 'then'));
  await page.done();
});

test('heights above the ground of a dataset are those of the ground, not of its drawing', async () => {
  const scenario = { ...JSON.parse(readFileSync(new URL('../../scenarios/jacksboro-wgs84.json', import.meta.url), 'utf8')), name: 'fault' };
  scenario.planner = { ...scenario.planner, iterations: 20, population: 50 };
  const id = await made(site.url, scenario);
  const table = await (await fetch(`${site.url}/plans/${id}/result?format=csv`)).text();
  const [head, ...rows] = table.trim().split('\n').map((line) => line.split(','));
  const [lat, lon, agl] = ['lat', 'lon', 'agl'].map((name) => head.indexOf(name));
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForFunction(() => globalThis.noctule?.scene()?.ground.columns === 201 && globalThis.noctule.routeAt(0.5));
  const strip = await page.locator('#strip').boundingBox();
  const sure = async (x) => {
    // Until what was measured has come.
    for (;;) {
      await page.mouse.move(x, strip.y + 60);
      await page.mouse.move(x + 1, strip.y + 60);
      const said = await page.textContent('#strip-at');
      const [, far, above] = said.replaceAll(',', '').match(/^([\d.]+) m: .* m ([\d.]+) m above ground$/) ?? [];
      if (far) return { share: Number(far), above: Number(above) };
    }
  };
  const places = rows.map((row) => ({ lat: Number(row[lat]), lon: Number(row[lon]), above: Number(row[agl]) }));
  const spots = await page.evaluate((all) => all.map(globalThis.noctule.toMetres), places);
  const flown = spots.map(() => 0);
  spots.forEach((spot, k) => { if (k) flown[k] = flown[k - 1] + Math.hypot(spot.x - spots[k - 1].x, spot.y - spots[k - 1].y); });
  // Up to ten kilometres, which are said to a metre.
  for (let part = 0.1; part < 0.65; part += 0.02) {
    const { share, above } = await sure(Math.round(strip.x + strip.width * part));
    const near = places.filter((_, k) => Math.abs(flown[k] - share) < 12).map((place) => place.above);
    assert.ok(above >= Math.min(...near) - 1 && above <= Math.max(...near) + 1, `${above} m at ${share} m, measured ${near}`);
  }
  await page.done();
});

test('the strip has the threats that the route passes, from base to top', async () => {
  const cylinder = (name, x, y, more) => ({ kind: 'cylinder', name, center: { x, y }, radius: 120, influence: 120, ...more });
  const threats = [
    cylinder('below', 300, 300, { top: 10 }), cylinder('aside', 900, 100, {}),
    { kind: 'polygon', name: 'shelf', base: 110, vertices: [{ x: 600, y: 600 }, { x: 800, y: 600 }, { x: 800, y: 800 }, { x: 600, y: 800 }] },
  ];
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, { ...SMALL, threats })}`);
  await page.waitForSelector('.verdict.good');
  await page.waitForFunction(() => /; beside, over or under below, shelf$/.test(document.getElementById('strip').getAttribute('aria-label')));
  await settled(page);
  const strip = await page.locator('#strip').boundingBox();
  // The axes leave 46 pixels on the left and 12 on the right. Of white and 24 % of the colour of cores.
  const core = (await color(page, 'core')).slice(1).match(/../g).map((part) => parseInt(part, 16));
  const tint = `#${core.map((part) => Math.round(255 + (part - 255) * 0.24).toString(16).padStart(2, '0')).join('')}`;
  const column = (share) => ({ x: strip.x + 46 + (strip.width - 58) * share - 4, y: strip.y + 12, width: 8, height: strip.height - 32 });
  const seen = [];
  for (const share of [0.25, 0.5, 0.75]) seen.push(await pixels(page, tint, column(share)));
  assert.ok(seen[0] > 20 && seen[1] === 0 && seen[2] > 20, `${seen}`);
  await page.done();
});

test('a long route is drawn of few points, and known in all', async () => {
  const far = { min: { x: 0, y: 0 }, max: { x: 31000, y: 31000 } };
  const id = await made(site.url, { ...SMALL, area: far, target: { x: 30000, y: 30000, z: 50 }, threats: [{ kind: 'cylinder', center: { x: 15000, y: 15000 }, radius: 5000 }] });
  const { path } = await ask(site.url, `/plans/${id}/result`);
  assert.ok(path.points.length > 5000);
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForFunction(() => globalThis.noctule.scene()?.routes[0]?.points > 0);
  assert.ok((await scene(page)).routes[0].points < 900);
  const [end, target] = await page.evaluate(() => [globalThis.noctule.routeAt(1).x, globalThis.noctule.toMetres(globalThis.noctule.document().target).x]);
  assert.ok(Math.abs(end - target) < 1);
  await page.done();
});

test('a lost connection says so, and is taken up again without a loss', async (t) => {
  const line = await wire(site.url);
  t.after(line.stop);
  const page = await open(chrome, line.url);
  page.allowed = /ERR_|Failed to load resource/;
  await drawn(page, FIRST);
  await choose(page, 'paper-4', LASTING);
  await page.click('#plan');
  await page.waitForFunction(() => globalThis.noctule.scene().trail >= 1);
  line.cut();
  await page.waitForSelector('#notice:not([hidden])');
  assert.match(await page.textContent('#notice'), /The connection is lost. It is being resumed/);
  assert.equal(await page.textContent('#state'), 'reconnecting');
  line.mend();
  await page.waitForSelector('#notice', { state: 'hidden' });
  assert.equal(await page.textContent('#state'), 'running');
  await page.click('#cancel');
  await page.waitForSelector('.verdict.good');
  await page.done();
});

test('a plan that is gone is not asked for again and again', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-4', LASTING);
  let streams = 0;
  await page.route('**/events?*', async (route) => {
    streams += 1;
    const address = new URL(route.request().url());
    await fetch(new URL(address.pathname.replace('/events', ''), site.url), { method: 'DELETE' });
    await route.continue();
  });
  await page.click('#plan');
  await page.waitForFunction(() => /was deleted/.test(document.getElementById('notice').textContent));
  assert.equal(await page.textContent('#state'), 'lost');
  assert.ok(await page.isHidden('#cancel'));
  assert.equal(streams, 1);
  await page.done();
});

test('the result is read: cost, gap, clearances, legs, as the interface has them', async () => {
  const id = await made(site.url, SMALL);
  const result = await ask(site.url, `/plans/${id}/result`);
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict.good');
  const figure = (value, digits) => value.toLocaleString('en', { minimumFractionDigits: digits, maximumFractionDigits: digits });
  assert.ok((await page.textContent('#result')).includes(figure(result.cost.total, result.cost.total < 1000 ? 2 : 1)));
  // What is proven is never rounded down.
  assert.ok((await page.textContent('.facts')).includes(`${figure(Math.ceil(result.bound.gap * 1e4) / 100, 2)} %`));
  assert.ok((await page.textContent('.facts')).includes(figure(result.path.length, 1)));
  assert.equal(await page.locator('.legs tbody tr').count(), result.legs.length);
  assert.match(await page.textContent('#result'), /radar/);
  assert.match(await page.getAttribute('#canvas', 'aria-label'), /a route that holds/);
  await page.done();
});

test('the result of a scenario without threats says nothing of them', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, { ...SMALL, threats: [] })}`);
  await page.waitForSelector('.verdict.good');
  assert.equal(await page.locator('#clearance-head').count(), 0);
  assert.doesNotMatch(await page.textContent('#result'), /null/);
  await page.done();
});

test('a route that breaks something cannot be mistaken, and its faults have places', async () => {
  const id = await made(site.url, WALLED);
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict.bad');
  assert.match(await page.textContent('.verdict h2'), /No feasible route found/);
  assert.match(await page.textContent('.violations'), /leg \d+ enters threat 0 \(wall\) by/);
  assert.equal(await page.textContent('#state'), 'infeasible');
  assert.match(await page.getAttribute('#canvas', 'aria-label'), /NOT feasible/);
  const fault = await color(page, 'fault');
  const marked = await scene(page);
  assert.ok(marked.faults >= 1);
  assert.equal(marked.routes[0].color, fault);
  const box = await page.locator('#canvas').boundingBox();
  assert.ok(await pixels(page, fault, box) > 100, 'the route and its faults are drawn in the colour of faults');
  await page.locator('.violations button').first().click();
  await page.waitForFunction(() => globalThis.noctule.scene().faults === 1 && globalThis.noctule.scene().mark === 1);
  await page.done();
});

test('a search of milliseconds has its whole history, also when its plan is opened later', async () => {
  const short = await ask(site.url, '/scenarios/paper-4');
  Object.assign(short.planner, { iterations: 60, population: 30, seed: 3 });
  const id = await made(site.url, short);
  const { convergence, timing } = await ask(site.url, `/plans/${id}/result`);
  const told = await (await fetch(`${site.url}/plans/${id}/events?rate=0`)).text();
  const incumbents = told.match(/^event: incumbent$/gm).length;
  assert.ok(timing.run_ms < 5000 && incumbents > 3, `${incumbents} incumbents in ${timing.run_ms} ms`);
  const known = (page, count) => page.waitForFunction((wanted) => globalThis.noctule.history().incumbents >= wanted, count);
  const later = await open(chrome, `${site.url}#plan=${id}`);
  await later.waitForSelector('.verdict.good');
  // On a busy machine it may take a second, so events are thinned.
  await known(later, 4);
  assert.equal(await later.evaluate(() => globalThis.noctule.history().points), convergence.length);
  await later.done();
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.setInputFiles('#file', { name: 'short.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(short)) });
  await drawn(page, 5);
  await plan(page);
  await known(page, 4);
  // By keyboard: the first route, step by step, then the result again.
  await page.locator('#iteration').focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.some((one) => one.name === 'then'));
  assert.match(await page.textContent('#watch output'), /^iteration 1: /);
  await page.locator('#chart .u-cursor-pt').first().waitFor();
  await page.keyboard.press('Tab');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 1);
  // Everything is replayed, with the result at the end.
  await page.click('#again');
  await page.waitForFunction(() => globalThis.noctule.scene().trail >= 2);
  assert.equal(await page.textContent('#again'), 'Stop');
  await page.waitForFunction(() => document.getElementById('again').textContent === 'Watch again');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 1 && globalThis.noctule.scene().trail === 0);
  await page.done();
});

test('a search that starts over is shown from its new beginning', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-4', LASTING);
  const event = (kind, data) => `event: ${kind}\ndata: ${JSON.stringify(data)}\n\n`;
  const told = (iteration) => event('convergence', { iteration, best_cost: 500, mean_cost: 600, feasible_fraction: 1 })
    + event('incumbent', { iteration, cost: 500, feasible: true, waypoints: [{ x: 200, y: 200, z: 0 }, { x: 800, y: 800, z: 150 }] });
  await page.route('**/events?*', async (route) => {
    const status = await ask(site.url, new URL(route.request().url()).pathname.replace('/events', ''));
    const as = (state) => event('status', { ...status, status: state });
    await route.fulfill({ contentType: 'text/event-stream', body: `retry: 60000\n\n${as('running')}${told(0)}${told(1)}${told(2)}${as('queued')}${as('running')}${told(0)}` });
  });
  await page.click('#plan');
  await page.waitForFunction(() => globalThis.noctule.history().points > 0);
  await settled(page);
  assert.deepEqual(await page.evaluate(() => globalThis.noctule.history()), { points: 1, incumbents: 1 });
  await page.click('#cancel');
  await page.done();
});

test('a search of very many iterations is drawn', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-4', LASTING);
  await page.route('**/events?*', async (route) => {
    const status = await ask(site.url, new URL(route.request().url()).pathname.replace('/events', ''));
    const event = (kind, data) => `event: ${kind}\ndata: ${JSON.stringify(data)}\n\n`;
    const told = Array.from({ length: 80000 }, (_, iteration) => event('convergence', { iteration, best_cost: 500, mean_cost: 600, feasible_fraction: 1 }));
    await route.fulfill({ contentType: 'text/event-stream', body: `retry: 60000\n\n${event('status', { ...status, status: 'running' })}${told.join('')}` });
  });
  await page.click('#plan');
  await page.waitForFunction(() => globalThis.noctule.history().points === 80000);
  await page.waitForFunction(() => /best 500/.test(document.getElementById('legend').textContent));
  await settled(page);
  await page.click('#cancel');
  await page.done();
});
