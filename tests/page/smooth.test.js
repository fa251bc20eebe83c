// On a software renderer, still parts are drawn once and moving ones more coarsely: at rest the picture is the same.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { choose, difference, drawn, FIRST, open, plan, scene, settled } from './support.js';
import { chrome, site } from './together.js';

const width = (page) => page.evaluate(() => document.getElementById('canvas').width);
const rested = (page) => page.waitForFunction(() => document.getElementById('canvas').width === document.getElementById('canvas').clientWidth);

test('a picture of ground and threats with a route on it is what drawing all of it gives', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-1');
  await plan(page);
  // The scene after `act`, in the very frame that it requested.
  const picture = (act, target) => page.evaluate(async ([what, selector]) => {
    const node = document.querySelector(selector);
    if (what === 'click') node.click();
    else node.dispatchEvent(new PointerEvent(what));
    await new Promise(requestAnimationFrame);
    const { backdrop, mark } = globalThis.noctule.scene();
    return { backdrop, mark, data: document.getElementById('canvas').toDataURL() };
  }, [act, target]);
  for (const view of [2, 3]) {
    await settled(page);
    const whole = await picture('click', `#camera > :nth-child(${view})`);
    const marked = await picture('pointerenter', '.legs tr[data-leg="2"]');
    const kept = await picture('pointerleave', '.legs tr[data-leg="2"]');
    assert.deepEqual([whole, marked, kept].map(({ backdrop, mark }) => [backdrop, mark]), [[false, 0], [true, 1], [true, 0]]);
    assert.ok(await difference(page, whole.data, marked.data) > 1e-4, 'the mark is seen');
    const differing = await difference(page, whole.data, kept.data);
    assert.ok(differing < 2e-5, `${differing} of the pixels differ`);
  }
  await page.done();
});

test('turning is drawn coarser, its end sharp', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-1');
  await plan(page);
  await rested(page);
  const whole = await width(page);
  const box = await page.locator('#canvas').boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 3];
  await page.mouse.move(x, y);
  await page.mouse.down();
  let least = whole;
  for (let step = 1; step <= 30 && least === whole; step += 1) {
    await page.mouse.move(x + 4 * step, y);
    least = Math.min(least, await width(page));
  }
  assert.ok(least < whole, `${least} of ${whole} pixels while it turns`);
  await page.mouse.up();
  await rested(page);
  assert.equal((await scene(page)).routes[0].name, 'route');
  await page.done();
});

test('a scene whose context is taken away says so, and comes back as it was', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await choose(page, 'paper-1');
  await plan(page);
  const look = () => page.evaluate(async () => {
    await new Promise(requestAnimationFrame);
    document.querySelector('#camera > :nth-child(2)').click();
    await new Promise(requestAnimationFrame);
    return document.getElementById('canvas').toDataURL();
  });
  await settled(page);
  const before_ = await look();
  for (let round = 0; round < 2; round += 1) {
    await page.evaluate(() => {
      globalThis.taken = document.getElementById('canvas').getContext('webgl2').getExtension('WEBGL_lose_context');
      globalThis.taken.loseContext();
    });
    await page.waitForFunction(() => /let go of the scene/.test(document.getElementById('hint').textContent));
    // An edit meanwhile does no harm.
    await page.click('#add-cylinder');
    await page.click('#undo');
    const count = (await scene(page)).frames.count;
    await page.evaluate(() => globalThis.taken.restoreContext());
    await page.waitForFunction((drawings) => globalThis.noctule.scene().frames.count > drawings, count);
    await page.waitForSelector('#hint', { state: 'hidden' });
    await settled(page);
    const differing = await difference(page, before_, await look());
    assert.ok(differing < 2e-5, `${differing} of the pixels differ`);
    assert.equal((await scene(page)).backdrop, false);
  }
  await page.done();
});
