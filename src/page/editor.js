// The scenario as a form: everything that the scene shows, and what it cannot show, as fields and buttons.

import { by, el } from './dom.js';
import { withValue } from './draft.js';
import { Form } from './form.js';
import { axes, isGeodetic } from './frame.js';
import { say } from './notice.js';
import { faultText, threatName } from './words.js';

/** Of threats, and of the corners of each, so many are listed at a time. */
const PAGE = 20;
/** Of faults at most so many are listed. */
const MOST_FAULTS = 12;

const KINDS = { cylinder: 'Cylinder', polygon: 'Polygon' };

export class Editor {
  #shape = '';
  #page = 0;
  /** Which part of its corners each threat shows, where not the first. */
  #corners = new Map();
  /** Which parts that can be folded were open when the form was last built. */
  #open = new Set();
  #faults = [];
  #chosen = '';
  #menu = { scenarios: [], algorithms: [], terrains: [] };

  /** `acts` has `load(name)`, `open(file)` and `select(threat)`. */
  constructor(root, draft, acts) {
    this.root = root;
    this.draft = draft;
    this.acts = acts;
    this.form = new Form(root, draft);
    draft.addEventListener('change', ({ detail: { why } }) => {
      const isSame = why === 'edited' || why === 'stepped';
      if (!isSame) {
        this.#corners.clear();
        this.from('');
      }
      // What another document leaves open, the service has yet to say.
      this.show(isSame ? undefined : null);
    });
  }

  /** Which shipped scenario the draft began with; '' for none. */
  from(name) {
    this.#chosen = name;
    const choose = by('source');
    if (choose) choose.value = name;
  }

  /** What there is to choose from. */
  menu(menu) {
    this.#menu = { ...this.#menu, ...menu };
    this.#shape = '';
    this.show();
  }

  /** Which datasets there are to choose from. */
  datasets(names) {
    if (JSON.stringify(names) === JSON.stringify(this.#menu.terrains)) return;
    this.#menu.terrains = names;
    if (this.draft.document?.terrain?.kind !== 'dataset') return;
    const choose = this.root.querySelector('select[data-pointer="/terrain/name"]');
    // It may be unfolded, and is built anew only where it becomes another field.
    if (!choose || !names.length) this.menu({});
    else {
      choose.replaceChildren(...this.#datasets(this.draft.document).map(([value, text]) => el('option', { value }, text)));
      this.form.sync();
    }
  }

  /** The one that is chosen is among them, whether or not the service has it. */
  #datasets({ terrain: { name } }) {
    const { terrains } = this.#menu;
    return [...terrains.map((one) => [one, one]), ...(!name || terrains.includes(name) ? [] : [[name, `${name}, which is not there`]])];
  }

  show(defaults) {
    const document = this.draft.document;
    if (!document) return;
    const shape = JSON.stringify([
      document.frame, document.terrain?.kind, document.terrain?.peaks?.length, this.#page, [...this.#corners],
      (document.threats ?? []).map((threat) => [threat.kind, threat.vertices?.length]),
    ]);
    if (shape !== this.#shape) {
      this.#shape = shape;
      this.#build(document);
    }
    this.form.sync(defaults);
    for (const card of this.root.querySelectorAll('.threat')) {
      const index = Number(card.dataset.index);
      card.firstElementChild.setAttribute('aria-label', threatName(document.threats?.[index], index));
    }
    this.#title(document);
  }

  /** The service's faults; none where the document is right. */
  mark(faults) {
    if (faults.length !== this.#faults.length) {
      say(faults.length === 0 ? 'Nothing is left to mend.' : faults.length === 1 ? `One thing to mend: ${faultText(faults[0], this.draft.document)}` : `${faults.length} things to mend.`);
    }
    this.#faults = faults;
    this.form.mark(faults);
    const list = this.root.querySelector('.faults');
    if (!list) return;
    list.hidden = !faults.length;
    list.replaceChildren(
      el('h2', {}, faults.length === 1 ? 'One thing to mend' : `${faults.length} things to mend`),
      el('ul', {}, faults.slice(0, MOST_FAULTS).map((fault) =>
        el('li', {}, el('button', { type: 'button', class: 'link', onclick: () => this.goTo(fault.pointer) }, faultText(fault, this.draft.document)))),
      faults.length > MOST_FAULTS && el('li', {}, `and ${faults.length - MOST_FAULTS} more`)),
    );
  }

  /** Brings the field of a pointer into sight, and the pencil to it. */
  goTo(pointer) {
    const [, threat, corner] = pointer.match(/^\/threats\/(\d+)(?:\/vertices\/(\d+))?/) ?? [];
    if (threat) this.#turnTo(Number(threat));
    if (corner) this.#turnCorners(Number(threat), Math.floor(Number(corner) / PAGE));
    const input = this.form.nearest(pointer)?.input;
    if (!input) return;
    for (let node = input; node; node = node.parentElement) if (node.tagName === 'DETAILS') node.open = true;
    input.focus();
    input.scrollIntoView({ block: 'center' });
  }

  /** Shows which threat is in hand. */
  select(index) {
    if (index !== null) this.#turnTo(index);
    for (const card of this.root.querySelectorAll('.threat')) card.classList.toggle('chosen', Number(card.dataset.index) === index);
    // Where the form is no column that scrolls by itself, the scene would go out of sight.
    const column = this.root.parentElement;
    if (column.scrollHeight > column.clientHeight) this.root.querySelector('.threat.chosen')?.scrollIntoView({ block: 'nearest' });
  }

  #turnTo(index) {
    const page = Math.floor(index / PAGE);
    if (page === this.#page) return;
    this.#page = page;
    this.show();
  }

  #turnCorners(threat, page) {
    this.#corners.set(threat, page);
    this.show();
  }

  #title(document) {
    const note = this.root.querySelector('.frame-note');
    if (note) note.textContent = isGeodetic(document) ? `WGS 84, altitudes above ${document.altitude_datum === 'ellipsoid' ? 'the ellipsoid' : 'mean sea level'}` : 'metres, x east, y north, z up';
  }

