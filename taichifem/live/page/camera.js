// A camera that turns about a target; z is up.

import { add, cross, dot, length, scale, sub, times, unit } from './algebra.js';

export class Camera {
  constructor() {
    this.eye = [3, -3, 2];
    this.target = [0, 0, 0];
    this.fov = 35;
    this.moved = false; // by hand, which the server does not know yet
    this.stale = true; // since the last picture
  }

  set({ eye, target, fov }) {
    Object.assign(this, { eye: [...eye], target: [...target], fov, stale: true });
  }

  get axes() {
    const forward = unit(sub(this.target, this.eye));
    const right = unit(cross(forward, Math.abs(forward[2]) < 0.9999 ? [0, 0, 1] : [0, 1, 0]));
    return { forward, right, up: cross(right, forward) };
  }

  // Turn by angles [radians].
  orbit(sideways, upwards) {
    const arm = sub(this.eye, this.target);
    const reach = length(arm);
    const azimuth = Math.atan2(arm[1], arm[0]) - sideways;
    const height = Math.min(Math.max(Math.asin(arm[2] / reach) + upwards, -1.55), 1.55);
    const flat = reach * Math.cos(height);
    this.eye = add(this.target, [flat * Math.cos(azimuth), flat * Math.sin(azimuth), reach * Math.sin(height)]);
    this.moved = this.stale = true;
  }

  // Shift by parts of the height of the picture.
  pan(x, y) {
    const { right, up } = this.axes;
    const size = 2 * Math.tan(this.fov * Math.PI / 360) * length(sub(this.eye, this.target));
    const shift = add(scale(right, -x * size), scale(up, y * size));
    this.eye = add(this.eye, shift);
    this.target = add(this.target, shift);
    this.moved = this.stale = true;
  }

  zoom(factor) {
    this.eye = add(this.target, scale(sub(this.eye, this.target), factor));
    this.moved = this.stale = true;
  }

  // What takes world coordinates to those of the screen.
  matrix(aspect) {
    const { forward, right, up } = this.axes;
    const reach = length(sub(this.target, this.eye));
    const near = 0.01 * reach, far = 60 * reach, f = 1 / Math.tan(this.fov * Math.PI / 360);
    const look = [
      right[0], up[0], -forward[0], 0, right[1], up[1], -forward[1], 0, right[2], up[2], -forward[2], 0,
      -dot(right, this.eye), -dot(up, this.eye), dot(forward, this.eye), 1,
    ];
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    return times([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, a, -1, 0, 0, b, 0], look);
  }

  // The ray through a point of the screen, x and y from -1 to 1.
  ray(x, y, aspect) {
    const { forward, right, up } = this.axes;
    const t = Math.tan(this.fov * Math.PI / 360);
    return { from: this.eye, along: unit(add(forward, add(scale(right, x * t * aspect), scale(up, y * t)))) };
  }
}
