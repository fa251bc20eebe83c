// The page put together: what is chosen, planned, looked at, compared and taken away.

import { Refused, Said, UNREACHABLE, ask, onKeyNeeded } from './api.js';
import { Again } from './again.js';
import { cameraOf } from './camera.js';
import { Chart } from './chart.js';
import { checkAsItChanges } from './check.js';
import { offerDatasets } from './datasets.js';
import { atMost, by } from './dom.js';
import { Draft } from './draft.js';
import { onDrop } from './dropped.js';
import { Editor } from './editor.js';
import { showFigures, showNone, verdict } from './figures.js';
import { Followed } from './followed.js';
import { isGeodetic } from './frame.js';
import { readFile } from './import.js';
import { askForKey } from './key.js';
import { keepOrder } from './narrow.js';
import { EMPTY, additions, emptyInDegrees } from './new.js';
import { attempt, hold, over, say, tell, untell } from './notice.js';
import { OTHERS, onSchemeChange, palette } from './palette.js';
import { Plans } from './plans.js';
import { onPrint } from './print.js';
import { showResult } from './result.js';
import { copyLink, fileName, saveBlob, saveFrom } from './save.js';
import { World } from './scene.js';
import { Stage } from './stage.js';
import { begunWith, nameShown, named, onStep, stepFrom } from './steps.js';
import { Strip } from './strip.js';
import { turn } from './tabs.js';
import { Tools } from './tools.js';
import { offerUndo } from './undo.js';
import { guard, isKept, keep } from './unsaved.js';
import { asGround } from './upload.js';
import { faultText, placeText } from './words.js';

const draft = new Draft();
let busy = false;
/** The document that the plan in front was made of. */
let planned = null;
/** Counts what was asked to be shown: an answer that comes after the next question is for nobody. */
let wishes = 0;
/** The scenario to begin with. */
let first = null;

onKeyNeeded(askForKey);
keepOrder();

// -- The parts -------------------------------------------------------------------------------------

let world = null;
try {
  world = new World(by('canvas'), by('labels'));
} catch {
  by('scene').classList.add('blind');
  by('canvas').setAttribute('aria-label', 'This browser draws no 3-D scene; tables and strip have everything.');
  by('hint').textContent = 'This browser has no WebGL, so there is no scene. The form, the strip and the tables have everything.';
  by('hint').hidden = false;
}
const strip = new Strip(by('strip'), by('strip-what'), (distance) => stage.mark(distance));
const chart = new Chart(by('chart'), by('legend'), (iteration) => stage.scrub(iteration));
const stage = new Stage({ world, strip, chart, draft }, {
  selected: (index) => editor.select(index),
  legMarked: (k) => {
    for (const row of document.querySelectorAll('.legs tr.marked')) row.classList.remove('marked');
    if (k !== null) document.querySelector(`.legs tr[data-leg="${k}"]`)?.classList.add('marked');
  },
  marked: (place) => {
    by('strip-at').textContent = place ? placeText(place) : '';
  },
});
const again = new Again(by('watch'), (iteration, trail) => {
  stage.scrub(iteration, trail);
  chart.mark(iteration);
});
const editor = new Editor(by('scenario'), draft, {
  load: (name) => attempt(() => load(name)),
  open: (file) => attempt(() => openFile(file)),
  blank: (inDegrees) => anew(inDegrees ? emptyInDegrees(draft.document, stage.frame) : EMPTY),
  select: (index) => stage.selected !== index && stage.select(index),
  ...additions(draft, stage),
});
const datasets = offerDatasets(editor);
const plans = new Plans(by('plans'), {
  open: (status) => attempt(() => open(status.id)),
  compare: (status, yes) => attempt(() => compare(status.id, yes, status.name)),
  removed: (id) => {
    if (stage.plan?.id === id) show(null);
    lift(id);
  },
}, () => ({ shown: stage.plan?.id ?? null, compared: new Map([...stage.compared].map(([id, other]) => [id, other.color])) }));

// -- The scenario ----------------------------------------------------------------------------------

async function load(scenario, step = true) {
  wishes += 1;
  const wish = wishes;
  const document_ = await ask(`/scenarios/${encodeURIComponent(scenario)}`);
  if (wish !== wishes) return;
  if (step) stepFrom(draft.document, scenario);
  begin(document_);
  editor.from(scenario);
}

function anew(document_) {
  wishes += 1;
  stepFrom(draft.document);
  begin(document_);
}

