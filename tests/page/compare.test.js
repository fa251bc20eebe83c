// Plans are listed, laid over one another, made anew from a known route, and taken away.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { SMALL, ask, browser, color, document_, drawn, fill, made, open, pixels, plan, scene, service } from './support.js';

let site;
let chrome;
before(async () => { [site, chrome] = await Promise.all([service(), browser()]); });
after(async () => {
  await chrome?.close();
  await site?.stop();
});

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
  // The address brings both back.
  const again = await open(chrome, page.url());
  await again.waitForFunction(() => globalThis.noctule?.scene()?.routes.length === 2);
  await again.done();
  await page.uncheck('[aria-label="Lay two over"]');
  await page.waitForFunction(() => globalThis.noctule.scene().routes.length === 1);
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
  const { routes } = await scene(page);
  assert.equal(routes.length, 2, 'before and after');
  await page.waitForFunction(() => /before: small/.test(document.getElementById('legend').textContent));
  await page.done();
});

test('the list has states, a filter and pages, and lets go', async () => {
  const other = await service();
  for (let n = 0; n < 23; n += 1) await made(other.url, { ...SMALL, name: `plan ${n}`, planner: { ...SMALL.planner, iterations: 1, population: 10 } });
  const page = await open(chrome, other.url);
  await drawn(page, 6);
  await page.click('#tab-plans');
  await page.waitForSelector('.plans tbody tr');
  assert.equal(await page.locator('.plans tbody tr').count(), 20);
  assert.match(await page.textContent('.plans tbody tr'), /plan 22.*succeeded/s);
  await page.click('#plans-older');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 3);
  await page.click('#plans-newer');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 20);
  await page.selectOption('#plans-filter', 'running');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 0);
  // One that begins is there without being asked for.
  await ask(other.url, '/plans', { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify({ ...SMALL, name: 'long', planner: { iterations: 100000, population: 200, waypoints: 10 } }) });
  await page.waitForFunction(() => /long.*running/s.test(document.querySelector('.plans tbody')?.textContent ?? ''));
  await page.click('.plans [aria-label="Remove long"]');
  await page.waitForFunction(() => document.querySelectorAll('.plans tbody tr').length === 0);
  await page.selectOption('#plans-filter', '');
  await page.click('text="plan 7"').catch(() => page.click('text="plan 21"'));
  await page.waitForSelector('.verdict.good');
  await page.done();
  await other.stop();
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
  for (const [format, name] of [['json', 'small.json'], ['svg', 'small.svg'], ['csv', 'small.csv']]) {
    const saved = await save(`[data-format=${format}]`);
    assert.equal(saved.name, name);
    assert.deepEqual(saved.bytes, await served(`/plans/${id}/result?format=${format}`), format);
  }
  assert.deepEqual((await save('#save-scenario')).bytes, await served(`/plans/${id}/scenario`));
  const picture = await save('#save-picture');
  assert.equal(picture.bytes.subarray(1, 4).toString(), 'PNG');
  assert.ok(picture.bytes.length > 5000, 'and it is not empty');
  await page.click('#copy-link');
  await page.waitForSelector('#notice:not([hidden])');
  const link = await page.evaluate(() => navigator.clipboard.readText());
  const again = await open(chrome, link);
  await again.waitForSelector('.verdict.good');
  assert.equal((await document_(again)).name, 'small');
  await again.done();
  await page.done();
});
