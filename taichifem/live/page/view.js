// Draws everything with WebGL2: bodies, colliders, the ground with shadows on it, hands.

import { across, cross, dot, length, scale, sub, unit } from './algebra.js';
import { sumNormals } from './surface.js';
import { BODY, PLANE, SOLID } from './shaders.js';

const WIDTH = 1024; // of the textures that hold places and normals
const PLANE_KIND = 0, SPHERE_KIND = 1;
const GREY = [0.663, 0.678, 0.702], PULL = [0.93, 0.49, 0.13], PIN = [0.45, 0.25, 0.65];

export class View {
  constructor(canvas, camera) {
    const gl = canvas.getContext('webgl2', { antialias: true, stencil: true, alpha: false });
    if (!gl) throw new Error('this browser has no WebGL2');
    Object.assign(this, { canvas, camera, gl, extent: 1, wire: false, topology: null, update: null });
    this.body = program(gl, BODY);
    this.solid = program(gl, SOLID);
    this.plane = program(gl, PLANE);
    this.shapes = [mesh(gl, ...sphere()), mesh(gl, ...box())];
    this.disc = mesh(gl, disc(), null);
    this.places = texture(gl);
    this.normals = texture(gl);
    this.map = gl.createTexture();
    this.surface = gl.createVertexArray();
  }

  // Colours of values, from low to high, as "#rrggbb".
  setMap(colors) {
    const gl = this.gl, row = new Uint8Array(4 * 256);
    const anchors = colors.map((text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16)));
    for (let k = 0; k < 256; k++) {
      const at = k / 255 * (anchors.length - 1), i = Math.min(Math.floor(at), anchors.length - 2);
      for (let c = 0; c < 3; c++) row[4 * k + c] = anchors[i][c] + (at - i) * (anchors[i + 1][c] - anchors[i][c]);
      row[4 * k + 3] = 255;
    }
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, row);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  }

  setTopology(topology) {
    const gl = this.gl;
    this.topology = topology;
    this.update = null;
    this.normalSums = new Float32Array(4 * WIDTH * Math.ceil(topology.normals / WIDTH));
    this.placeRows = new Float32Array(4 * WIDTH * Math.ceil(topology.nodes.length / WIDTH));
    const tints = new Uint8Array(4 * topology.triangles.length);
    for (let c = 0; c < topology.triangles.length; c++) {
      tints.set(topology.colors.subarray(4 * Math.floor(c / 3), 4 * Math.floor(c / 3) + 4), 4 * c);
    }
    (this.buffers ?? []).forEach((buffer) => gl.deleteBuffer(buffer));
    gl.bindVertexArray(this.surface);
    this.buffers = [topology.triangles, topology.corners, tints].map((data, k) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(k);
      if (k < 2) gl.vertexAttribIPointer(k, 1, gl.UNSIGNED_INT, 0, 0);
      else gl.vertexAttribPointer(k, 4, gl.UNSIGNED_BYTE, true, 0, 0);
      return buffer;
    });
  }

  setUpdate(update) {
    const { gl, placeRows } = this;
    this.update = update;
    for (let i = 0; i < update.points.length / 3; i++) {
      placeRows[4 * i] = update.points[3 * i];
      placeRows[4 * i + 1] = update.points[3 * i + 1];
      placeRows[4 * i + 2] = update.points[3 * i + 2];
      placeRows[4 * i + 3] = update.values ? update.values[i] / 255 : -1;
    }
    sumNormals(this.topology, update.points, this.normalSums);
    for (const [table, rows] of [[this.places, placeRows], [this.normals, this.normalSums]]) {
      gl.bindTexture(gl.TEXTURE_2D, table);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, WIDTH, rows.length / 4 / WIDTH, 0, gl.RGBA, gl.FLOAT, rows);
    }
  }

  get aspect() {
    return this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1);
  }

  // Of the picture, in pixels.
  get size() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    return [Math.round(this.canvas.clientWidth * ratio), Math.round(this.canvas.clientHeight * ratio)];
  }

  get resized() {
    return this.canvas.width !== this.size[0] || this.canvas.height !== this.size[1];
  }

  draw() {
    const { gl, canvas, camera } = this;
    if (this.resized) [canvas.width, canvas.height] = this.size;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.953, 0.961, 0.969, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    if (!this.update) return;
    gl.enable(gl.DEPTH_TEST);
    this.matrix = camera.matrix(this.aspect);
    const colliders = split(this.update.colliders, 16).map(asCollider);
    const floor = colliders.filter((c) => c.kind === PLANE_KIND && c.turn[8] > 0.1).sort((a, b) => b.turn[8] - a.turn[8])[0];
    colliders.filter((c) => c.kind === PLANE_KIND).forEach((c) => this.drawPlane(c, c === floor));
    const solids = colliders.filter((c) => c.kind !== PLANE_KIND);
    if (floor && isBefore(camera.eye, floor)) this.drawShadows(floor, solids);
    this.drawBodies(null);
    solids.forEach((c) => this.drawSolid(c, GREY, null));
    split(this.update.hands, 8).forEach((hand) => this.drawHand(hand));
  }

  drawBodies(floor) {
    const { gl, body } = this;
    body.use({ camera: this.matrix, eye: this.camera.eye, floor_: floor, shadow: !!floor, wire: this.wire });
    [this.places, this.normals, this.map].forEach((table, k) => {
      gl.activeTexture(gl.TEXTURE0 + k);
      gl.bindTexture(gl.TEXTURE_2D, table);
    });
    body.use({ places: 0, normals: 1, map: 2 });
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(this.surface);
    gl.drawArrays(gl.TRIANGLES, 0, this.topology.triangles.length);
  }

  drawSolid({ kind, turn, center, size }, tint, floor) {
    const { gl, solid } = this;
    const shape = this.shapes[kind === SPHERE_KIND ? 0 : 1];
    solid.use({ camera: this.matrix, eye: this.camera.eye, floor_: floor, shadow: !!floor, turn, center, size, tint });
    gl.bindVertexArray(shape.array);
    gl.drawArrays(gl.TRIANGLES, 0, shape.count);
  }

  // Each spot in the shade once, however many triangles cast it there.
  drawShadows(floor, solids) {
    const { gl } = this;
    const normal = floor.turn.slice(6, 9), plane = [...normal, dot(normal, floor.center)];
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(-2, -2);
    gl.depthMask(false);
    this.drawBodies(plane);
    solids.forEach((c) => this.drawSolid(c, GREY, plane));
    gl.depthMask(true);
    [gl.BLEND, gl.STENCIL_TEST, gl.POLYGON_OFFSET_FILL].forEach((what) => gl.disable(what));
  }

  drawPlane({ turn, center }, isFloor) {
    const { gl, plane, camera, extent } = this;
    const normal = turn.slice(6, 9);
    if (!isBefore(camera.eye, { turn, center })) return;
    const height = dot(normal, sub(camera.target, center));
    const foot = sub(camera.target, scale(normal, height));
    const reach = length(sub(camera.eye, camera.target));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    plane.use({
      camera: this.matrix, center: foot, origin: center, across: turn.slice(0, 3), along: turn.slice(3, 6),
      radius: isFloor ? 3.2 * reach : 1.2 * extent, cell: 10 ** Math.round(Math.log10(extent / 4)),
    });
    gl.bindVertexArray(this.disc.array);
    gl.drawArrays(gl.TRIANGLES, 0, this.disc.count);
    gl.disable(gl.BLEND);
  }

  drawHand([x, y, z, tx, ty, tz, , firm]) {
    const tint = firm ? PIN : PULL, knob = 0.012 * length(sub(this.camera.eye, this.camera.target));
    const ends = [[x, y, z], [tx, ty, tz]], still = [1, 0, 0, 0, 1, 0, 0, 0, 1];
    ends.forEach((center) => this.drawSolid({ kind: SPHERE_KIND, turn: still, center, size: [knob, knob, knob] }, tint, null));
    const arm = sub(ends[1], ends[0]), reach = length(arm);
    if (reach < knob) return;
    const w = unit(arm), [u, v] = across(w), center = scale([x + tx, y + ty, z + tz], 0.5);
    this.drawSolid({ kind: 2, turn: [...u, ...v, ...w], center, size: [0.4 * knob, 0.4 * knob, reach] }, tint, null);
  }
}

