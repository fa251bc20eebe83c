// Everything can be reached: by keyboard, by name, by fingers, on narrow screens, in colours that the system gives, on paper.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FIRST, LONG, SMALL, WALLED, color, contrasts, document_, drawn, drop, fill, groundPoint, made, open, plan, scene, settled } from './support.js';
import { chrome, site } from './together.js';

const PHONE = { viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true };
const focus = (page) => page.evaluate(() => {
  const { id, dataset, textContent, tagName } = document.activeElement;
  return id || dataset.pointer || `${tagName} ${textContent.slice(0, 20)}`;
});

test('the focus stays with what is done', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const press = async (selector) => {
    await page.focus(selector);
    await page.keyboard.press('Enter');
  };
  await page.focus('#source');
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  assert.equal(await focus(page), 'source');
  await press('#add-cylinder');
  await drawn(page, 4);
  assert.equal(await focus(page), '/threats/3/name');
  await press('[data-index="3"] .head button');
  await drawn(page, 3);
  assert.equal(await page.evaluate(() => document.activeElement.closest('.threat')?.dataset.index), '2');
  for (const [name, value] of Object.entries(LONG)) await fill(page, `/planner/${name}`, value);
  await press('#plan');
  await page.waitForSelector('#cancel:not([hidden])');
  assert.equal(await focus(page), 'plan');
  await press('#cancel');
  await page.waitForSelector('.verdict');
  assert.equal(await focus(page), 'plan');
  await page.done();
});

test('pages of threats are turned without losing the focus', async () => {
  const many = { ...SMALL, threats: Array.from({ length: 45 }, (_, k) => ({ kind: 'cylinder', center: { x: 50 + 20 * k, y: 700 }, radius: 5 })) };
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, many)}`);
  await page.waitForSelector('.verdict');
  await page.focus('#later');
  await page.keyboard.press('Enter');
  assert.equal(await focus(page), 'later');
  await page.keyboard.press('Enter');
  assert.equal(await focus(page), 'threats-head', 'where there are no later ones');
  await page.done();
});

test('the corners of a long outline are listed in parts', async () => {
  const corner = (k) => ({ x: 500 + 60 * Math.cos((2 * Math.PI * k) / 45), y: 500 + 60 * Math.sin((2 * Math.PI * k) / 45) });
  const outline = { ...SMALL, threats: [{ kind: 'polygon', vertices: Array.from({ length: 45 }, (_, k) => corner(k)) }] };
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, outline)}`);
  await page.waitForSelector('.verdict');
  await page.click('[data-part="vertices 0"] > summary');
  const listed = () => page.evaluate(() => {
    const fields = [...document.querySelectorAll('[data-part="vertices 0"] input')].map(({ dataset }) => dataset.pointer.split('/')[4]);
    return [fields[0], fields.at(-1), fields.length];
  });
  const press = async (selector) => {
    await page.focus(selector);
    await page.keyboard.press('Enter');
  };
  assert.deepEqual(await listed(), ['0', '19', 40]);
  await press('#later-0');
  assert.deepEqual(await listed(), ['20', '39', 40]);
  assert.equal(await focus(page), 'later-0');
  await page.keyboard.press('Enter');
  assert.deepEqual(await listed(), ['40', '44', 10]);
  assert.equal(await focus(page), 'SUMMARY 45 corners', 'where there are no later ones');
  await fill(page, '/threats/0/vertices/43/x', 'far');
  await page.waitForSelector('.faults li button');
  await press('#earlier-0');
  assert.deepEqual(await listed(), ['20', '39', 40]);
  await page.click('.faults li button');
  assert.equal(await focus(page), '/threats/0/vertices/43/x');
  await press('#earlier-0');
  await page.getByRole('button', { name: 'Add a corner' }).click();
  assert.deepEqual(await listed(), ['40', '45', 12]);
  await page.done();
});

test('the ring of a focus is round what has it', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.focus('#source');
  await page.keyboard.press('Tab');
  assert.equal(await focus(page), 'file');
  assert.deepEqual(await page.evaluate(() => ['label[for=file]', '#empty'].map((part) => getComputedStyle(document.querySelector(part)).outlineStyle)), ['solid', 'none']);
  await page.done();
});

