// A service, a browser, and helpers that act as a person would.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import net from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const CHROMIUM = process.env.CHROMIUM_BIN ?? '/usr/bin/chromium';
const ARGUMENTS = [
  '--no-sandbox', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync',
];

/** What has not happened by then will not happen: long, since the machine may be busy. */
const PATIENCE_MS = 600000;

/** Messages that the browser logs about responses that the page expects: refusals are shown in the page. */
const EXPECTED = /Failed to load resource: the server responded with a status of (401|404|409|410|422)|GPU stall due to ReadPixels/;

/** Starts the program on a port of its own. Returns `{url, stop}`. */
export async function service(...settings) {
  const directory = mkdtempSync(join(tmpdir(), 'noctule-page-'));
  const process_ = spawn(process.env.NOCTULE_BIN, ['serve', '--listen', '127.0.0.1:0', '--data-dir', directory, '--grace', '1', ...settings], {
    stdio: ['ignore', 'pipe', 'pipe'], cwd: directory, env: { ...process.env, NOCTULE_BIN: undefined },
  });
  let log = '';
  process_.stderr.on('data', (text) => { log += text; });
  const url = await new Promise((done, failed) => {
    let said = '';
    process_.stdout.on('data', (text) => {
      said += text;
      const [, found] = said.match(/listening on (\S+)\n/) ?? [];
      if (found) done(found);
    });
    process_.on('exit', () => failed(new Error(`the service ended:\n${log}`)));
  });
  const stop = async () => {
    const gone = new Promise((done) => { process_.on('exit', done); });
    process_.kill('SIGKILL');
    await gone;
    rmSync(directory, { recursive: true, force: true });
  };
  return { url, stop };
}

/**
 * A connection to the service that can be cut: `{url, cut, swallow, mend, stop}`. What is swallowed vanishes without a word to
 * either end, on connections that were open before.
 */
export async function wire(url) {
  const { port } = new URL(url);
  const sockets = new Set();
  const dead = new Set();
  let whole = true;
  const server = net.createServer((near) => {
    if (!whole) {
      near.destroy();
      return;
    }
    const far = net.connect(Number(port), '127.0.0.1');
    for (const [a, b] of [[near, far], [far, near]]) {
      sockets.add(a);
      a.on('data', (bytes) => { if (!dead.has(a)) b.write(bytes); });
      a.on('end', () => { if (!dead.has(a)) b.end(); });
      a.on('error', () => {});
      a.on('close', () => {
        sockets.delete(a);
        b.destroy();
      });
    }
  });
  await new Promise((done) => { server.listen(0, '127.0.0.1', done); });
  const cut = () => {
    whole = false;
    for (const socket of sockets) socket.destroy();
  };
  const swallow = () => { for (const socket of sockets) dead.add(socket); };
  return { url: `http://127.0.0.1:${server.address().port}`, cut, swallow, mend: () => { whole = true; }, stop: () => { cut(); server.close(); } };
}

/** A browser with an empty profile. */
export const browser = () => chromium.launch({ executablePath: CHROMIUM, args: ARGUMENTS });

/** Opens the page and watches its console; `done` asserts that nothing went wrong in it. */
export async function open(chrome, url, settings = {}) {
  const context = await chrome.newContext({ viewport: { width: 1440, height: 900 }, acceptDownloads: true, ...settings });
  await context.grantPermissions(['clipboard-read', 'clipboard-write']).catch(() => {});
  const page = await context.newPage();
  const wrong = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !EXPECTED.test(message.text()) && !page.allowed?.test(message.text())) wrong.push(message.text());
  });
  page.on('pageerror', (error) => wrong.push(error.stack));
  page.setDefaultTimeout(PATIENCE_MS);
  await page.goto(url);
  const done = async () => {
    await context.close();
    assert.deepEqual(wrong, [], 'the console is free of errors');
  };
  return Object.assign(page, { done });
}

/** Threats of the initial scenario. */
export const FIRST = 4;

