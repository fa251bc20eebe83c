// The page is accessible: with a key, with a screen reader, by keyboard, on narrow screens.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { SMALL, WALLED, FIRST, drawn, made, open, plan, scene, service } from './support.js';
import { chrome, site } from './together.js';

const AXE = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** The serious findings of axe-core. */
async function serious(page) {
  // Evaluated through the debugger, which the page's policy does not restrict.
  await page.evaluate(AXE);
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }));
  return violations.filter(({ impact }) => ['serious', 'critical'].includes(impact))
    .map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map(({ html, failureSummary }) => `${html} ${failureSummary}`).join(' | ')}`);
}

/** A service with a key of each of these scopes, until the test ends: `{url, keys}`. */
async function guarded(t, scopes, ...settings) {
  const directory = mkdtempSync(join(tmpdir(), 'noctule-keys-'));
  t.after(() => rmSync(directory, { recursive: true, force: true }));
  const news = scopes.map((scope) => spawnSync(process.env.NOCTULE_BIN, ['key', 'new', '--name', scope, '--scopes', scope], { encoding: 'utf8', cwd: directory }));
  const file = join(directory, 'keys.toml');
  writeFileSync(file, news.map(({ stdout }) => stdout).join('\n'));
  const { url, stop } = await service('--keys-file', file, ...settings);
  t.after(stop);
  return { url, keys: news.map(({ stderr }) => stderr.trim().split('\n').at(-1)) };
}

for (const colorScheme of ['light', 'dark']) {
  test(`axe finds nothing serious, ${colorScheme}`, async () => {
    const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`, { colorScheme });
    await page.waitForSelector('.verdict.good');
    await page.evaluate(() => { for (const part of document.querySelectorAll('details')) part.open = true; });
    assert.deepEqual(await serious(page), []);
    await page.click('#tab-plans');
    await page.waitForSelector('.plans tbody tr');
    assert.deepEqual(await serious(page), []);
    await page.click('.plans [title=Remove]');
    await page.waitForSelector('#sure[open]');
    assert.deepEqual(await serious(page), []);
    await page.click('#sure-no');
    await page.done();
    const broken = await open(chrome, `${site.url}#plan=${await made(site.url, WALLED)}`, { colorScheme });
    await broken.waitForSelector('.verdict.bad');
    assert.deepEqual(await serious(broken), []);
    await broken.done();
  });
}

test('it works at 390 pixels, and axe finds nothing serious there', async () => {
  const page = await open(chrome, site.url, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  await drawn(page, FIRST);
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= 390), 'nothing is wider than the screen');
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await plan(page);
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= 390));
  assert.deepEqual(await serious(page), []);
  await page.done();
});

test('the keyboard alone leads from a scenario to a read result', async () => {
  const page = await open(chrome, site.url, { reducedMotion: 'reduce' });
  await drawn(page, FIRST);
  const reach = async (test_) => {
    for (let presses = 0; presses < 400; presses += 1) {
      await page.keyboard.press('Tab');
      if (await page.evaluate(test_)) return;
    }
    assert.fail(`not reached: ${test_}`);
  };
  await reach(() => document.activeElement.id === 'source');
  await page.keyboard.press('p');
  await drawn(page, 3);
  await reach(() => document.activeElement.id === 'add-cylinder');
  await page.keyboard.press('Enter');
  await drawn(page, 4);
  await page.keyboard.press('Control+z');
  await drawn(page, 3);
  await reach(() => document.activeElement.id === 'plan');
  await page.keyboard.press('Enter');
  await page.waitForSelector('.verdict.good');
  await reach(() => document.activeElement.dataset.leg === '1');
  assert.equal((await scene(page)).mark, 1, 'a leg in focus is marked in the scene');
  await page.done();
});

test('Enter uses the key, and after a no what needs one asks again', async (t) => {
  const { url, keys: [key] } = await guarded(t, ['plan']);
  const page = await open(chrome, url);
  await page.waitForSelector('#key[open]');
  await page.keyboard.press('Escape');
  await drawn(page, FIRST);
  await page.click('#plan');
  await page.waitForSelector('#key[open]');
  await page.click('#key-no');
  await page.waitForFunction(() => /This needs a key/.test(document.getElementById('notice').textContent));
  await page.click('#tab-plans');
  await page.waitForSelector('#key[open]');
  await page.click('#key-no');
  await page.click('text="Give a key…"');
  await page.waitForSelector('#key[open]');
  await page.keyboard.type(key);
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => /None here/.test(document.getElementById('plans').textContent));
  await page.selectOption('#plans-filter', 'running');
  await page.click('#tab-scenario');
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await plan(page);
  await page.done();
});