test('fields say whose they are, and their faults are said once', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await fill(page, '/threats/1/name', 'mast');
  const group = page.getByRole('group', { name: 'mast' });
  await fill(page, '/threats/1/radius', '-3');
  await page.waitForSelector('[data-pointer="/threats/1/radius"][aria-invalid=true]');
  assert.equal(await group.getByRole('textbox', { name: 'Core radius m', exact: true }).inputValue(), '-3');
  assert.match(await page.textContent('#said'), /One thing to mend: mast: radius is -3/);
  await fill(page, '/threats/1/radius', '60');
  await page.waitForFunction(() => /Nothing is left to mend/.test(document.getElementById('said').textContent));
  await page.done();
});

test('a search is said to run, and nothing of a connection that was never lost', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.evaluate(() => {
    globalThis.heard = [];
    new MutationObserver(() => globalThis.heard.push(document.getElementById('said').textContent)).observe(document.getElementById('said'), { childList: true });
  });
  for (const [name, value] of Object.entries(LONG)) await fill(page, `/planner/${name}`, value);
  await page.click('#plan');
  await page.waitForFunction(() => globalThis.noctule.history().points > 0);
  // While it runs, another is planned.
  await page.click('#plan');
  await page.waitForFunction(() => /goes on, and is in the list of plans/.test(document.getElementById('notice').textContent));
  await page.click('text="Show the list"');
  assert.ok(await page.isVisible('#plans'));
  await page.click('#cancel');
  await page.waitForSelector('.verdict');
  const heard = await page.evaluate(() => globalThis.heard);
  assert.ok(heard.includes('The search is running.'), heard.join(' | '));
  assert.ok(!heard.some((text) => /Connected/.test(text)), heard.join(' | '));
  await page.done();
});

test('what cannot be planned is told in words, and leads to the nearest field', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  const document = { ...SMALL, planner: { ...SMALL.planner, swarm: 3 } };
  await drop(page, 'swarm.json', JSON.stringify(document), 'application/json');
  await drawn(page, 1);
  await page.click('#plan');
  await page.waitForFunction(() => /cannot be planned yet: one thing is to mend/.test(document.getElementById('notice').textContent));
  assert.match(await focus(page), /^\/planner\//);
  await page.done();
});

test('a route to begin with that is gone is said to be gone', async () => {
  const id = await made(site.url, SMALL);
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict');
  await fetch(`${site.url}/plans/${id}`, { method: 'DELETE' });
  await page.click('#replan');
  await page.waitForFunction(() => /no route to begin with: .*Plan begins without one/.test(document.getElementById('notice').textContent));
  await plan(page);
  await page.done();
});

test('undo takes back what was done when the cursor is in a field', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.click('[data-tool=cylinder]');
  const at = await groundPoint(page, 0, 0);
  await page.mouse.click(at.x, at.y);
  await drawn(page, FIRST + 1);
  await page.click('[data-pointer="/name"]');
  await page.keyboard.press('Control+z');
  await drawn(page, FIRST);
  await page.keyboard.press('Control+y');
  await drawn(page, FIRST + 1);
  await page.done();
});

test('numbers have a point or a comma, and what can be read in two ways is refused', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  const max = async (text) => {
    await fill(page, '/altitude/max', text);
    return (await document_(page)).altitude.max;
  };
  for (const [text, value] of [['120,5', 120.5], ['120.5', 120.5], ['1e3', 1000], ['0x10', '0x10'], ['1,000', '1,000'], ['1,2,3', '1,2,3'], ['Infinity', 'Infinity']]) assert.equal(await max(text), value);
  await max('1,000');
  await page.waitForFunction(() => document.getElementById('fault-altitude-max').textContent === '1,000 can be read in two ways: write 1000 or 1.0');
  assert.equal(await page.getAttribute('[data-pointer="/start/x"]', 'inputmode'), null, 'a keypad without a minus is not asked for');
  assert.equal(await page.getAttribute('[data-pointer="/altitude/max"]', 'inputmode'), 'decimal');
  await page.done();
});