function begin(document_, plan = null, kept = true) {
  // What was laid over one scenario says nothing of another.
  if (!plan) clearCompared();
  show(plan);
  draft.replace({ ...document_, planner: { ...document_.planner, warm_start: undefined } });
  if (kept) keep(draft.document);
  planned = plan ? draft.document : null;
  by('stale').hidden = true;
}

async function openFile(file) {
  if (await asGround(file, draft, { datasets, begin: anew })) return;
  wishes += 1;
  const wish = wishes;
  const { document: read, note, area } = await readFile(file, draft.document ?? {});
  if (wish !== wishes) return;
  stepFrom(draft.document);
  begin(read);
  if (note) tell(note, 'note', area && ['Take the area of the map', () => { draft.set('/area', area); tell('The area is that of the map.', 'note'); }]);
}

checkAsItChanges(draft, editor, stage);
guard(draft);
draft.addEventListener('change', () => {
  by('plan').disabled = false;
  by('stale').hidden = !stage.plan || draft.document === planned;
  by('title').textContent = draft.document.name ?? '';
  document.title = draft.document.name ? `${draft.document.name} · Noctule` : 'Noctule';
});

// -- Planning --------------------------------------------------------------------------------------

async function submit(warm) {
  if (busy || !draft.document) return;
  occupied(true);
  wishes += 1;
  const wish = wishes;
  try {
    const planner = { ...draft.document.planner, ...(warm ? { warm_start: { plan_id: stage.plan.id } } : {}) };
    const before = stage.plan;
    const sent = draft.document;
    const status = await ask('/plans', { method: 'POST', body: { ...draft.document, planner } });
    keep(sent);
    if (wish !== wishes) {
      inList(`“${status.name ?? 'The plan'}” is being planned`);
      return;
    }
    if (warm && before) layUnder(before);
    const plan = new Followed(status.id, { status });
    if (before) stepFrom(sent);
    show(plan);
    planned = sent;
    by('stale').hidden = draft.document === sent;
    if (before && !before.ended && !before.lostBecause) inList(`“${before.status?.name ?? 'The plan before'}” goes on`);
    await plan.open();
    if (!by('plans').hidden) plans.look();
  } catch (error) {
    const faults = error.problem?.errors;
    if (!faults) throw error;
    const before = faults.find(({ pointer }) => pointer.startsWith('/planner/warm_start'));
    if (before) throw new Said(`There is no route to begin with: ${before.detail}. Plan begins without one.`);
    turn('scenario');
    editor.mark(faults);
    editor.goTo(faults[0].pointer);
    throw new Said(`This cannot be planned yet: ${faults.length === 1 ? 'one thing is' : `${faults.length} things are`} to mend. ${faultText(faults[0], draft.document)}`);
  } finally {
    occupied(false);
  }
}

/** Not `disabled`, for a button that is loses the focus. */
function occupied(yes) {
  busy = yes;
  for (const id of ['plan', 'replan']) by(id).setAttribute('aria-disabled', String(yes));
}

/** Tells of a plan that is not on show. */
function inList(what) {
  tell(`${what}, and is in the list of plans.`, 'note', ['Show the list', () => turn('plans')]);
}

/** Puts a plan in front, or none. */
function show(plan) {
  const before = stage.plan;
  if (before && before !== plan && !stage.compared.has(before.id)) before.close();
  if (plan && stage.compared.delete(plan.id)) plans.mark();
  plan?.forward();
  stage.front(plan);
  again.offer(plan);
  plan?.addEventListener('news', ({ detail }) => plan === stage.plan && heard(plan, detail));
  over(LOST);
  if (plan) for (const what of ['status', 'search']) heard(plan, what);
  else {
    by('stale').hidden = true;
    showNone();
    showResult(by('result'), {}, {});
  }
  remember();
}

const LOST = 'The connection is lost. It is being resumed; nothing will be missed.';
/** The plan whose search was said to run. */
let running = null;

