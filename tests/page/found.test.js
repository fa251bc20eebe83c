// Problems that users of the page have run into.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FIRST, SMALL, WALLED, around, color, contrasts, document_, drawn, drop, fill, groundPoint, made, open, pixels, plan, scene, settled } from './support.js';
import { chrome, site } from './together.js';

const opened = async (id) => {
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict');
  return page;
};

test('a result says so when the scenario has been edited since', async () => {
  const page = await opened(await made(site.url, SMALL));
  assert.ok(await page.isHidden('#stale'));
  await fill(page, '/threats/0/radius', 120);
  await page.waitForSelector('#stale:not([hidden])');
  await page.click('#undo');
  await page.waitForSelector('#stale', { state: 'hidden' });
  await page.click('#redo');
  await page.waitForSelector('#stale:not([hidden])');
  await plan(page, '#replan');
  assert.ok(await page.isHidden('#stale'), 'it is planned again');
  await page.done();
});

test('a route within a threat is seen there', async () => {
  const page = await opened(await made(site.url, WALLED));
  await settled(page);
  const fault = await color(page, 'fault');
  // Within the wall, away from the dots of waypoints and faults.
  const within = [0.46, 0.48, 0.52, 0.54];
  const seen = [];
  for (const share of within) seen.push(await pixels(page, fault, await around(page, await page.evaluate((t) => globalThis.noctule.routeAt(t), share))));
  assert.ok(seen.every((count) => count >= 8), `${seen} pixels of its colour`);
  await page.done();
});

/** Fails if any two elements that match the selector overlap. */
async function apart(page, selector, atLeast) {
  const boxes = await page.locator(selector).evaluateAll((nodes) => nodes.map((node) => {
    const { left, right, top, bottom } = node.getBoundingClientRect();
    return { name: node.textContent, left, right, top, bottom };
  }));
  assert.ok(boxes.length >= atLeast);
  for (const [k, a] of boxes.entries()) {
    for (const b of boxes.slice(k + 1)) {
      assert.ok(a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top, `${a.name} and ${b.name}`);
    }
  }
}

test('names in the scene cover no others', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await settled(page);
  await apart(page, '#labels span:not([hidden])', 4);
  await page.done();
});

test('of many threats the chosen one has its name', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const threats = Array.from({ length: 40 }, (_, k) => ({ kind: 'cylinder', name: `mast ${k}`, center: { x: 60 + (k % 8) * 125, y: 200 + Math.floor(k / 8) * 140 }, radius: 10 }));
  await drop(page, 'masts.json', JSON.stringify({ ...SMALL, threats }), 'application/json');
  await drawn(page, 40);
  const at = await groundPoint(page, threats[37].center.x - 500, threats[37].center.y - 500);
  await page.mouse.click(at.x, at.y);
  await page.waitForFunction(() => document.querySelector('#labels .chosen:not([hidden])')?.textContent === 'mast 37');
  assert.equal(await page.locator('#labels .end').count(), 2);
  await page.done();
});

test('what is pressed in the scene covers nothing else, however narrow', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  for (const width of [1600, 1280, 1100, 800, 600, 390]) {
    await page.setViewportSize({ width, height: 760 });
    await apart(page, '#tools button, #camera > *', 11);
  }
  await page.done();
});

test('a click places to a decimetre, in as many digits as the field can show', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.click('[data-tool=cylinder]');
  const box = await page.locator('#canvas').boundingBox();
  await page.mouse.click(box.x + box.width / 2 + 3, box.y + box.height * 0.6);
  await drawn(page, FIRST + 1);
  for (const value of Object.values((await document_(page)).threats.at(-1).center)) assert.match(String(value), /^-?\d+\.\d{1,6}$/);
  const field = page.locator(`[data-pointer="/threats/${FIRST}/center/lon"]`);
  assert.ok(await field.evaluate((node) => node.scrollWidth <= node.clientWidth), `${await field.inputValue()} is cut off`);
  await page.done();
});

test('light that turns to dark recolours the chart, its legend and what is laid over', async () => {
  const [first, second] = [await made(site.url, SMALL), await made(site.url, { ...SMALL, planner: { ...SMALL.planner, seed: 2 } })];
  const page = await open(chrome, `${site.url}#plan=${first}&with=${second}`);
  await page.waitForFunction(() => globalThis.noctule.scene()?.routes.length === 2);
  await page.emulateMedia({ colorScheme: 'dark' });
  await settled(page);
  const [route, other] = [await color(page, 'route'), await color(page, 'other-0')];
  const hex = (css) => `#${css.match(/\d+/g).slice(0, 3).map((part) => Number(part).toString(16).padStart(2, '0')).join('')}`;
  const swatches = await page.locator('#legend i').evaluateAll((nodes) => nodes.map((node) => getComputedStyle(node).backgroundColor));
  assert.deepEqual(swatches.slice(0, 2).map(hex), [route, other]);
  assert.deepEqual((await scene(page)).routes.map((line) => line.color).sort(), [route, other].sort());
  await page.done();
});

test('what is laid over one scenario goes with it', async () => {
  const [first, second] = [await made(site.url, SMALL), await made(site.url, { ...SMALL, planner: { ...SMALL.planner, seed: 3 } })];
  const page = await open(chrome, `${site.url}#plan=${first}&with=${second}`);
  await page.waitForFunction(() => globalThis.noctule.scene()?.routes.length === 2);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  assert.equal(await page.evaluate(() => location.hash), '');
  assert.equal((await scene(page)).routes.length, 0);
  assert.equal(await page.locator('#legend span').count(), 0);
  await page.done();
});

test('the keyboard turns the scene', async () => {
  const page = await opened(await made(site.url, SMALL));
  await drawn(page, 1);
  const { start } = await document_(page);
  const at = () => page.evaluate((position) => globalThis.noctule.onScreen(globalThis.noctule.toMetres(position)), start);
  await settled(page);
  const before_ = await at();
  await page.focus('[aria-label="Turn left"]');
  await page.keyboard.press('Enter');
  await settled(page);
  const turned = await at();
  assert.ok(Math.hypot(turned.x - before_.x, turned.y - before_.y) > 20);
  await page.keyboard.press('Tab');
  await page.keyboard.press('Enter');
  await settled(page);
  const back = await at();
  assert.ok(Math.hypot(back.x - before_.x, back.y - before_.y) < 1);
  await page.done();
});

test('the name of a chosen threat can be read, light and dark', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.focus('[data-pointer="/threats/0/name"]');
  await page.waitForSelector('#labels .chosen');
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    await settled(page);
    const [contrast] = await contrasts(page, '#labels .chosen', 'color');
    assert.ok(contrast >= 4.5, `${contrast.toFixed(2)} in ${colorScheme}`);
  }
  await page.done();
});