test('long names break nothing, narrow or wide', async () => {
  const name = 'mission_2026_11_27_sector_north_alpha_v3_final_reviewed_b2'.repeat(3);
  const id = await made(site.url, { ...SMALL, name, threats: [{ ...SMALL.threats[0], name }] });
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict');
  await page.click('#tab-plans');
  await page.waitForSelector(`[data-key="remove ${id}"]`);
  for (const width of [1440, 1024, 360]) {
    await page.setViewportSize({ width, height: 800 });
    await settled(page);
    const beyond = await page.evaluate(([remove]) => {
      const inside = (selector, of) => document.querySelector(selector).getBoundingClientRect().right <= document.querySelector(of).getBoundingClientRect().right + 0.5;
      return {
        document: document.documentElement.scrollWidth - innerWidth,
        remove: inside(remove, '#plans'), plan: inside('#plan', 'body'), clearances: [...document.querySelectorAll('.right table')].every((table) => table.getBoundingClientRect().right <= document.querySelector('.right').getBoundingClientRect().right),
        label: Math.max(...[...document.querySelectorAll('#labels span')].map((label) => label.offsetWidth)) < 250,
      };
    }, [`[data-key="remove ${id}"]`]);
    assert.deepEqual(beyond, { document: 0, remove: true, plan: true, clearances: true, label: true }, `${width}`);
  }
  await page.done();
});

test('on a phone, what is told is in sight wherever the page is, and Tab goes the way of the eye', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`, PHONE);
  await page.waitForSelector('.verdict');
  const tops = await page.evaluate(() => ['.view', '.right', '.left'].map((part) => document.querySelector(part)).map((node, k, all) => [
    node.getBoundingClientRect().top, k === 0 || Boolean(all[k - 1].compareDocumentPosition(node) & Node.DOCUMENT_POSITION_FOLLOWING)]));
  assert.ok(tops[0][0] < tops[1][0] && tops[1][0] < tops[2][0], JSON.stringify(tops));
  assert.ok(tops.every(([, follows]) => follows), JSON.stringify(tops));
  await fill(page, '/altitude/max', '5');
  await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
  await page.click('#plan');
  await page.waitForFunction(() => /cannot be planned/.test(document.getElementById('notice').textContent));
  await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
  const notice = await page.locator('#notice').boundingBox();
  assert.ok(notice.y >= 0 && notice.y + notice.height <= 740, JSON.stringify(notice));
  await page.done();
});

test('on a wide screen only the columns scroll', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`);
  await page.waitForSelector('.verdict');
  await fill(page, '/altitude/max', '5');
  await page.click('#plan');
  await page.waitForFunction(() => /cannot be planned/.test(document.getElementById('notice').textContent));
  assert.deepEqual(await page.evaluate(() => [scrollY, document.documentElement.scrollHeight - innerHeight]), [0, 0]);
  await page.done();
});

test('on a screen of middling width, what is placed in the scene leaves the scene in sight', async () => {
  const page = await open(chrome, site.url, { viewport: { width: 1024, height: 768 } });
  await drawn(page, FIRST);
  await page.click('[data-tool=cylinder]');
  await page.locator('#canvas').scrollIntoViewIfNeeded();
  const at = await groundPoint(page, 0, 0);
  await page.mouse.click(at.x, at.y);
  await page.waitForSelector('.threat.chosen');
  assert.equal(await page.evaluate(() => scrollY), 0);
  await page.done();
});

test('a finger takes hold of the start', async () => {
  const page = await open(chrome, site.url, PHONE);
  await drawn(page, FIRST);
  await settled(page);
  const before_ = (await document_(page)).start;
  const box = await page.locator('#canvas').boundingBox();
  const at = await page.evaluate((position) => globalThis.noctule.onScreen(globalThis.noctule.toMetres(position)), before_);
  const [x, y] = [box.x + at.x + 17, box.y + at.y + 4];
  const touch = await page.context().newCDPSession(page);
  await touch.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: [{ x, y }] });
  await touch.send('Input.dispatchTouchEvent', { type: 'touchMove', touchPoints: [{ x: x + 30, y: y - 20 }] });
  await touch.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  assert.notDeepEqual((await document_(page)).start, before_);
  await page.click('[data-tool=polygon]');
  assert.match(await page.textContent('#hint'), /Tap the corners/);
  await page.done();
});

