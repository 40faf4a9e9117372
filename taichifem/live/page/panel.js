// The parameters: a group for each material and section, a row for each parameter, as the server lists them.

const STEPS = 1000, DECADES = 6;

// Where on its slider (0 to STEPS) a value is, and the other way round.
function toSlider({ low, high, log }, value) {
  if (value === null) return STEPS;
  if (!log) return STEPS * (value - low) / (high - low);
  if (low > 0) return STEPS * Math.log(Math.max(value, low) / low) / Math.log(high / low);
  return value <= 0 ? 0 : Math.max(1, STEPS * (1 + Math.log10(value / high) / DECADES));
}

function fromSlider({ low, high, log, whole }, at) {
  let value = low + (high - low) * at / STEPS;
  if (log && low > 0) value = low * (high / low) ** (at / STEPS);
  if (log && low === 0) value = at === 0 ? 0 : high * 10 ** (DECADES * (at / STEPS - 1));
  return whole ? Math.round(value) : Number(value.toPrecision(3));
}

export function shown(value) {
  if (value === null) return '';
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e5 || size < 1e-3)) return value.toExponential(2).replace(/\.?0+e/, 'e').replace('e+', 'e');
  return String(Number(value.toPrecision(4)));
}

export class Panel {
  // set: called with a path and a value that a person has chosen.
  constructor(place, set) {
    Object.assign(this, { place, set, rows: new Map(), shape: '' });
  }

  value(path) {
    return this.rows.get(path)?.row.value;
  }

  show(groups) {
    const shape = JSON.stringify(groups.map((g) => [g.title, g.rows.map((r) => r.path)]));
    if (shape !== this.shape) this.build(groups);
    this.shape = shape;
    for (const { rows } of groups) for (const row of rows) this.rows.get(row.path).put(row);
  }

  build(groups) {
    const closed = new Set([...this.place.querySelectorAll('details:not([open])')].map((d) => d.dataset.title));
    this.rows.clear();
    this.place.replaceChildren(...groups.map(({ title, rows }) => {
      const group = element('details', { open: !closed.has(title) });
      group.dataset.title = title;
      group.append(element('summary', { textContent: title }), ...rows.map((row) => this.line(row)));
      return group;
    }));
  }

  line(row) {
    const line = element('div', { className: 'row' });
    line.append(element('label', { textContent: row.label, title: row.path }));
    const make = { choice: choice, switch: toggle, number: number }[row.kind];
    const put = make(line, row, (value) => {
      this.rows.get(row.path).row.value = value;
      this.set(row.path, value);
    });
    this.rows.set(row.path, { row, put: (next) => { this.rows.get(row.path).row = next; put(next.value); } });
    return line;
  }
}

function element(name, properties) {
  return Object.assign(document.createElement(name), properties);
}

function choice(line, row, set) {
  const menu = element('select', { onchange: () => set(menu.value) });
  menu.dataset.path = row.path;
  menu.append(...row.choices.map((name) => element('option', { value: name, textContent: name })));
  line.append(menu);
  return (value) => { menu.value = value; };
}

function toggle(line, row, set) {
  const box = element('input', { type: 'checkbox', onchange: () => set(box.checked) });
  box.dataset.path = row.path;
  line.append(box);
  return (value) => { box.checked = value; };
}

function number(line, row, set) {
  const slider = element('input', { type: 'range', min: 0, max: STEPS, step: 1 });
  const field = element('input', { type: 'text', inputMode: 'decimal', placeholder: row.none ?? '' });
  slider.dataset.path = field.dataset.path = row.path;
  let held = false;
  slider.onpointerdown = () => { held = true; };
  slider.onpointerup = slider.onpointercancel = () => { held = false; };
  slider.oninput = () => {
    const value = fromSlider(row, Number(slider.value));
    field.value = shown(value);
    set(value);
  };
  field.onchange = () => {
    const value = field.value.trim() === '' && row.optional ? null : Number(field.value);
    field.classList.toggle('wrong', Number.isNaN(value));
    if (!Number.isNaN(value)) set(value);
  };
  field.onkeydown = (event) => { if (event.key === 'Enter') field.blur(); };
  line.append(slider, field, element('span', { textContent: row.unit, title: row.unit }));
  return (value) => {
    if (!held) slider.value = toSlider(row, value);
    if (document.activeElement !== field && !held) field.value = shown(value);
  };
}
