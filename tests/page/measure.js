// How fast the page draws, and what it keeps: the figures of docs/PAGE.md. Not a test, for a busy machine would fail it.
//
//     NOCTULE_BIN=target/release/noctule node tests/page/measure.js [frames] [leaks]

import http from 'node:http';
import { browser, drawn, open, scene, service, SMALL } from './support.js';

const asked = process.argv.slice(2);
const wanted = (name) => !asked.length || asked.includes(name);

/** 300 x 300 nodes, 200 threats. */
function wide() {
  const nodes = 300;
  const elevations = Array.from({ length: nodes * nodes }, (_, k) => {
    const [x, y] = [k % nodes, Math.floor(k / nodes)];
    return Math.round(150 + 60 * Math.sin(x / 17) * Math.cos(y / 23) + 40 * Math.sin(x / 5 + y / 9) + 30 * Math.cos(y / 4));
  });
  const threats = Array.from({ length: 200 }, (_, k) => ({
    kind: 'cylinder', name: `radar ${k}`, center: { x: 1500 + (k % 20) * 1400, y: 2500 + Math.floor(k / 20) * 2700 }, radius: 150 + 10 * (k % 7), influence: 320 + 10 * (k % 5),
  }));
  return {
    name: 'wide', start: { x: 500, y: 500, z: 320 }, target: { x: 29000, y: 29000, z: 320 }, threats,
    terrain: { kind: 'grid', origin: { x: 0, y: 0 }, cell: 100, columns: nodes, rows: nodes, elevations }, altitude: { min: 40, max: 400 },
    planner: { population: 40, iterations: 20, waypoints: 20, seed: 1 },
  };
}

const quantile = (values, share) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(share * values.length))];

/** The service, but for a plan's events: those are 20 incumbents a second, of 22 points each, for ten seconds. */
async function busy(url) {
  const { port } = new URL(url);
  const at = (k, n) => ({ x: 500 + (28500 * k) / 21, y: 500 + (28500 * k) / 21 + 900 * Math.sin(k + n / 6), z: 330 + 40 * Math.sin(k * 2 + n / 5) });
  const server = http.createServer((request, answer) => {
    if (!/^\/plans\/[^/]+\/events/.test(request.url)) {
      const { method, headers } = request;
      const on = http.request({ port, host: '127.0.0.1', path: request.url, method, headers }, (from) => {
        answer.writeHead(from.statusCode, from.headers);
        from.pipe(answer);
      });
      request.pipe(on);
      return;
    }
    answer.writeHead(200, { 'content-type': 'text/event-stream' });
    let n = 0;
    const tick = setInterval(() => {
      const incumbent = { iteration: n, elapsed_ms: n * 50, cost: 1000 - n, feasible: true, waypoints: Array.from({ length: 22 }, (_, k) => at(k, n)) };
      const point = { iteration: n, evaluations: n, elapsed_ms: n * 50, best_cost: 1000 - n, best_violation: 0, mean_cost: 1200 - n, feasible_fraction: 1 };
      answer.write(`id: ${2 * n + 1}\nevent: incumbent\ndata: ${JSON.stringify(incumbent)}\n\nid: ${2 * n + 2}\nevent: convergence\ndata: ${JSON.stringify(point)}\n\n`);
      n += 1;
      if (n === 200) clearInterval(tick);
    }, 50);
    request.on('close', () => clearInterval(tick));
  });
  await new Promise((done) => { server.listen(0, '127.0.0.1', done); });
  return { url: `http://127.0.0.1:${server.address().port}`, stop: () => server.closeAllConnections() };
}

async function frames(site, chrome) {
  const stage = await busy(site.url);
  const page = await open(chrome, stage.url);
  await drawn(page);
  await page.setInputFiles('#file', { name: 'wide.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(wide())) });
  await drawn(page, 200);
  await page.waitForTimeout(3000);
  await page.click('#plan');
  await page.waitForFunction(() => globalThis.noctule.scene().trail > 3);
  // Until the pixels are there: what is read back waits for all that was drawn.
  const spent = await page.evaluate(async () => {
    const gl = document.getElementById('canvas').getContext('webgl2');
    const pixel = new Uint8Array(4);
    const took = [];
    const end = performance.now() + 8000;
    let seen = globalThis.noctule.scene().frames.count;
    while (performance.now() < end) {
      await new Promise(requestAnimationFrame);
      const { count, ms } = globalThis.noctule.scene().frames;
      if (count === seen) continue;
      seen = count;
      const before = performance.now();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      took.push({ script: ms, whole: ms + performance.now() - before });
    }
    return took;
  });
  const size = await page.evaluate(() => `${document.getElementById('canvas').width} x ${document.getElementById('canvas').height}`);
  const [whole, script] = [spent.map((one) => one.whole), spent.map((one) => one.script)];
  console.log(`frames: ${spent.length} in 8 s at 20 incumbents/s, ${size} px: ${quantile(whole, 0.5).toFixed(1)} ms median, ${quantile(whole, 0.95).toFixed(1)} ms at 95 %; of that in script ${quantile(script, 0.5).toFixed(1)} ms`);
  await page.context().close();
  stage.stop();
}

async function leaks(site, chrome) {
  const page = await open(chrome, site.url);
  await drawn(page);
  await page.setInputFiles('#file', { name: 'small.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify({ ...SMALL, planner: { ...SMALL.planner, population: 10, iterations: 5 } })) });
  await drawn(page, 1);
  const client = await page.context().newCDPSession(page);
  const state = async () => {
    await client.send('HeapProfiler.collectGarbage');
    const { usedSize } = await client.send('Runtime.getHeapUsage');
    const { nodes, jsEventListeners } = await client.send('Memory.getDOMCounters');
    return { heap_MB: +(usedSize / 1e6).toFixed(2), nodes, jsEventListeners, ...(await scene(page)).memory };
  };
  for (let n = 1; n <= 500; n += 1) {
    await page.evaluate(() => document.querySelector('.verdict')?.classList.add('old'));
    await page.click('#plan');
    await page.waitForSelector('.verdict:not(.old)');
    if ([20, 100, 200, 300, 400, 500].includes(n)) console.log(`after ${n} plans: ${JSON.stringify(await state())}`);
  }
  await page.done();
}

const [site, chrome] = await Promise.all([service(), browser()]);
try {
  if (wanted('frames')) await frames(site, chrome);
  if (wanted('leaks')) await leaks(site, chrome);
} finally {
  await chrome.close();
  await site.stop();
}