test('a finger takes back the last corner of a polygon', async () => {
  const page = await open(chrome, site.url, { viewport: { width: 800, height: 900 }, hasTouch: true });
  await drawn(page, FIRST);
  assert.ok(await page.isDisabled('#undo'), 'nothing has been done yet');
  await page.tap('[data-tool=polygon]');
  await page.locator('#canvas').scrollIntoViewIfNeeded();
  for (const [x, y] of [[-3000, -1000], [1000, -3000], [1000, 1000]]) {
    const at = await groundPoint(page, x, y);
    await page.touchscreen.tap(at.x, at.y);
  }
  assert.equal((await scene(page)).handles, 3);
  await page.tap('#undo');
  assert.equal((await scene(page)).handles, 2);
  await page.tap('#undo');
  await page.tap('#undo');
  assert.equal((await scene(page)).handles, 0);
  assert.ok(await page.isDisabled('#undo'));
  assert.equal((await document_(page)).threats.length, FIRST);
  await page.done();
});

test('a route that breaks something is not offered in formats that would be refused', async () => {
  const wall = [[47.02, 7.9], [47.02, 8.1], [47.03, 8.1], [47.03, 7.9]].map(([lat, lon]) => ({ lat, lon }));
  const walled = {
    ...WALLED, frame: 'wgs84', start: { lat: 47, lon: 8, alt: 50 }, target: { lat: 47.05, lon: 8, alt: 50 }, area: { min: { lat: 46.99, lon: 7.99 }, max: { lat: 47.06, lon: 8.01 } },
    threats: [{ kind: 'polygon', name: 'wall', vertices: wall }],
  };
  const id = await made(site.url, walled);
  const page = await open(chrome, `${site.url}#plan=${id}`);
  await page.waitForSelector('.verdict.bad');
  const offered = await page.locator('[data-format]').evaluateAll((buttons) => buttons.map(({ dataset, disabled }) => [dataset.format, !disabled]));
  for (const [format, yes] of offered) {
    const { ok } = await fetch(`${site.url}/plans/${id}/result?format=${format}`);
    assert.equal(yes, ok, format);
  }
  assert.equal(offered.length, 9);
  assert.equal(await page.locator('[data-format].main').count(), 0);
  await page.done();
});

test('the map is printed', async () => {
  const page = await open(chrome, `${site.url}#plan=${await made(site.url, SMALL)}`);
  await page.waitForSelector('.verdict');
  await settled(page);
  await page.emulateMedia({ media: 'print' });
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  assert.ok(await page.isHidden('#plan') && await page.isHidden('#scenario') && await page.isVisible('.verdict'));
  const route = await color(page, 'route');
  const seen = await page.locator('.printed').evaluate((canvas, wanted) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const want = [1, 3, 5].map((at) => parseInt(wanted.slice(at, at + 2), 16));
    let count = 0;
    for (let at = 0; at < data.length; at += 4) if (want.every((value, k) => Math.abs(data[at + k] - value) <= 12)) count += 1;
    return count;
  }, route);
  assert.ok(seen > 100, `${seen} pixels of the route`);
  await page.evaluate(() => dispatchEvent(new Event('afterprint')));
  assert.equal(await page.locator('.printed').count(), 0);
  await page.done();
});

test('where a field is can be seen, light and dark', async () => {
  const page = await open(chrome, site.url);
  await drawn(page, FIRST);
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    const contrast = await contrasts(page, '[data-pointer="/name"], #source', 'borderTopColor');
    assert.ok(contrast.length === 2 && contrast.every((ratio) => ratio >= 3), `${contrast} in ${colorScheme}`);
  }
  await page.done();
});

test('in colours that the system gives, the tool in hand and the curves can be told apart', async () => {
  const page = await open(chrome, site.url, { forcedColors: 'active' });
  await drawn(page, FIRST);
  await page.selectOption('#source', 'paper-1');
  await drawn(page, 3);
  await plan(page);
  const style = (selector, what) => page.locator(selector).evaluateAll((nodes, name) => nodes.map((node) => getComputedStyle(node)[name]), what);
  assert.deepEqual(await style('#tools button[aria-pressed=true]', 'outlineStyle'), ['solid']);
  assert.ok((await style('#tools button[aria-pressed=false]', 'outlineStyle')).every((value) => value === 'none'));
  await page.waitForFunction(() => /proven bound/.test(document.getElementById('legend').textContent));
  assert.equal(new Set(await style('#legend i', 'backgroundColor')).size, 3);
  await page.done();
});