function heard(plan, what) {
  if (what === 'incumbent' || what === 'ground') stage.redraw();
  if (what === 'search' || what === 'end') stage.drawSearch();
  if (what === 'end') {
    stage.world?.past(null);
    stage.redraw();
    say(verdict(plan));
  }
  if (what === 'end' || what === 'status') result(plan);
  if (what === 'end' || what === 'history') again.offer(plan);
  if (what === 'connection') {
    const lost = !plan.connected && !plan.lostBecause;
    if (lost) hold(LOST, 'note');
    else over(LOST);
    if (plan.lostBecause) tell(plan.lostBecause, 'note');
    if (plan.connected) {
      untell(UNREACHABLE);
      say('Connected again.');
    }
  }
  if (what === 'status' && plan.status?.status === 'running' && running !== plan) {
    running = plan;
    say('The search is running.');
  }
  if (['incumbent', 'search'].includes(what)) soon();
  else showFigures(plan);
}

const soon = atMost(100, () => stage.plan && showFigures(stage.plan));

function result(plan) {
  showResult(by('result'), { result: plan.result, scenario: plan.scenario, status: plan.ended ? plan.status : null, refusal: plan.refusal, geodetic: isGeodetic(plan.scenario) }, {
    markLeg: (k) => stage.markLeg(k),
    place: (violation) => stage.place(violation),
    save: (format) => attempt(() => saveFrom(`/plans/${plan.id}/result?format=${format.name}`, fileName(plan, 'result', format.file), format.name === 'json')),
    saveScenario: () => attempt(() => saveFrom(`/plans/${plan.id}/scenario`, fileName(plan, 'scenario', 'json'))),
    savePicture: world && (() => attempt(async () => saveBlob(await world.picture(), fileName(plan, 'view', 'png')))),
    copyLink: () => attempt(async () => {
      remember();
      tell(await copyLink(), 'note');
    }),
  });
}

// -- Comparing -------------------------------------------------------------------------------------

const BEFORE = 'before: ';

function lay(plan, name) {
  const colours = palette();
  const taken = new Set([...stage.compared.values()].map((other) => other.slot));
  const slot = [...Array(OTHERS).keys()].find((at) => !taken.has(at)) ?? 0;
  stage.compared.set(plan.id, { plan, name, slot, color: colours[`other-${slot}`] });
  stage.redraw();
  stage.drawSearch();
  remember();
}

/** A route from before, under the one that comes of it: in place of the oldest such where no more can be laid over. */
function layUnder(plan) {
  const laid = [...stage.compared];
  if (laid.length >= OTHERS) lift((laid.find(([, { name }]) => name.startsWith(BEFORE)) ?? laid[0])[0]);
  lay(plan, `${BEFORE}${plan.status.name ?? plan.id.slice(0, 8)}`);
}

function clearCompared() {
  for (const { plan } of stage.compared.values()) if (plan !== stage.plan) plan.close();
  stage.compared.clear();
  plans.mark();
}

// Light and dark have colours of their own.
onSchemeChange(() => {
  const colours = palette();
  for (const other of stage.compared.values()) other.color = colours[`other-${other.slot}`];
  plans.mark();
  stage.redraw();
  stage.drawSearch();
});

/** Takes away what is laid over. */
function lift(id) {
  stage.compared.get(id)?.plan.close();
  if (!stage.compared.delete(id)) return;
  stage.redraw();
  stage.drawSearch();
  plans.mark();
  remember();
}

async function compare(id, yes, name) {
  if (!yes) {
    lift(id);
    return;
  }
  if (stage.compared.has(id)) return;
  if (stage.compared.size === OTHERS) throw new Said(`At most ${OTHERS} plans can be laid over one.`);
  const plan = new Followed(id, { aside: true });
  plan.addEventListener('news', () => {
    stage.redraw();
    stage.drawSearch();
  });
  // Before it has opened, so that it can be taken away, and is not laid over twice.
  lay(plan, name || id.slice(0, 8));
  plans.mark();
  const laid = () => stage.compared.get(id)?.plan === plan;
  try {
    await plan.open();
  } catch (refusal) {
    if (!laid()) return;
    lift(id);
    throw refusal;
  }
  if (!laid() || (name && name !== stage.plan?.status?.name)) return;
  const { algorithm, seed } = plan.status;
  stage.compared.get(id).name = `${algorithm}, seed ${seed}`;
  stage.drawSearch();
}

/** Returns whether it is what is wanted still. */
async function open(id, step = true) {
  wishes += 1;
  const wish = wishes;
  const before = draft.document;
  const plan = stage.compared.get(id)?.plan ?? new Followed(id);
  try {
    await plan.open();
  } catch (refusal) {
    if (wish === wishes) throw refusal;
  }
  if (wish !== wishes) {
    if (plan !== stage.plan && !stage.compared.has(id)) plan.close();
    return false;
  }
  const edited = draft.document !== before;
  if (step) stepFrom(draft.document);
  begin(plan.scenario, plan);
  plans.mark();
  if (edited) tell('The scenario of the plan has replaced what was changed meanwhile; Undo brings that back.', 'note');
  return true;
}