/** Waits until a scenario is drawn. */
export const drawn = (page, threats) => page.waitForFunction((count) => {
  const scene = globalThis.noctule?.scene();
  return scene && scene.ends === 2 && (count === undefined ? scene.frames.count > 1 : scene.threats === count);
}, threats);

/** Waits until nothing more is drawn. Counted in the page's own frames, so a slow machine gets the time it needs. */
export const settled = (page) => page.evaluate(async () => {
  const drawings = () => globalThis.noctule.scene()?.frames.count;
  for (let still = 0, before = drawings(); still < 20; still += 1) {
    await new Promise(requestAnimationFrame);
    if (drawings() === before) continue;
    before = drawings();
    still = 0;
  }
});

export const scene = (page) => page.evaluate(() => globalThis.noctule.scene());
export const document_ = (page) => page.evaluate(() => globalThis.noctule.document());

/** Chooses a shipped scenario, with some of its values changed. */
export async function choose(page, name, values = {}) {
  const drawnBefore = (await scene(page)).frames.count;
  await page.selectOption('#source', name);
  // What is drawn may still be the scenario before, whose fields would be filled in vain.
  const title = await page.evaluate(async (wanted) => (await (await fetch(`/scenarios/${wanted}`)).json()).name, name);
  await page.waitForFunction(([before, wanted]) => globalThis.noctule.document().name === wanted && globalThis.noctule.scene().frames.count > before, [drawnBefore, title]);
  for (const [pointer, value] of Object.entries(values)) await fill(page, pointer, value);
}

/** Types into the field of a pointer, opening its surrounding sections first. */
export async function fill(page, pointer, value) {
  const field = page.locator(`[data-pointer="${pointer}"]`);
  await field.waitFor({ state: 'attached' });
  // In one step: the form may be rebuilt between two.
  await page.evaluate((selector) => { for (let at = document.querySelector(selector); at; at = at.parentElement) if (at.tagName === 'DETAILS') at.open = true; }, `[data-pointer="${pointer}"]`);
  await field.fill(String(value));
}

/** Plans, and waits for the verdict. */
export async function plan(page, button = '#plan') {
  await page.evaluate(() => document.querySelector('.verdict')?.classList.add('old'));
  await page.click(button);
  await page.waitForSelector('.verdict:not(.old)');
  return page.evaluate(() => new URLSearchParams(location.hash.slice(1)).get('plan'));
}