test('a service with keys is asked with one, kept in memory, and followed with tickets', async (t) => {
  const { url, keys: [key] } = await guarded(t, ['plan']);
  const asked = [];
  const page = await open(chrome, 'about:blank');
  page.on('request', (request) => asked.push(request.url()));
  await page.goto(url);
  await page.waitForSelector('#key[open]');
  await page.fill('#key-field', 'noctule_wrong');
  await page.click('#key button.main');
  await page.waitForFunction(() => /no key of this service/.test(document.getElementById('key-why').textContent));
  assert.deepEqual(await serious(page), []);
  await page.fill('#key-field', key);
  await page.click('#key button.main');
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await plan(page);
  await page.click('#tab-plans');
  await page.waitForSelector('.plans tbody tr');
  assert.ok(asked.some((address) => address.includes('/events?') && address.includes('ticket=')), 'a ticket opened the stream');
  assert.ok(!asked.some((address) => address.includes(key)), 'the key was in no address');
  assert.deepEqual(await page.evaluate(() => [localStorage.length, sessionStorage.length, document.cookie]), [0, 0, '']);
  // The key is forgotten with the page, so it is requested again.
  await page.reload();
  await page.waitForSelector('#key[open]');
  await page.done();
});

test('elevations are uploaded only with a key that may', async (t) => {
  const { url, keys: [reader, planner] } = await guarded(t, ['read', 'plan']);
  const file = fileURLToPath(new URL('../../scenarios/terrain/jacksboro.tif', import.meta.url));
  for (const key of [reader, planner]) {
    const page = await open(chrome, 'about:blank');
    page.allowed = /status of 403/;
    await page.goto(url);
    await page.fill('#key-field', key);
    await page.keyboard.press('Enter');
    await drawn(page, FIRST);
    await page.setInputFiles('#file', file);
    if (key === reader) {
      await page.waitForFunction(() => /jacksboro\.tif is not uploaded: this key may look at plans and datasets, but may upload none/.test(document.getElementById('notice').textContent));
    } else {
      await page.waitForSelector('#upload[open]');
      assert.deepEqual(await serious(page), []);
      // Another's dataset is refused where it is named.
      await page.click('#upload-yes');
      await page.click('text=Replace it');
      await page.waitForFunction(() => /somebody else’s, and this key may not replace it/.test(document.getElementById('upload-fault').textContent));
    }
    assert.equal(await page.evaluate(() => document.getElementById('upload').open), key === planner);
    await page.done();
  }
});

test('the ground of a dataset is drawn for a key that may only look', async (t) => {
  const terrain = fileURLToPath(new URL('../../scenarios/terrain', import.meta.url));
  const { url, keys: [reader] } = await guarded(t, ['read'], '--terrain-dir', terrain);
  const page = await open(chrome, 'about:blank');
  page.allowed = /status of 403/;
  await page.goto(url);
  await page.fill('#key-field', reader);
  await page.keyboard.press('Enter');
  await drawn(page, FIRST);
  await page.waitForFunction(() => globalThis.noctule.document().terrain.kind === 'dataset' && globalThis.noctule.scene().ground.columns === 201);
  await page.waitForFunction(() => /may look at plans, but may not plan/.test(document.body.textContent));
  await page.done();
});

test('without WebGL the form, the strip and the tables have everything', async () => {
  const page = await open(chrome, 'about:blank');
  page.allowed = /WebGL/;
  await page.addInitScript(() => {
    const real = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) { return kind.startsWith('webgl') ? null : real.call(this, kind, ...rest); };
  });
  await page.goto(site.url);
  await page.waitForFunction(() => /Jacksboro/.test(document.title));
  await page.selectOption('#source', 'paper-1');
  await page.waitForFunction(() => /paper-1/.test(document.title));
  await plan(page);
  assert.equal(await page.locator('.verdict.good').count(), 1);
  assert.match(await page.textContent('#hint'), /no WebGL/);
  assert.equal(await page.locator('#save-picture').count(), 0, 'there is no view to save');
  await page.done();
});