const split = (numbers, size) => Array.from({ length: numbers.length / size }, (_, k) => numbers.subarray(size * k, size * (k + 1)));

// Is a point on the free side of a plane?
const isBefore = (point, { turn, center }) => dot(turn.slice(6, 9), sub(point, center)) > 0;

// Rows of R and c, kind and size; matrices of shaders go by columns.
function asCollider(row) {
  const turn = [0, 4, 8, 1, 5, 9, 2, 6, 10].map((k) => row[k]);
  return { kind: row[12], turn, center: [row[3], row[7], row[11]], size: [row[13], row[14], row[15]] };
}

function program(gl, { vertex, fragment }) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const set = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const { name, type } = gl.getActiveUniform(made, k);
    const where = gl.getUniformLocation(made, name);
    set[name] = {
      [gl.FLOAT]: (v) => gl.uniform1f(where, v), [gl.BOOL]: (v) => gl.uniform1i(where, v ? 1 : 0),
      [gl.FLOAT_VEC3]: (v) => gl.uniform3fv(where, v), [gl.FLOAT_VEC4]: (v) => gl.uniform4fv(where, v),
      [gl.FLOAT_MAT3]: (v) => gl.uniformMatrix3fv(where, false, v),
      [gl.FLOAT_MAT4]: (v) => gl.uniformMatrix4fv(where, false, v), [gl.SAMPLER_2D]: (v) => gl.uniform1i(where, v),
    }[type];
  }
  return {
    use(values) {
      gl.useProgram(made);
      for (const [name, value] of Object.entries(values)) if (value !== null) set[name]?.(value);
    },
  };
}

// A table of four numbers an entry.
function texture(gl) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  return made;
}

function mesh(gl, positions, normals) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  [positions, normals].forEach((data, k) => {
    if (!data) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, normals ? 3 : 2, gl.FLOAT, false, 0, 0);
  });
  return { array, count: positions.length / (normals ? 3 : 2) };
}

function sphere(rings = 20, sectors = 40) {
  const at = (i, j) => {
    const a = Math.PI * i / rings, b = 2 * Math.PI * j / sectors;
    return [Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)];
  };
  const points = [];
  for (let i = 0; i < rings; i++) {
    for (let j = 0; j < sectors; j++) {
      for (const [di, dj] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]) points.push(...at(i + di, j + dj));
    }
  }
  return [points, points];
}

function box() {
  const points = [], normals = [];
  for (const n of [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) {
    const [u] = across(n), v = cross(n, u);
    for (const [s, t] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
      points.push(...n.map((x, k) => 0.5 * (x + s * u[k] + t * v[k])));
      normals.push(...n);
    }
  }
  return [points, normals];
}

function disc(sectors = 64) {
  const points = [];
  for (let k = 0; k < sectors; k++) {
    const [a, b] = [k, k + 1].map((s) => 2 * Math.PI * s / sectors);
    points.push(0, 0, Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b));
  }
  return points;
}
