// Drawing speed and memory use of the page: the figures of docs/PAGE.md. Not a test, since it would fail on a busy
// machine.
//
//     NOCTULE_BIN=target/release/noctule node tests/page/measure.js [frames] [leaks]

import { readFileSync, readdirSync } from 'node:fs';
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

/** Processor seconds of the browser's processes so far. */
function processorTime() {
  const parents = new Map();
  const spent = new Map();
  for (const entry of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${entry}/stat`, 'utf8').split(') ')[1].split(' ');
      parents.set(Number(entry), Number(fields[1]));
      spent.set(Number(entry), Number(fields[11]) + Number(fields[12]));
    } catch {
      // The process has just ended.
    }
  }
  const ours = (pid) => pid === process.pid || (parents.has(pid) && ours(parents.get(pid)));
  let ticks = 0;
  for (const [pid, time] of spent) {
    const name = pid === process.pid ? '' : readFileSync(`/proc/${pid}/comm`, 'utf8');
    if (/^chrom/.test(name) && ours(pid)) ticks += time;
  }
  return ticks / 100;
}

/** The service, but with a plan's events replaced by `rate` incumbents a second of 22 points each. */
async function busy(url, rate) {
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
      const incumbent = { iteration: n, elapsed_ms: (n * 1000) / rate, cost: 1000 - n, feasible: true, waypoints: Array.from({ length: 22 }, (_, k) => at(k, n)) };
      const point = { iteration: n, evaluations: n, elapsed_ms: (n * 1000) / rate, best_cost: 1000 - n, best_violation: 0, mean_cost: 1200 - n, feasible_fraction: 1 };
      answer.write(`id: ${2 * n + 1}\nevent: incumbent\ndata: ${JSON.stringify(incumbent)}\n\nid: ${2 * n + 2}\nevent: convergence\ndata: ${JSON.stringify(point)}\n\n`);
      n += 1;
    }, 1000 / rate);
    request.on('close', () => clearInterval(tick));
  });
  await new Promise((done) => { server.listen(0, '127.0.0.1', done); });
  return { url: `http://127.0.0.1:${server.address().port}`, stop: () => { server.closeAllConnections(); server.close(); } };
}

/** Frames within five seconds while `act` is repeated, as text. */
async function drawing(page, act) {
  // Processor time beside elapsed time: it is the same on a shared machine.
  const from = { count: (await scene(page)).frames.count, cpu: processorTime(), at: performance.now() };
  while (performance.now() - from.at < 5000) await act();
  const { frames: { count, ms } } = await scene(page);
  const drawn_ = count - from.count;
  const [cpu, elapsed] = [1000 * (processorTime() - from.cpu), performance.now() - from.at];
  const size = await page.evaluate(() => `${document.getElementById('canvas').width} x ${document.getElementById('canvas').height} px`);
  return `${drawn_} frames in ${(elapsed / 1000).toFixed(1)} s, ${(elapsed / drawn_).toFixed(1)} ms by the clock and ${(cpu / drawn_).toFixed(1)} ms of processor time each (all processes of the browser), script ${ms.toFixed(1)} ms; ${size}`;
}

/** At 20 incumbents a second, at more than can be drawn, and while the camera turns. */
async function frames(site, chrome) {
  for (const rate of [20, 100]) {
    const stage = await busy(site.url, rate);
    const page = await open(chrome, stage.url);
    await drawn(page);
    await page.setInputFiles('#file', { name: 'wide.json', mimeType: 'application/json', buffer: Buffer.from(JSON.stringify(wide())) });
    await drawn(page, 200);
    await page.waitForTimeout(3000);
    await page.click('#plan');
    await page.waitForFunction(() => globalThis.noctule.scene().trail > 3);
    console.log(`${rate} incumbents/s: ${await drawing(page, () => page.waitForTimeout(100))}`);
    const box = await page.locator('#canvas').boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    let turn = 0;
    await page.mouse.move(x, y);
    await page.mouse.down();
    if (rate === 20) console.log(`and the camera turned: ${await drawing(page, () => page.mouse.move(x + 150 * Math.sin(turn += 0.1), y + 40 * Math.cos(turn)))}`);
    await page.mouse.up();
    await page.context().close();
    stage.stop();
  }
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
    // No handles are kept of awaited elements: they would keep the elements alive.
    await page.waitForFunction(() => document.querySelector('.verdict:not(.old)') !== null);
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