/** The number of pixels in a CSS box whose colour is close to the given one. */
export async function pixels(page, color, clip) {
  const picture = (await page.screenshot({ clip })).toString('base64');
  const eye = await page.context().newPage();
  try {
    return await eye.evaluate(async ([data, wanted]) => {
      const image = new Image();
      image.src = `data:image/png;base64,${data}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      const pen = canvas.getContext('2d');
      pen.drawImage(image, 0, 0);
      const seen = pen.getImageData(0, 0, image.width, image.height).data;
      const want = [1, 3, 5].map((at) => parseInt(wanted.slice(at, at + 2), 16));
      let count = 0;
      for (let at = 0; at < seen.length; at += 4) if (want.every((value, k) => Math.abs(seen[at + k] - value) <= 12)) count += 1;
      return count;
    }, [picture, color]);
  } finally {
    await eye.close();
  }
}

/** The share of pixels that differ by more than a shade between two pictures, both given as data URLs. */
export async function difference(page, one, other) {
  const eye = await page.context().newPage();
  try {
    return await eye.evaluate(async (pictures) => {
      const [a, b] = await Promise.all(pictures.map(async (data) => {
        const image = new Image();
        image.src = data;
        await image.decode();
        const pen = new OffscreenCanvas(image.width, image.height).getContext('2d');
        pen.drawImage(image, 0, 0);
        return pen.getImageData(0, 0, image.width, image.height).data;
      }));
      let count = 0;
      for (let at = 0; at < a.length; at += 4) if ([0, 1, 2].some((k) => Math.abs(a[at + k] - b[at + k]) > 8)) count += 1;
      return count / (a.length / 4);
    }, [one, other]);
  } finally {
    await eye.close();
  }
}

/** A colour of the style sheet. */
export const color = (page, name) => page.evaluate((variable) => getComputedStyle(document.documentElement).getPropertyValue(`--${variable}`).trim(), name);

/** A box of `size` pixels around a place of the scene, on the screen. */
export async function around(page, place, size = 14) {
  const box = await page.locator('#canvas').boundingBox();
  const at = await page.evaluate((p) => globalThis.noctule.onScreen(p), place);
  assert.ok(at, 'the place is before the camera');
  return { x: box.x + at.x - size / 2, y: box.y + at.y - size / 2, width: size, height: size };
}

/** The screen position of a place on the ground. */
export async function groundPoint(page, x, y) {
  const z = await page.evaluate(([a, b]) => globalThis.noctule.groundAt(a, b), [x, y]);
  const { x: px, y: py, width } = await around(page, { x, y, z });
  return { x: px + width / 2, y: py + width / 2 };
}

/** Holds back responses to matching requests; `release()` lets them through and resolves when the page has them. */
export async function held(page, pattern) {
  let waiting = [];
  await page.route(pattern, (route) => (waiting ? waiting.push(route) : route.continue()));
  return async () => {
    const all = waiting;
    waiting = null;
    await Promise.all(all.map(async (route) => {
      const answered = page.waitForResponse((response) => response.request() === route.request());
      await route.continue();
      await (await answered).finished();
    }));
  };
}

/** Drops a file onto the page. */
export async function drop(page, name, text, type) {
  const transfer = await page.evaluateHandle(([file, content, kind]) => {
    const data = new DataTransfer();
    data.items.add(new File([content], file, { type: kind }));
    return data;
  }, [name, text, type]);
  await page.dispatchEvent('body', 'dragenter', { dataTransfer: transfer });
  await page.dispatchEvent('body', 'drop', { dataTransfer: transfer });
}

/** The response of an endpoint. */
export const ask = async (url, path, options) => (await fetch(new URL(path, url), options)).json();

/** Makes a plan through the API and waits for its end. */
export async function made(url, document) {
  const status = await ask(url, '/plans', { method: 'POST', headers: { 'content-type': 'application/json', prefer: 'wait=30' }, body: JSON.stringify(document) });
  assert.equal(status.status, 'succeeded', JSON.stringify(status));
  return status.id;
}

/** A small scenario that is planned quickly. */
export const SMALL = {
  name: 'small', start: { x: 100, y: 100, z: 50 }, target: { x: 900, y: 900, z: 50 }, area: { min: { x: 0, y: 0 }, max: { x: 1000, y: 1000 } },
  threats: [{ kind: 'cylinder', name: 'radar', center: { x: 500, y: 500 }, radius: 100, influence: 160 }],
  altitude: { min: 20, max: 120 }, planner: { population: 30, iterations: 20, waypoints: 6, seed: 1 },
};

/** A search that lasts until it is stopped, however fast the program and the machine: minutes at least. */
export const LONG = { iterations: 100000, population: 2000 };

/** A wall that no route can pass. */
export const WALLED = {
  ...SMALL, name: 'walled',
  threats: [{ kind: 'polygon', name: 'wall', vertices: [{ x: -500, y: 450 }, { x: 1500, y: 450 }, { x: 1500, y: 550 }, { x: -500, y: 550 }] }],
};

/**
 * The contrasts (WCAG 2.2) of a colour of each of these nodes, such as `color`, with its background. They are looked up
 * and measured in one step: a form that is filled in anew in between would leave nodes without a style.
 */
export const contrasts = (page, selector, name) => page.evaluate(([nodes, property]) => [...document.querySelectorAll(nodes)].map((node) => {
  const style = getComputedStyle(node);
  const linear = (part) => (part / 255 <= 0.04045 ? part / 255 / 12.92 : ((part / 255 + 0.055) / 1.055) ** 2.4);
  const [light, dark] = [style[property], style.backgroundColor].map((css) => {
    const [r, g, b] = css.match(/[\d.]+/g).map(Number).map(linear);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
  }).sort((a, b) => b - a);
  return light / dark;
}), [selector, name]);
