// Connects the socket, the view, the hand and the panel.

import { Camera } from './camera.js';
import { Hand } from './hand.js';
import { Panel, shown } from './panel.js';
import { Plot } from './plots.js';
import { decode } from './surface.js';
import { View } from './view.js';

const at = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get('token') ?? '';
const state = { paused: false, hello: null, gravity: -9.81, updates: 0, drawn: 0, bar: { label: '', unit: '' } };
let socket = null, wait = 500, topology = null, news = null;

const camera = new Camera();
const view = new View(at('view'), camera);
const panel = new Panel(at('panel'), (path, value) => {
  send({ do: 'set', path, value });
  if (path === 'tools.strength') hand.setStrength(value);
});
const hand = new Hand(view, camera, send, (path) => panel.value(path));
const phases = new Plot(at('phases'), at('phase-names'), { stacked: true });
const energy = new Plot(at('energy'), at('energy-names'));

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

const ask = (what, more = {}) => send({ ask: what, ...more });

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(token)}`);
  socket.binaryType = 'arraybuffer';
  socket.onopen = () => {
    wait = 500;
    at('lost').classList.remove('on');
  };
  socket.onclose = () => {
    at('lost').textContent = 'no connection: trying again';
    at('lost').classList.add('on');
    setTimeout(connect, wait);
    wait = Math.min(2 * wait, 5000);
  };
  socket.onmessage = ({ data }) => {
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      told[message.type]?.(message);
      return;
    }
    const found = decode(data);
    if (found.topology) {
      if (news) send({ drawn: news.number }); // of a surface that is gone: nobody will see it
      [topology, news] = [found.topology, null];
    } else if (found.update.version === topology?.version) news = found.update;
  };
}

const told = {
  hello(message) {
    at('name').textContent = document.title = message.name;
    view.extent = message.extent;
    view.setMap(message.map);
    at('bar-colors').style.background = `linear-gradient(to top, ${message.map.join(', ')})`;
    if (!state.hello) {
      camera.set(message.camera);
      camera.zoom(1.2); // the panels take some of the room
    }
    state.hello = message;
  },
  panel({ groups }) {
    panel.show(groups);
    document.querySelector('[data-tool=throw]').hidden = panel.value('tools.ball_radius') === undefined;
    view.wire = panel.value('view.wire');
    view.stale = true;
    const down = panel.value('simulation.gravity.z');
    if (down !== 0) state.gravity = down;
    at('weightless').classList.toggle('on', down !== 0);
  },
  state(message) {
    Object.assign(state, message);
    const button = (name) => document.querySelector(`[data-ask=${name}]`);
    button('pause').classList.toggle('on', message.paused);
    button('play').classList.toggle('on', !message.paused);
    button('back').disabled = !message.kept;
    at('record').textContent = message.film ? 'stop recording' : 'record';
    at('record').classList.toggle('on', !!message.film);
  },
  figures(figures) {
    state.figures = figures;
    const speed = state.paused ? 'paused' : `${figures.factor.toFixed(2)} x real time`;
    at('clock').textContent = `t = ${figures.time.toFixed(2)} s, ${speed}`;
    const pieces = `${figures.pieces} piece${figures.pieces === 1 ? '' : 's'}`;
    at('counts').textContent = `${figures.nodes.toLocaleString()} nodes, ${figures.elements.toLocaleString()} ${state.hello?.elements ?? ''}, ${pieces}`;
    const solver = figures.iterations ? `, ${figures.iterations} iterations${figures.converged ? '' : ' (cap hit)'}` : '';
    at('solver').textContent = `${figures.ms.toFixed(1)} ms a step of ${shown(1e3 * figures.dt)} ms${solver}`;
    at('stress').textContent = `largest stress ${shown(figures.stress)} Pa`;
    phases.add(figures.phases);
    energy.add(figures.energy);
  },
  bar(message) {
    state.bar = message;
    at('bar').classList.toggle('on', message.label !== '');
    at('bar-label').textContent = message.label;
  },
  mark(message) {
    state.mark = message;
  },
  hands({ names }) {
    hand.names = names;
  },
  command({ text }) {
    navigator.clipboard?.writeText(text).catch(() => {});
    told.notice({ text, level: 'info' });
  },
  notice({ text, level }) {
    const entry = Object.assign(document.createElement('div'), { textContent: text, className: level });
    at('notices').append(entry);
    while (at('notices').children.length > 4) at('notices').firstChild.remove();
    setTimeout(() => entry.remove(), 20000);
  },
};

function frame() {
  if (news) {
    if (view.topology !== topology) view.setTopology(topology);
    view.setUpdate(news);
    const held = [];
    for (let k = 0; k < news.hands.length; k += 8) if (!news.hands[k + 7]) held.push(`${shown(Number(news.hands[k + 6].toPrecision(3)))} N`);
    at('pulled').textContent = held.length ? `pulls with ${held.join(', ')}` : '';
    at('bar-high').textContent = `${shown(Number(news.high.toPrecision(3)))} ${state.bar.unit}`;
    at('bar-low').textContent = `${shown(news.low)} ${state.bar.unit}`;
    state.updates += 1;
    send({ drawn: news.number });
    news = null;
    view.stale = true;
  }
  if (view.stale || camera.stale || view.resized) {
    view.draw();
    view.stale = camera.stale = false;
    state.drawn += 1;
  }
  requestAnimationFrame(frame);
}

// What a recording shows follows the camera.
setInterval(() => {
  if (!camera.moved) return;
  camera.moved = false;
  ask('camera', { eye: camera.eye, target: camera.target, fov: camera.fov });
}, 200);

const press = {
  ' ': () => ask(state.paused ? 'play' : 'pause'),
  s: () => ask('step'), r: () => ask('reset'), k: () => ask('keep'), b: () => ask('back'),
  g: () => at('weightless').click(),
};
'pull pin poke throw look'.split(' ').forEach((tool, k) => { press[k + 1] = () => choose(tool); });

function choose(tool) {
  if (document.querySelector(`[data-tool=${tool}]`).hidden) return; // the scene's bodies meet no ball
  hand.tool = tool;
  document.querySelectorAll('[data-tool]').forEach((b) => b.classList.toggle('on', b.dataset.tool === tool));
}

document.querySelectorAll('[data-ask]').forEach((button) => {
  const what = button.dataset.ask;
  button.onclick = () => what === 'reset-all' ? ask('reset', { all: true }) : ask(what);
});
document.querySelectorAll('[data-tool]').forEach((button) => { button.onclick = () => choose(button.dataset.tool); });
at('weightless').onclick = () => {
  const down = panel.value('simulation.gravity.z');
  send({ do: 'set', path: 'simulation.gravity.z', value: down === 0 ? state.gravity : 0 });
};
document.addEventListener('keydown', (event) => {
  if (event.target.matches('input[type=text], select') || event.ctrlKey || event.metaKey || event.altKey) return;
  if (press[event.key]) {
    press[event.key]();
    event.preventDefault();
  }
});

window.taichifem = { ask, state, view, camera, panel, hand };
choose('pull');
connect();
requestAnimationFrame(frame);
