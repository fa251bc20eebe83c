// The line to the service: it dies without a word, is not there at first, or is shared by many tabs.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FIRST, LONG, SMALL, ask, drawn, drop, fill, held, open, wire } from './support.js';
import { chrome, site } from './together.js';

/** A plan that runs until it is stopped. */
async function begun(name) {
  const { id } = await ask(site.url, '/plans', { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify({ ...SMALL, name, planner: { ...SMALL.planner, ...LONG } }) });
  return id;
}
const cancel = (id) => fetch(`${site.url}/plans/${id}/cancel`, { method: 'POST' });
const points = (page) => page.evaluate(() => globalThis.noctule.history().points);
const morePoints = (page, than) => page.waitForFunction((count) => globalThis.noctule.history().points > count, than);

for (const [how, notice] of [
  ['a long silence', (page) => page.clock.fastForward(60000)],
  ['the browser is online again', (page) => page.evaluate(() => { dispatchEvent(new Event('online')); })],
]) {
  test(`a line that dies without a word is found out: ${how}`, async (t) => {
    const line = await wire(site.url);
    t.after(line.stop);
    const id = await begun('silent');
    const page = await open(chrome, 'about:blank');
    await page.clock.install();
    await page.goto(`${line.url}#plan=${id}`);
    await morePoints(page, 0);
    line.swallow();
    const known = await points(page);
    await ask(site.url, `/plans/${id}`);
    await notice(page);
    await morePoints(page, known + 20);
    await page.waitForFunction(() => document.getElementById('state').textContent === 'running');
    await cancel(id);
    await page.waitForSelector('.verdict');
    await page.done();
  });
}

test('a page that is not in sight leaves the connections to those that are, and misses nothing', async () => {
  const id = await begun('shared');
  const see = (page, yes) => page.evaluate((seen) => {
    Object.defineProperty(document, 'hidden', { configurable: true, value: !seen });
    document.dispatchEvent(new Event('visibilitychange'));
  }, yes);
  const context = await chrome.newContext();
  const pages = [];
  // One more than a browser has connections for.
  for (let n = 0; n < 7; n += 1) {
    const page = await context.newPage();
    pages.push(page);
    await page.goto(`${site.url}#plan=${id}`);
    await page.waitForFunction(() => globalThis.noctule?.history().points > 0);
    await see(page, false);
  }
  const known = await points(pages[0]);
  const after_ = await points(pages[6]);
  await see(pages[6], true);
  await morePoints(pages[6], after_ + 20);
  await pages[6].click('#cancel');
  await pages[6].waitForSelector('.verdict');
  await see(pages[0], true);
  await pages[0].waitForSelector('.verdict');
  assert.ok(await points(pages[0]) > known);
  await context.close();
});

test('on a slow line the frame of the page is seen before what it is made with', async () => {
  const page = await chrome.newPage({ viewport: { width: 1440, height: 900 } });
  const release = await held(page, /\/page\/.*\.js$|uplot\.css$/);
  page.goto(site.url).catch(() => {});
  await page.waitForFunction(() => performance.getEntriesByName('first-contentful-paint').length === 1);
  for (const text of ['Noctule', 'Scenario', 'Plans', 'Altitude', 'Search']) assert.ok(await page.locator(`text="${text}"`).first().isVisible(), text);
  const scene_ = await page.locator('#scene').boundingBox();
  assert.ok(scene_.width > 500 && scene_.height > 500, 'and where the scene will be');
  const said = () => page.evaluate(() => [['scene', '::after'], ['scenario', '::before'], ['figures', '::before']].map(([id, at]) => getComputedStyle(document.getElementById(id), at).content));
  assert.deepEqual(await said(), ['"Loading…"', '"Loading…"', '"Loading…"']);
  await release();
  await drawn(page, FIRST);
  assert.deepEqual(await said(), ['none', 'none', 'none']);
  await page.context().close();
});

test('a page that cannot begin says so, and begins when it is told to', async () => {
  const page = await open(chrome, 'about:blank');
  page.allowed = /ERR_|Failed to load resource/;
  let there = false;
  await page.route('**/algorithms', (route) => (there ? route.continue() : route.abort()));
  await page.goto(site.url);
  await page.waitForFunction(() => /cannot begin/.test(document.getElementById('notice').textContent));
  assert.match(await page.textContent('#notice'), /The service cannot be reached/);
  assert.ok(await page.isDisabled('#plan'));
  there = true;
  await page.click('text="Try again"');
  await drawn(page, FIRST);
  assert.ok(await page.isEnabled('#plan'));
  assert.ok(await page.isHidden('#notice'));
  await page.done();
});

test('an edit that cannot be checked says so, until one can', async () => {
  const page = await open(chrome, site.url);
  page.allowed = /ERR_|Failed to load resource/;
  await drawn(page, FIRST);
  let there = false;
  await page.route('**/plans?validate_only=true', (route) => (there ? route.continue() : route.abort()));
  await fill(page, '/name', 'one');
  await page.waitForFunction(() => /not checked/.test(document.getElementById('notice').textContent));
  there = true;
  await fill(page, '/name', 'two');
  await page.waitForSelector('#notice', { state: 'hidden' });
  there = false;
  await fill(page, '/threats/0/radius', '-3');
  await page.waitForFunction(() => /not checked/.test(document.getElementById('notice').textContent));
  // Neither hides the other.
  await drop(page, 'broken.json', '{', 'application/json');
  await page.waitForFunction(() => /not checked.*broken.json is no JSON/.test(document.getElementById('notice').textContent));
  await page.locator('#notice [aria-label=Dismiss]').last().click();
  assert.match(await page.textContent('#notice'), /not checked/);
  there = true;
  // Without another change.
  await page.waitForSelector('[data-pointer="/threats/0/radius"][aria-invalid=true]');
  await page.waitForSelector('#notice', { state: 'hidden' });
  await page.done();
});
