// The address names what is shown; Back and Forward go through it, and nothing drawn is lost on the way.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FIRST, SMALL, document_, drawn, fill, held, made, open, plan, scene } from './support.js';
import { chrome, site } from './together.js';

const named = (name) => made(site.url, { ...SMALL, name });
const hash = (page) => page.evaluate(() => location.hash);
const titled = (page, name) => page.waitForFunction((text) => document.title.startsWith(text), name);

test('of two plans the one that was opened last is shown, whichever comes first', async () => {
  const [slow, quick] = [await named('slow'), await named('quick')];
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.click('#tab-plans');
  const release = await held(page, `**/plans/${slow}/result`);
  await page.click(`[data-key="open ${slow}"]`);
  await page.click(`[data-key="open ${quick}"]`);
  await page.waitForSelector('.verdict.good');
  await titled(page, 'quick');
  await release();
  // What would have shown the slow one comes before a further answer to the page.
  await page.evaluate(() => fetch('/scenarios').then((answer) => answer.text()));
  assert.equal((await document_(page)).name, 'quick');
  assert.equal(await hash(page), `#plan=${quick}`);
  await page.done();
});

test('what is typed while a plan is opened can be had back, and the page says so', async () => {
  const id = await named('opened');
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const release = await held(page, `**/plans/${id}/scenario`);
  await page.click('#tab-plans');
  await page.click(`[data-key="open ${id}"]`);
  await page.click('#tab-scenario');
  await fill(page, '/name', 'typed meanwhile');
  await release();
  await page.waitForSelector('.verdict.good');
  assert.match(await page.textContent('#notice'), /Undo brings that back/);
  await page.click('#undo');
  assert.equal((await document_(page)).name, 'typed meanwhile');
  await page.done();
});

test('a link to several plans of which one is gone shows the others, and says which is gone', async () => {
  const [front, gone, other] = [await named('front'), await named('gone'), await named('other')];
  await fetch(new URL(`/plans/${gone}`, site.url), { method: 'DELETE' });
  const page = await open(chrome, `${site.url}#plan=${front}&with=${gone}+${other}`);
  await page.waitForFunction(() => globalThis.noctule?.scene()?.routes.length === 2);
  await page.waitForSelector('#notice:not([hidden])');
  assert.ok((await page.textContent('#notice')).includes(gone));
  assert.equal((await document_(page)).name, 'front');
  assert.equal(await hash(page), `#plan=${front}&with=${other}`);
  await page.done();
});

test('Back and Forward go through plans, scenarios and drawings', async () => {
  const [one, two] = [await named('one'), await named('two')];
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await page.click('#add-cylinder');
  await drawn(page, 4);
  await page.click('#tab-plans');
  await page.click(`[data-key="open ${one}"]`);
  await titled(page, 'one');
  await page.click(`[data-key="open ${two}"]`);
  await titled(page, 'two');
  await page.goBack();
  await titled(page, 'one');
  assert.equal(await hash(page), `#plan=${one}`);
  await page.goBack();
  await titled(page, 'paper-1');
  assert.equal((await document_(page)).threats.length, 4, 'with what was drawn');
  assert.equal(await hash(page), '');
  await page.goForward();
  await titled(page, 'one');
  await page.goForward();
  await titled(page, 'two');
  await page.done();
});

test('an address that names no plan is put right', async () => {
  const id = await named('shown');
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict.good');
  for (const wrong of ['#scenario', '#plan=', '#plan=01900000-0000-7000-8000-000000000000']) {
    await page.evaluate((text) => { location.hash = text; }, wrong);
    await page.waitForSelector('#notice:not([hidden])');
    await page.waitForFunction((right) => location.hash === right, `#plan=${id}`);
    await page.click('#notice [aria-label=Dismiss]');
  }
  assert.equal((await document_(page)).name, 'shown');
  await page.done();
});

test('the link to the scenario leads there from the list of plans, and leaves the address alone', async () => {
  const id = await named('linked');
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict.good');
  await page.click('#tab-plans');
  await page.focus('.skip');
  await page.keyboard.press('Enter');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'scenario');
  assert.ok(await page.isVisible('#scenario'));
  assert.equal(await hash(page), `#plan=${id}`);
  await page.done();
});

test('the browser asks before a drawing is lost, and only then', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const asked = [];
  page.on('dialog', (dialog) => {
    asked.push(dialog.type());
    dialog.accept();
  });
  await page.click('#add-cylinder');
  await drawn(page, FIRST + 1);
  await page.click('#undo');
  await drawn(page, FIRST);
  await page.reload();
  await drawn(page, FIRST);
  assert.deepEqual(asked, [], 'what is undone is as it was loaded');
  await page.click('#add-cylinder');
  await drawn(page, FIRST + 1);
  await page.reload();
  await drawn(page, FIRST);
  assert.deepEqual(asked, ['beforeunload']);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await page.click('#add-cylinder');
  await plan(page);
  await page.reload();
  await page.waitForSelector('.verdict.good');
  assert.equal((await scene(page)).threats, 4);
  assert.deepEqual(asked, ['beforeunload'], 'the service has what is planned');
  await page.done();
});
