// The mouse: takes hold, pins, pokes, throws, and moves the camera.

import { add, dot, length, scale, sub } from './algebra.js';
import { pick } from './surface.js';

export class Hand {
  // send: takes a message for the server.  value: gives that of a parameter.
  constructor(view, camera, send, value) {
    Object.assign(this, { view, camera, send, value, tool: 'pull', held: null, drag: null, pins: [] });
    this.names = [];
    this.id = Math.random().toString(36).slice(2, 8);
    this.count = 0;
    const { canvas } = view;
    canvas.onpointerdown = (event) => this.press(event);
    canvas.onpointermove = (event) => this.move(event);
    canvas.onpointerup = canvas.onpointercancel = (event) => this.let(event);
    canvas.oncontextmenu = (event) => event.preventDefault();
    canvas.onwheel = (event) => {
      event.preventDefault();
      camera.zoom(Math.exp(0.0012 * Math.max(-200, Math.min(200, event.deltaY))));
    };
  }

  ray(event) {
    const { canvas, aspect } = this.view;
    const x = 2 * event.clientX / canvas.clientWidth - 1, y = 1 - 2 * event.clientY / canvas.clientHeight;
    return this.camera.ray(x, y, aspect);
  }

  press(event) {
    const { view, camera } = this;
    view.canvas.setPointerCapture(event.pointerId);
    view.canvas.focus();
    view.canvas.classList.add('busy');
    this.drag = { x: event.clientX, y: event.clientY, pan: event.button !== 0 || event.ctrlKey };
    if (this.drag.pan || this.tool === 'look' || !view.update) return;
    const ray = this.ray(event);
    if (this.tool === 'pin' && this.unpin(ray)) return;
    const hit = pick(view.topology, view.update.points, ray);
    if (this.tool === 'throw') this.throwBall(ray, hit);
    if (!hit) return;
    const radius = this.value('tools.radius');
    if (this.tool === 'poke') {
      this.send({ do: 'poke', node: hit.node, impulse: scale(ray.along, this.value('tools.impulse')), radius });
      this.drag = null;
    } else if (this.tool === 'pin') {
      this.send({ do: 'pin', hand: this.name(), node: hit.node, radius });
      this.drag = null;
    } else if (this.tool === 'pull') {
      const hand = this.name();
      this.send({ do: 'grab', hand, node: hit.node, stiffness: this.value('tools.strength'), radius });
      this.held = { hand, from: hit.point, depth: dot(sub(hit.point, camera.eye), camera.axes.forward) };
    }
  }

  name() {
    this.count += 1;
    return `${this.id}-${this.count}`;
  }

  // The ball starts in front of what it is thrown at, well before the camera.
  throwBall(ray, hit) {
    const radius = this.value('tools.ball_radius');
    const reach = hit ? hit.distance : length(sub(this.camera.target, ray.from));
    const away = Math.min(0.8 * reach, Math.max(5 * radius, 0.6 * this.view.extent));
    const origin = add(ray.from, scale(ray.along, reach - away));
    this.send({ do: 'throw', origin, velocity: scale(ray.along, this.value('tools.ball_speed')), radius });
    this.drag = null;
  }

  // Take out the pin under the mouse, if there is one.
  unpin({ from, along }) {
    const { hands } = this.view.update;
    const size = 0.02 * length(sub(this.camera.eye, this.camera.target));
    for (let k = 0; k < this.names.length && 8 * k < hands.length; k++) {
      const arm = sub([hands[8 * k], hands[8 * k + 1], hands[8 * k + 2]], from);
      if (hands[8 * k + 7] && length(sub(arm, scale(along, dot(arm, along)))) < size) {
        this.send({ do: 'release', hand: this.names[k] });
        this.drag = null;
        return true;
      }
    }
    return false;
  }

  move(event) {
    if (this.held) {
      const { eye, axes } = this.camera, { along } = this.ray(event);
      const here = add(eye, scale(along, this.held.depth / dot(along, axes.forward)));
      this.send({ do: 'drag', hand: this.held.hand, offset: sub(here, this.held.from) });
    } else if (this.drag) {
      const { canvas } = this.view, x = event.clientX - this.drag.x, y = event.clientY - this.drag.y;
      if (this.drag.pan) this.camera.pan(x / canvas.clientHeight, y / canvas.clientHeight);
      else this.camera.orbit(0.006 * x, 0.006 * y);
      Object.assign(this.drag, { x: event.clientX, y: event.clientY });
    }
  }

  let() {
    if (this.held) this.send({ do: 'release', hand: this.held.hand });
    this.held = this.drag = null;
    this.view.canvas.classList.remove('busy');
  }

  // The spring of what is held now follows its slider.
  setStrength(stiffness) {
    if (this.held) this.send({ do: 'strength', hand: this.held.hand, stiffness });
  }
}