  #build(document) {
    const focused = focusIn(this.root);
    this.#open = new Set([...this.root.querySelectorAll('details[open]')].map((details) => details.dataset.part));
    if (!this.root.childElementCount) this.#open.add('limits');
    this.form.forget(this.root);
    const section = (part, title, ...content) => el('details', { class: 'part', data: { part }, open: this.#open.has(part) }, el('summary', {}, title), ...content);
    this.root.replaceChildren(
      this.#source(),
      el('div', { class: 'faults', role: 'group', 'aria-label': 'Faults', hidden: true }),
      this.form.text('/name', 'Name'),
      this.#ends(document),
      this.#threats(document),
      section('limits', 'Altitude band', el('div', { class: 'grid two' },
        this.form.number('/altitude/min', 'Lowest above ground', 'm'), this.form.number('/altitude/max', 'Highest above ground', 'm'))),
      section('ground', 'Ground', ...this.#ground(document)),
      section('vehicle', 'Aircraft', el('div', { class: 'grid two' },
        this.form.number('/vehicle/max_turn_deg', 'Sharpest turn', '°'), this.form.number('/vehicle/max_climb_deg', 'Steepest climb', '°'),
        this.form.number('/vehicle/min_leg', 'Shortest leg', 'm'), this.form.number('/vehicle/cruise_speed', 'Cruise speed', 'm/s'),
        this.form.number('/vehicle/fuel_per_km', 'Fuel per km'))),
      section('weights', 'What counts', el('div', { class: 'grid three' },
        this.form.number('/weights/fuel', 'Fuel'), this.form.number('/weights/threat', 'Threats'), this.form.number('/weights/altitude', 'Altitude'))),
      section('planner', 'Search', ...this.#planner()),
      section('area', 'Area', this.#area(document)),
    );
    this.mark(this.#faults);
    focused?.();
  }

  #source() {
    const choose = el('select', { id: 'source', onchange: () => choose.value && this.acts.load(this.#chosen = choose.value) },
      el('option', { value: '' }, 'Choose…'),
      this.#menu.scenarios.map(({ name, title }) => el('option', { value: name }, title)));
    choose.value = this.#chosen;
    const file = el('input', { type: 'file', class: 'unseen', id: 'file', accept: '.json,.geojson,.kml,.plan,.txt,.air,.openair,.tif,.tiff,.asc,.hgt,.gz,application/json,application/geo+json,application/vnd.google-earth.kml+xml,text/plain',
      onchange: () => {
        if (file.files[0]) this.acts.open(file.files[0]);
        file.value = '';
      } });
    return el('div', { class: 'source' },
      el('div', { class: 'field' }, el('label', {}, el('span', { class: 'name' }, 'Start from'), choose)),
      // Its ring is drawn round what comes after it.
      file, el('label', { class: 'button', for: 'file' }, 'Open file…'),
      el('button', { type: 'button', id: 'empty', onclick: () => this.acts.blank(false) }, 'Empty'),
      el('button', { type: 'button', id: 'empty-in-degrees', onclick: () => this.acts.blank(true) }, 'Empty, in degrees'));
  }

  #ends(document) {
    const names = isGeodetic(document) ? ['Latitude °', 'Longitude °', 'Altitude m'] : ['East x m', 'North y m', 'Height z m'];
    const row = (end, title) => el('fieldset', {}, el('legend', {}, el('i', { class: `swatch ${end}` }), title), el('div', { class: 'grid three' },
      axes(document).map((axis, k) => this.form.number(`/${end}/${axis}`, ...label(names[k])))));
    return el('section', { 'aria-label': 'Start and target' }, row('start', 'Start'), row('target', 'Target'), el('p', { class: 'faint frame-note' }));
  }

  #threats(document) {
    const threats = document.threats ?? [];
    const part = partOf(threats.length, this.#page);
    this.#page = part.page;
    const turn = (page) => {
      this.#page = page;
      this.show();
    };
    return el('section', { class: 'threats', 'aria-labelledby': 'threats-head' },
      el('h2', { id: 'threats-head', tabindex: -1 }, 'Threats ', el('span', { class: 'faint' }, String(threats.length))),
      el('ol', { class: 'cards', start: part.first }, threats.slice(part.first, part.end).map((threat, k) => this.#threat(document, threat, part.first + k))),
      turner(part, turn, ['earlier', 'later']),
      el('p', { class: 'row' },
        el('button', { type: 'button', id: 'add-cylinder', onclick: () => this.#add('cylinder') }, 'Add a cylinder'),
        el('button', { type: 'button', id: 'add-polygon', onclick: () => this.#add('polygon') }, 'Add a polygon')));
  }

  #add(kind) {
    this.acts.add(kind);
    this.goTo(`/threats/${this.draft.document.threats.length - 1}/name`);
  }

  #threat(document, threat, index) {
    const pointer = `/threats/${index}`;
    const [first, second] = axes(document);
    const names = isGeodetic(document) ? ['Latitude °', 'Longitude °'] : ['East x m', 'North y m'];
    const limits = [this.form.number(`${pointer}/base`, 'Base', 'm', { empty: null }), this.form.number(`${pointer}/top`, 'Top', 'm', { empty: null })];
    const remove = el('button', { type: 'button', class: 'quiet', 'aria-label': `Remove ${threatName(threat, index)}`, title: 'Remove', onclick: () => {
      this.#corners.clear();
      this.draft.set(pointer, undefined);
      by('threats-head')?.scrollIntoView({ block: 'nearest' });
      (this.root.querySelector(`[data-index="${Math.min(index, this.draft.document.threats.length - 1)}"] .head button`) ?? by('add-cylinder')).focus();
    } }, '✕');
    const body = threat.kind === 'polygon'
      ? [
        el('div', { class: 'grid three' }, this.form.number(`${pointer}/margin`, 'Soft margin', 'm'), ...limits),
        this.#vertices(document, threat, index, names),
      ]
      : [el('div', { class: 'grid three' },
        this.form.number(`${pointer}/center/${first}`, ...label(names[0])), this.form.number(`${pointer}/center/${second}`, ...label(names[1])), limits[0],
        this.form.number(`${pointer}/radius`, 'Core radius', 'm'), this.form.number(`${pointer}/influence`, 'Soft radius', 'm'), limits[1])];
    return el('li', { class: 'threat', data: { index }, value: index, onfocusin: () => this.acts.select(index) },
      el('div', { class: 'parts', role: 'group' },
        el('div', { class: 'head' }, this.form.text(`${pointer}/name`, `${index}. ${KINDS[threat.kind] ?? 'Threat'}`, { empty: null }), remove), ...body));
  }

  #vertices(document, threat, index, names) {
    const pointer = `/threats/${index}/vertices`;
    const vertices = threat.vertices ?? [];
    const [first, second] = axes(document);
    const part = partOf(vertices.length, this.#corners.get(index) ?? 0);
    const row = (_, at) => {
      const k = part.first + at;
      return el('div', { class: 'grid pair' },
        this.form.number(`${pointer}/${k}/${first}`, `${k}: ${label(names[0])[0]}`, label(names[0])[1]),
        this.form.number(`${pointer}/${k}/${second}`, ...label(names[1])),
        el('button', { type: 'button', class: 'quiet', 'aria-label': `Remove corner ${k}`, onclick: () => this.draft.set(`${pointer}/${k}`, undefined) }, '✕'));
    };
    const name = `vertices ${index}`;
    return el('details', { class: 'inner', data: { part: name }, open: this.#open.has(name) }, el('summary', {}, `${vertices.length} corners`),
      vertices.slice(part.first, part.end).map(row),
      turner(part, (page) => this.#turnCorners(index, page), [`earlier-${index}`, `later-${index}`]),
      el('button', { type: 'button', onclick: () => {
        this.#corners.set(index, Math.floor(vertices.length / PAGE));
        this.acts.addCorner(index);
      } }, 'Add a corner'));
  }

  #ground(document) {
    const terrain = document.terrain ?? { kind: 'flat' };
    const kinds = [['flat', 'Flat'], ['peaks', 'Mountains, analytic'], ...(terrain.kind === 'grid' ? [['grid', 'Grid of elevations']] : []),
      // Only degrees say where on earth a dataset's ground is wanted.
      ...(isGeodetic(document) || terrain.kind === 'dataset' ? [['dataset', 'Dataset of the service']] : [])];
    const made = {
      flat: () => ({ kind: 'flat', elevation: 0 }),
      peaks: () => ({ kind: 'peaks', base: 0, peaks: [] }),
      dataset: () => ({ kind: 'dataset', name: this.#menu.terrains[0] ?? '' }),
      grid: () => terrain,
    };
    const kind = this.form.choice('/terrain', 'Kind', kinds, { fallback: 'flat', shown: (value) => value?.kind, chosen: (value) => made[value]() });
    const parts = {
      flat: () => [this.form.number('/terrain/elevation', 'Elevation', 'm')],
      grid: () => [el('p', { class: 'faint' }, `${terrain.columns} × ${terrain.rows} nodes, ${terrain.cell} m apart`)],
      dataset: () => [this.#menu.terrains.length
        ? this.form.choice('/terrain/name', 'Dataset', this.#datasets(document), {})
        : this.form.text('/terrain/name', 'Dataset')],
      peaks: () => [this.form.number('/terrain/base', 'Base', 'm'), ...(terrain.peaks ?? []).map((_, k) => this.#peak(document, k)),
        el('button', { type: 'button', onclick: () => this.acts.addPeak() }, 'Add a mountain')],
    };
    return [kind, ...(parts[terrain.kind]?.() ?? [])];
  }

  #peak(document, k) {
    const pointer = `/terrain/peaks/${k}`;
    const [first, second] = axes(document);
    return el('fieldset', { class: 'peak' }, el('legend', {}, `Mountain ${k} `,
      el('button', { type: 'button', class: 'quiet', 'aria-label': `Remove mountain ${k}`, onclick: () => this.draft.set(pointer, undefined) }, '✕')),
    el('div', { class: 'grid three' },
      this.form.number(`${pointer}/center/${first}`, first), this.form.number(`${pointer}/center/${second}`, second), this.form.number(`${pointer}/height`, 'Height', 'm'),
      this.form.number(`${pointer}/spread/x`, 'Spread east', 'm'), this.form.number(`${pointer}/spread/y`, 'Spread north', 'm')));
  }

  #planner() {
    const algorithms = this.#menu.algorithms.map(({ name, title }) => [name, `${name}: ${title}`]);
    return [
      this.form.choice('/planner/algorithm', 'Algorithm', algorithms.length ? algorithms : [['tms-sba', 'tms-sba']],
        { fallback: 'tms-sba', set: (name) => this.draft.edit((document) => this.#searchedBy(document, name)) }),
      el('div', { class: 'grid three' },
        this.form.number('/planner/waypoints', 'Waypoints'), this.form.number('/planner/population', 'Population'), this.form.number('/planner/iterations', 'Iterations'),
        this.form.number('/planner/seed', 'Seed', '', {}), this.form.number('/planner/time_limit_ms', 'Time limit', 'ms', { empty: null }),
        this.form.number('/planner/parameters/gap', 'Enough gap', 'share')),
      this.form.choice('/planner/seeding', 'First population', [['tangent', 'Along tangents of the threats'], ['random', 'Random, as published']], { fallback: 'tangent' }),
      this.form.tick('/planner/polish', 'Polish the best route', true),
    ];
  }

  /** The document with another algorithm: an accepted one lists the constants of its own, which others refuse. */
  #searchedBy(document, algorithm) {
    const constants = new Set(this.#menu.algorithms.flatMap(({ parameters }) => parameters.map(({ name }) => name)));
    const { parameters } = document.planner ?? {};
    const common = parameters && Object.fromEntries(Object.entries(parameters).filter(([name]) => !constants.has(name)));
    return withValue(withValue(document, '/planner/algorithm', algorithm), '/planner/parameters', common);
  }

  #area(document) {
    const [first, second] = axes(document);
    const names = isGeodetic(document) ? ['South', 'West', 'North', 'East'] : ['West x', 'South y', 'East x', 'North y'];
    return el('div', {}, el('p', { class: 'faint' }, 'Waypoints stay inside. Left open, a generous box.'), el('div', { class: 'grid two' },
      this.form.number(`/area/min/${first}`, names[0]), this.form.number(`/area/min/${second}`, names[1]),
      this.form.number(`/area/max/${first}`, names[2]), this.form.number(`/area/max/${second}`, names[3])));
  }
}

/** What is listed of so many: the part `page`, or the last one before it. */
function partOf(count, page) {
  const pages = Math.max(1, Math.ceil(count / PAGE));
  const shown = Math.min(page, pages - 1);
  return { page: shown, pages, first: shown * PAGE, end: Math.min((shown + 1) * PAGE, count) };
}

/** Buttons with these ids that turn to other parts of a list, where it has any. */
function turner({ page, pages, first, end }, turn, [earlier, later]) {
  const button = (id, text, to) => el('button', { type: 'button', id, disabled: to < 0 || to >= pages, onclick: () => turn(to) }, text);
  return pages > 1 && el('p', { class: 'row' }, button(earlier, 'Earlier', page - 1), el('span', { class: 'faint' }, `${first}–${end - 1}`), button(later, 'Later', page + 1));
}

/** What gives the focus back to a part that is built anew; null where it is elsewhere. */
function focusIn(root) {
  const node = document.activeElement;
  if (!root.contains(node)) return null;
  const card = node.closest('.threat');
  const [scope, name] = [card ? `[data-index="${card.dataset.index}"] ` : '', node.getAttribute('aria-label')];
  const selector = node.dataset.pointer ? `[data-pointer="${node.dataset.pointer}"]`
    : node.id ? `#${node.id}`
      : node.tagName === 'SUMMARY' ? `[data-part="${node.parentElement.dataset.part}"] > summary`
        : name ? `${scope}[aria-label="${CSS.escape(name)}"]` : null;
  const part = node.closest('details')?.dataset.part;
  return () => {
    const again = selector && root.querySelector(selector);
    if (again && !again.disabled) again.focus({ preventScroll: true });
    // What is gone, or can do no more, leaves it to what is nearest.
    else (root.querySelector(part ? `[data-part="${part}"] > summary` : '#threats-head') ?? root).focus();
  };
}

/** `Latitude °` as name and unit. */
function label(text) {
  const cut = text.lastIndexOf(' ');
  return [text.slice(0, cut), text.slice(cut + 1)];
}