// -- The address -----------------------------------------------------------------------------------

function remember() { nameShown(stage.plan?.id, [...stage.compared.keys()]); }

async function recall({ id, others }, step) {
  if (!(await open(id, step))) return;
  const wish = wishes;
  const missing = [];
  for (const other of others) {
    if (wish !== wishes) return;
    await compare(other, true).catch((refusal) => missing.push(refusal.message));
  }
  if (missing.length) tell(`Not all plans are laid over this one: ${missing.join('; ')}.`, 'note');
}

onStep(() => draft.document, ({ hash, own, draft: before }) => attempt(async () => {
  const wanted = named(hash);
  if (wanted) await recall(wanted, false).finally(remember);
  else if (!own) {
    remember();
    if (hash) tell('That address names no plan; what was shown stays.', 'note');
  } else if (before) {
    wishes += 1;
    begin(before, null, isKept(before));
    if (isKept(before)) editor.from(begunWith());
  } else await load(begunWith() || first, false);
}));

// -- Buttons, tabs, keys, files --------------------------------------------------------------------

by('plan').addEventListener('click', () => attempt(() => submit(false)));
by('replan').addEventListener('click', () => attempt(() => submit(true)));
by('cancel').addEventListener('click', () => stage.plan.status?.cancel_requested || attempt(() => stage.plan.cancel()));
const showUndo = offerUndo(draft, () => stage.tools);

by('plans').addEventListener('turned', () => plans.look(true));
onDrop((file) => attempt(() => openFile(file)));
onPrint(world);

if (world) {
  stage.tools = new Tools({ bar: by('tools'), hint: by('hint'), world, draft, stage, pointed: (pixel) => stage.pointAt(pixel), changed: showUndo });
  stage.exaggerate = cameraOf(world);
  world.lapsed = (yes) => stage.tools.say(yes ? 'The browser has let go of the scene, and draws it again as soon as it can. Form, strip and tables have everything.' : null);
}

// What is shown, for tests and for the curious: to look at, not to change.
Object.defineProperty(globalThis, 'noctule', {
  value: Object.freeze({
    scene: () => world?.inventory() ?? null,
    onScreen: (place) => world?.onScreen(place) ?? null,
    toMetres: (position) => stage.frame?.to(position) ?? null,
    groundAt: (x, y) => stage.ground.at(x, y),
    routeAt: (share) => {
      const way = stage.plan && stage.wayOf(stage.plan);
      return way ? way.at(way.length * share) : null;
    },
    history: () => ({ points: stage.plan?.points.length ?? 0, incumbents: stage.plan?.incumbents.length ?? 0 }),
    document: () => structuredClone(draft.document),
  }),
});

const asked = location.hash;

/** Shows what the address names, or else a scenario. */
async function start() {
  const untouched = wishes;
  try {
    tell('');
    by('figures').replaceChildren('Loading…');
    const [{ scenarios }, { algorithms }] = await Promise.all([ask('/scenarios'), ask('/algorithms')]);
    first = scenarios[0].name;
    editor.menu({ scenarios, algorithms });
    // A file may have been dropped meanwhile.
    if (wishes !== untouched) return;
    const wanted = named(asked);
    const before = scenarios.find((one) => one.name === begunWith()) ?? scenarios[0];
    const refusal = wanted && await recall(wanted, false).catch((error) => error);
    if (refusal && !(refusal instanceof Refused)) throw refusal;
    if (!wanted || refusal) await load(before.name, false);
    if (refusal) tell(`That plan cannot be opened: ${refusal.message}`, 'bad', refusal.status === 401 ? ['Try again', () => attempt(() => recall(wanted))] : null);
    else if (asked.length > 1 && !wanted) tell('The address names no plan, so a scenario is shown.', 'note');
  } catch (error) {
    by('figures').replaceChildren('Nothing could be loaded.');
    tell(`The page cannot begin. ${error.message}`, 'bad', ['Try again', start]);
    if (!(error instanceof Said)) console.warn(error);
  }
}

showNone();
stage.drawSearch();
await start();
datasets();
